"""Readings of a state besides positions: inaccuracy of the estimated forces, redundancy, stamps of the groups."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from heptarm import Arm, State, connect
from heptarm.model.inverse_kinematics import redundancy
from heptarm.model.kinematics import jacobian
from heptarm.values.checks import Array
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from heptarm.values.state import GROUP_NAMES
from tests.conftest import RunningCabinet
from tests.simulators import FASTER

#: Of the shared virtual cabinet.
SPEED = FASTER
#: Inaccuracy of a simulated torque sensor [Nm].
SENSOR = 0.5


@pytest.fixture
def arm(cabinet: RunningCabinet) -> Iterator[Arm]:
    """An arm at home; patient, for busy machines."""
    with connect(cabinet.target, watchdog=5.0) as arm:
        arm.move(ptp(deg(0, 30, 0, -90, 0, 60, 0)))
        yield arm


def settled(arm: Arm) -> State:
    arm.move(hold(0.1))
    now = arm.state.stamp
    return arm.wait_until(lambda state: state.stamp > now + 30_000_000)


def expected(arm: Arm, q: Array) -> Array:
    j = jacobian(arm.robot, q)
    inverse = np.linalg.inv(j @ j.T + 1e-6 * np.eye(6))
    return SENSOR * np.sqrt(np.diag(inverse))


def test_the_estimate_of_forces_reports_how_far_it_may_be_off(arm: Arm) -> None:
    state = settled(arm)
    reported = np.concatenate([state.wrench.force_inaccuracy, state.wrench.torque_inaccuracy])
    assert reported == pytest.approx(expected(arm, state.q), rel=0.01)
    assert state.wrench.valid(force=5.0, torque=5.0)
    turned = arm.wrench("flange", axes="flange")
    assert (turned.force_inaccuracy > 0.0).all()


def test_near_a_singularity_it_is_worthless_and_reports_it(arm: Arm) -> None:
    arm.move(ptp(deg(0, 30, 0, -1, 0, 60, 0)))
    assert not settled(arm).wrench.valid()
    arm.move(ptp(deg(0, 30, 0, -90, 0, 60, 0)))
    assert settled(arm).wrench.valid()


def test_redundancy_is_that_of_the_joints(arm: Arm) -> None:
    arm.move(ptp(deg(20, 40, -30, -80, 10, 50, 0)))
    state = settled(arm)
    wanted = redundancy(arm.robot, state.q.tolist())
    assert state.redundancy.e1 == pytest.approx(wanted.e1, abs=1e-4)
    assert state.redundancy.status == wanted.status


def test_each_group_has_its_own_stamp(arm: Arm) -> None:
    state = settled(arm)
    groups = [getattr(state.groups, name) for name in GROUP_NAMES if name != "io"]
    stamps = [group.stamp for group in groups if group is not None]
    assert len(stamps) == len(groups)
    assert max(stamps) == state.stamp
    later = settled(arm)
    assert later.groups.mode is not None
    assert state.groups.mode is not None
    assert later.groups.mode.stamp > state.groups.mode.stamp
