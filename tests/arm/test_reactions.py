"""Reactions to a break condition through the whole stack: the arm stays, relaxes or retreats; forces are reported."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.condition.force import force
from heptarm.values.condition.reaction import Reaction
from heptarm.values.condition.signals import path
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.result import Result
from tests.simulators import FASTER

TABLE = 0.3
TARGET = f"sim://iiwa14?speed={FASTER:g}&box=0.6,0,{TABLE / 2},0.4,0.6,{TABLE}"


@pytest.fixture(scope="module")
def table() -> Iterator[ha.Arm]:
    """An arm above a table."""
    with ha.connect(TARGET, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture
def arm(table: ha.Arm) -> ha.Arm:
    table.move(ha.ptp(ha.deg(0, 35, 0, -80, 0, 65, 0)), speed=0.7)
    height = float(table.wait_for_rest().pose.xyz[2])
    table.move(ha.lin_rel(z=TABLE + 0.02 - height, frame="base", speed_mps=0.2))
    return table


def press(arm: ha.Arm, then: Reaction | None, speed: float = 0.05, **more: Any) -> Result:
    result = arm.move(ha.lin_rel(z=-0.2, frame="base", speed_mps=speed), until=force > 20, then=then, **more)
    assert result.cause is ha.Cause.CONDITION and result.stopped_by == (force > 20)
    return result


def weight(arm: ha.Arm) -> float:
    return float(np.linalg.norm(arm.wait_for_rest().wrench.force))


def test_it_stays_and_reports_its_forces(arm: ha.Arm) -> None:
    result = press(arm, "stay")
    assert 20.0 < result.peak_force < 100.0
    assert result.rest_force == pytest.approx(weight(arm), abs=1.0)
    assert result.rest_force > 15.0
    lifted = arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1), until=force > 500)
    assert lifted.arrived and isnan(lifted.peak_force) and isnan(lifted.rest_force)


def test_it_relaxes(arm: ha.Arm) -> None:
    result = press(arm, "relax")
    assert result.peak_force > 20.0 and result.rest_force < 10.0
    assert weight(arm) == pytest.approx(result.rest_force, abs=3.0)
    state = arm.wait_for_rest()
    assert np.abs(state.q - state.q_cmd).max() < 1e-3, "it holds the position reached"


def test_it_retreats_along_its_path(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    result = press(arm, ha.Retreat(0.01))
    assert result.fired_at is not None and result.rest_force < 1.0
    end = arm.wait_for_rest().pose
    assert end.xyz[2] - result.fired_at.pose.xyz[2] == pytest.approx(0.01, abs=0.003)
    assert np.abs(end.xyz[:2] - start.xyz[:2]).max() < 1e-3


def test_it_retreats_at_most_to_its_start(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    press(arm, ha.Retreat(0.2, speed=0.3))
    assert np.abs(arm.wait_for_rest().pose.xyz - start.xyz).max() < 1e-3


def test_it_retreats_along_joints_too(arm: ha.Arm) -> None:
    before = arm.wait_for_rest()
    goal = before.q + ha.deg(40, 0, 0, 0, 0, 0, 0)
    result = arm.move(ha.ptp(goal, speed=0.3), until=path.after(0.1), then=ha.Retreat(0.05))
    assert result.stopped_by == path.after(0.1)
    after = arm.wait_for_rest()
    assert np.abs(np.delete(after.q - before.q, 0)).max() < 1e-3, "only A1 has turned"
    assert result.state is not None and result.fired_at is not None
    assert 0.03 < after.pose.distance_to(before.pose) < 0.11


def test_a_compliant_motion_reacts_as_well(arm: ha.Arm) -> None:
    compliant = CartesianImpedance(stiffness=(3000, 3000, 3000, 200, 200, 200))
    assert press(arm, "relax", mode=compliant).rest_force < 10.0
    arm.move(ha.lin_rel(z=0.02, frame="base", speed_mps=0.1))
    assert press(arm, ha.Retreat(0.02), mode=compliant).rest_force < 2.0


def test_what_follows_starts_from_where_it_has_reacted(arm: ha.Arm) -> None:
    handle = arm.start(ha.lin_rel(z=-0.2, frame="base", speed_mps=0.05), until=force > 20, then="relax")
    up = arm.start(ha.lin_rel(z=0.03, frame="base", speed_mps=0.05))
    first, second = handle.wait(timeout=30.0), up.wait(timeout=30.0)
    assert first.cause is ha.Cause.CONDITION and second.arrived
    assert arm.wait_for_rest().pose.xyz[2] == pytest.approx(TABLE + 0.03, abs=0.005)


def test_a_stop_ends_the_reaction(arm: ha.Arm) -> None:
    handle = arm.start(
        ha.lin_rel(z=-0.2, frame="base", speed_mps=0.05), until=force > 20, then=ha.Retreat(0.3, speed=0.01)
    )
    arm.wait_until(lambda s: np.linalg.norm(s.wrench.force) > 15.0, timeout=30.0)
    arm.wait_until(lambda s: np.linalg.norm(s.wrench.force) < 1.0, timeout=30.0)
    arm.stop()
    with pytest.raises(ha.MotionAborted) as caught:
        handle.wait(timeout=30.0)
    assert caught.value.result is not None and caught.value.result.cause is ha.Cause.STOPPED
    assert arm.wait_for_rest().pose.xyz[2] < TABLE + 0.019


def test_a_touch_rests_lightly(arm: ha.Arm) -> None:
    contact = arm.touch("-z", frame="base", distance=0.1, force=10.0, speed_mps=0.02)
    assert contact.result.rest_force < 15.0 and contact.result.peak_force < 25.0
    assert weight(arm) < 15.0


def test_a_guarded_motion_relaxes(arm: ha.Arm) -> None:
    with pytest.raises(ha.CollisionDetected) as caught, arm.guarded():
        arm.move(ha.lin_rel(z=-0.2, frame="base", speed_mps=0.05))
    result = caught.value.result
    assert result is not None and result.rest_force < 0.5 * result.peak_force


def test_a_reaction_needs_a_condition_and_a_name(arm: ha.Arm) -> None:
    with pytest.raises(ha.ShapeError, match="then is the reaction to a break condition"):
        arm.start(ha.lin_rel(z=0.01), then="relax")
    wrong: Any = "bounce"
    with pytest.raises(ha.ShapeError, match="then must be 'stay', 'relax' or a Retreat, got 'bounce'"):
        arm.start(ha.lin_rel(z=0.01), until=force > 10, then=wrong)
    for distance in (0.0, 0.6, -0.1, float("nan")):
        with pytest.raises(ha.LimitError, match="distance must be in"):
            ha.Retreat(distance)
    with pytest.raises(ha.LimitError, match="speed must be in"):
        ha.Retreat(0.01, speed=0.0)
