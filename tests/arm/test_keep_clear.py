"""Targets of servo streams that are too near to bodies: refused, and the arm is held at the last good one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.motion.clear import ClearTargets
from heptarm.values.clearance import Clearance
from tests.conftest import RunningCabinet

SPEED = 5.0

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
A7 = np.array([0, 0, 0, 0, 0, 0, 1.0])
#: Longest time of this machine for what takes a second [s].
PATIENCE = 40.0


class Wall:
    """A model in which A7 approaches a wall, and A6 a fence that may be touched.

    Attributes:
        asked: at how many joint positions.
    """

    margin = 0.02
    allowed = frozenset({frozenset(("tool", "fence"))})

    def __init__(self, at: float = 0.3) -> None:
        self._at = at
        self.asked = 0

    def clearances(self, q: np.ndarray, *, below: float) -> tuple[Clearance, ...]:
        self.asked += 1
        near = (Clearance("tool", "wall", max(0.0, self._at - q[6])), Clearance("tool", "fence", 1.0 - q[5]))
        return tuple(one for one in near if one.distance < below)


# ------------------------------------------------------------------------------------ without a cabinet


def test_a_target_that_is_too_near_is_refused_and_the_last_good_one_stays() -> None:
    clear = ClearTargets(Wall(), np.zeros(7))
    clear.check(0.27 * A7, parameter="q")
    with pytest.raises(ha.CollisionForeseen) as refused:
        clear.check(0.29 * A7, parameter="q")
    error = refused.value
    assert "tool is 10 mm from wall, which must be at least 20 mm" in str(error)
    assert (error.parameter, error.value, error.allowed) == ("q", 0.01, "at least 0.02 m")
    assert error.touch.clearance.second == "wall" and error.touch.at == 1.0
    assert clear.q[6] == 0.27 and clear.held == 1
    assert str(clear.slowdown) == "0% of the commanded speed: tool near wall"
    clear.check(0.26 * A7, parameter="q")
    assert not clear.slowdown.reason and clear.held == len(clear.slowdowns) == 1


def test_what_is_between_two_targets_counts_and_allowed_pairs_do_not() -> None:
    clear = ClearTargets(Wall(), np.zeros(7))
    with pytest.raises(ha.CollisionForeseen) as refused:
        clear.check(0.6 * A7, parameter="q")  # behind the wall
    assert 0.4 < refused.value.touch.at < 0.6 and refused.value.touch.q[6] < 0.35
    clear.check(np.array([0, 0, 0, 0, 0, 1.2, 0]), parameter="q")  # into the fence


def test_a_small_step_asks_the_model_once() -> None:
    model = Wall()
    clear = ClearTargets(model, np.zeros(7))
    before = model.asked
    clear.check(0.01 * A7, parameter="q")
    assert model.asked == before + 1


def test_a_stream_that_begins_too_near_may_leave_but_not_approach() -> None:
    clear = ClearTargets(Wall(at=0.01), np.zeros(7))
    clear.check(np.zeros(7), parameter="q")
    with pytest.raises(ha.CollisionForeseen):
        clear.check(0.005 * A7, parameter="q")
    clear.check(-0.005 * A7, parameter="q")
    clear.check(-0.1 * A7, parameter="q")
    with pytest.raises(ha.CollisionForeseen):
        clear.check(np.zeros(7), parameter="q")  # it has been left: from now on it counts


# ----------------------------------------------------------------------------------------- with a cabinet


@pytest.fixture(scope="module")
def shared(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture
def arm(shared: ha.Arm) -> ha.Arm:
    if np.abs(shared.state.q - HOME).max() > 1e-3:
        shared.move(ha.ptp(HOME))
    return shared


@pytest.fixture(scope="module")
def box() -> ha.CollisionModel:
    """A box below the flange at home."""
    return ha.CollisionModel("iiwa14", boxes=["0.55,0,0.1,0.4,0.4,0.2"], margin=0.02)


def test_joint_targets_stop_at_the_last_good_one_and_the_stream_goes_on(arm: ha.Arm) -> None:
    wall = float(HOME[6] + 0.31)  # no target lies at its margin, where the last digit would decide
    refused = 0
    with arm.servo(
        "joint", rate=50, speed=1.0, acceleration=1.0, keep_clear_of=Wall(wall), watchdog=2.0
    ) as sv:
        last, goal = sv.start.q, sv.start.q
        while sv.tick() and sv.t < PATIENCE and refused < 3:
            goal = goal + 0.02 * A7
            try:
                last = sv.set(goal, 0.1 * A7)
            except ha.CollisionForeseen as error:
                refused += 1
                assert "tool" in str(error) and error.parameter == "q"
                assert sv.stats.slowdown.reason == "tool near wall" and sv.stats.slowdown.factor == 0.0
        while sv.tick() and sv.t < PATIENCE and np.abs(arm.state.q - last).max() > 2e-3:
            with pytest.raises(ha.CollisionForeseen):  # held, and the watchdog is content
                sv.set(goal)
        assert np.abs(arm.state.q - last).max() < 2e-3 and last[6] < wall - Wall.margin
        sv.set(last - 0.1 * A7)
        arm.wait_until(lambda state: state.q[6] < last[6] - 0.09, timeout=PATIENCE)
        assert not sv.stats.slowdown.reason and [slowdown.reason for slowdown in sv.stats.slowdowns] == [
            "tool near wall"
        ]
    stats = sv.stats
    assert stats.held >= 3 and stats.refused == 0
    assert f"{stats.held} targets at the last good one" in str(stats)


@pytest.mark.parametrize("kind", ["pose", "lin"])
def test_poses_stop_above_a_box(arm: ha.Arm, box: ha.CollisionModel, kind: Any) -> None:
    pen = ha.Tool("pen", shapes=[ha.shapes.capsule(0.02, 0.1, at=ha.Pose.at(0, 0, 0.05))])
    fast: Any = {"speed_mps": 0.5, "acceleration_mps2": 2.0} if kind == "lin" else {"speed": 1.0}
    with arm.tool(pen), arm.servo(kind, rate=50, keep_clear_of=box, watchdog=2.0, **fast) as sv:
        start = last = sv.start.pose
        depth = 0.0
        while sv.tick() and sv.t < PATIENCE and not sv.stats.held:
            depth += 0.01
            try:
                last = sv.set(ha.Pose.of(start.xyz - [0, 0, depth], start.quat))
            except ha.CollisionForeseen as error:
                assert error.touch.clearance.first == "pen" and error.parameter == "pose"
        while sv.tick() and sv.t < PATIENCE and arm.state.pose.distance_to(last) > 2e-3:
            with pytest.raises(ha.CollisionForeseen):
                sv.set(ha.Pose.of(start.xyz - [0, 0, depth + 0.2], start.quat))
        assert arm.state.pose.distance_to(last) < 2e-3
        gap = min(clearance.distance for clearance in box.carrying(pen).clearances(arm.state.q))
        sv.set(start)  # it may leave
    assert sv.stats.slowdowns[0].reason.startswith("pen near box") and sv.stats.refused == 0
    assert 0.017 < gap < 0.033


def test_a_pose_out_of_reach_is_held_for_that_reason(arm: ha.Arm, box: ha.CollisionModel) -> None:
    with arm.servo("pose", rate=50, keep_clear_of=box, watchdog=2.0) as sv:
        while sv.tick() and sv.t < PATIENCE and not sv.stats.held:
            sv.set(ha.Pose.of([3.0, 0, 0], sv.start.pose.quat))
    assert sv.stats.held and not sv.stats.refused and sv.stats.slowdown.factor == 0.0
    assert "box" not in sv.stats.slowdown.reason


@pytest.mark.parametrize("kind", ["joint", "velocity"])
def test_a_model_that_fails_ends_the_block_and_the_arm_rests(arm: ha.Arm, kind: Any) -> None:
    class Fails(Wall):
        def clearances(self, q: np.ndarray, *, below: float) -> tuple[Clearance, ...]:
            if q[6] > HOME[6] + 0.05:
                raise ZeroDivisionError("of the model")
            return ()

    with (
        pytest.raises(ZeroDivisionError, match="of the model"),
        arm.servo(kind, keep_clear_of=Fails(), watchdog=2.0) as sv,
    ):
        while sv.tick() is not None:
            sv.set(sv.start.q + 0.1 * A7 if kind == "joint" else 0.3 * A7)
    assert np.abs(arm.wait_for_rest().dq).max() < 0.01
    sv.set(HOME + A7)  # after the end it has no effect


def test_a_model_that_fails_at_once_begins_no_stream(arm: ha.Arm) -> None:
    class Fails(Wall):
        def clearances(self, q: np.ndarray, *, below: float) -> tuple[Clearance, ...]:
            raise ZeroDivisionError("of the model")

    with pytest.raises(ZeroDivisionError), arm.servo("pose", keep_clear_of=Fails(), watchdog=2.0):
        raise AssertionError("it began")
    arm.wait_for_rest()
    assert arm.move(ha.ptp(HOME)).arrived


@pytest.mark.parametrize("kind", ["joint", "pose", "lin"])
def test_what_is_no_model_is_refused(arm: ha.Arm, kind: Any) -> None:
    with pytest.raises(ha.ShapeError, match="keep_clear_of must have a method clearances"):
        arm.servo(kind, keep_clear_of="table")  # type: ignore[call-overload]
