"""Arcs, splines and blended programs through the whole stack, measured on the pushed states."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm
from heptarm.arm.link.state_stream import States
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from tests.simulators import FASTER

HOME = deg(0, 30, 0, -90, 0, 60, 0)
#: Of the shared virtual cabinet.
SPEED = FASTER
SIDE_SPEED = 0.2  # [m/s]


def moved(pose: Pose, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(pose.xyz + [x, y, z], pose.quat)


def carried_out(arm: Arm, motion: object) -> tuple[ha.Result, Array]:
    """The result, and the positions of the flange during the motion, shape (n, 3) [m]."""
    states: States = arm.states(size=100_000)  # from before the start
    result = arm.start(motion).wait(timeout=60.0)  # type: ignore[arg-type]
    return result, np.array([state.pose.xyz for state in up_to(states, arm.wait_for_rest())])


def up_to(states: States, last: ha.State) -> Iterator[ha.State]:
    """States so far; a busy machine may be late with them."""
    for state in states:
        yield state
        if state.stamp >= last.stamp:
            break
    states.close()


def passes(places: Array, point: Array) -> float:
    """How near the path through places, shape (n, 3), comes to a point [m]."""
    begin, step = places[:-1], np.diff(places, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-18)
    fraction = np.clip(((point - begin) * step).sum(axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(begin + fraction[:, None] * step - point, axis=1).min())


def test_an_arc_and_its_orientation(arm: Arm) -> None:
    start = arm.wait_for_rest().pose
    centre = start.xyz + [0, 0.08, 0]
    result, places = carried_out(arm, ha.arc(start, 2.0, centre=centre, speed_mps=0.3))
    assert result.arrived
    radii = np.linalg.norm(places - centre, axis=1)
    assert len(places) > 10 and np.abs(radii - 0.08).max() < 0.5e-3
    end = arm.wait_for_rest().pose
    assert end.angle_to(start) < 1e-3
    back = ha.arc(end, -2.0, centre=centre, reference="path", orientation="constant", speed_mps=0.3)
    assert arm.move(back).arrived
    there = arm.wait_for_rest().pose
    assert there.distance_to(start) < 5e-4 and there.angle_to(start) == pytest.approx(2.0, abs=2e-3)
    arm.move(ha.ptp(HOME))
    arm.move(ha.lin(moved(start, z=0.05), orientation="joint", speed_mps=0.3))
    assert arm.wait_for_rest().pose.angle_to(start) < 1e-3


def test_a_blended_program_does_not_stop_and_reports_every_motion(arm: Arm) -> None:
    start = arm.wait_for_rest().pose
    corners = [(0.0, 0.12), (0.08, 0.12), (0.08, 0.0), (0.0, 0.0)]
    sides = [ha.lin(moved(start, x, y), speed_mps=SIDE_SPEED, blend_m=0.02) for x, y in corners]
    states: States = arm.states(size=100_000)
    handle = arm.start(sides)
    fractions = []
    while not handle.done:
        arm.wait_until(lambda state, last=arm.state.stamp: state.stamp > last)  # type: ignore[misc]
        fractions.append(handle.progress)
    result = handle.wait()
    assert result.arrived and result.item == 3
    assert (np.diff(fractions) > -0.02).all() and handle.progress == 1.0
    speeds = []
    last = None
    for state in up_to(states, arm.wait_for_rest()):
        pose = state.groups.pose
        assert pose is not None
        if last is not None and pose.stamp > last.stamp:
            travel = pose.pose.distance_to(last.pose)
            speeds.append(travel / (pose.stamp - last.stamp) * 1e9)
        last = pose
    fast = np.flatnonzero(np.array(speeds) > 0.8 * SIDE_SPEED)
    assert len(fast) > 10 and min(speeds[fast[0] : fast[-1]]) > 0.3 * SIDE_SPEED
    assert arm.wait_for_rest().pose.distance_to(start) < 5e-4


def test_a_failure_in_a_blended_program_moves_nothing(arm: Arm) -> None:
    before = arm.wait_for_rest().q
    with pytest.raises((ha.LimitError, ha.MotionAborted), match="motion 2 of the batch"):
        arm.move([ha.lin_rel(z=-0.05, blend_m=0.01), ha.lin_rel(x=3.0)])
    assert np.abs(arm.wait_for_rest().q - before).max() < 1e-3


def test_cancelling_a_blended_program_ends_all_of_it(arm: Arm) -> None:
    there = ha.ptp(HOME + deg(40, 0, 0, 0, 0, 0, 0), speed=0.3, blend_rel=0.2)
    handle = arm.start([there, ha.ptp(HOME, speed=0.3, blend_rel=0.2), there])
    arm.wait_until(lambda s: np.abs(s.dq).max() > 0.1, timeout=10.0)
    handle.cancel()
    assert handle.wait(timeout=10.0).cause is ha.Cause.CANCELLED
    arm.wait_for_rest(timeout=10.0)
    assert arm.move(ha.ptp(HOME)).arrived


def test_a_spline_passes_through_its_points(arm: Arm) -> None:
    start = arm.wait_for_rest().pose
    knots = [moved(start, 0.03, 0.05, 0.0), moved(start, 0.0, 0.1, 0.03), start]
    result, places = carried_out(arm, ha.spline(knots, speed_mps=0.15))
    assert result.arrived and arm.wait_for_rest().pose.distance_to(start) < 5e-4
    for knot in knots:
        assert passes(places, knot.xyz) < 2e-3
    around = ha.ellipse(start, 0.04, centre=start.xyz + [0, 0.07, 0], speed_mps=0.3)
    assert arm.move(around).arrived and arm.wait_for_rest().pose.distance_to(start) < 5e-4
    through = [HOME + deg(10, 5, 0, 10, 0, 0, 20), HOME + deg(20, 0, 5, 0, 0, 10, 0), HOME]
    assert arm.move(ha.spline_joints(through, speed=0.5)).arrived
    assert np.abs(arm.wait_for_rest().q - HOME).max() < 1e-3


def test_a_stop_in_a_spline_comes_to_rest(arm: Arm) -> None:
    start = arm.wait_for_rest().pose
    around = ha.ellipse(start, 0.08, centre=start.xyz + [0, 0.1, 0], speed_mps=0.2)
    handle = arm.start(around)
    arm.wait_until(lambda s: np.abs(s.dq).max() > 0.1, timeout=10.0)
    arm.stop()
    with pytest.raises(ha.MotionAborted, match="stop") as error:
        handle.wait(timeout=10.0)
    assert error.value.cause is ha.Cause.STOPPED
    arm.wait_for_rest(timeout=5.0)
