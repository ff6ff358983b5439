"""After a silence commanding resumes without a step, whatever the controller did meanwhile."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.fri.guard.joint_guard import Limits
from heptarm.values.robot import robot
from tests.oracles.fri.gap_recovery import joints_after_gap, motion_in_gap, vector_in_gap
from tests.oracles.fri.joint_guard import JointGuard

LIMITS = Limits.of(robot("iiwa14"))
PERIOD = 5e-3
Travel = Callable[[float, float], tuple[float, float]]


def goes_on(speed: float, time: float) -> tuple[float, float]:
    """Distance and speed after a time, of a controller that keeps the last speed."""
    return speed * time, speed


def stands(speed: float, time: float) -> tuple[float, float]:
    """One that holds the last command."""
    return 0.0, 0.0


def brakes(speed: float, time: float, *, coast: float = 0.0) -> tuple[float, float]:
    """One that brakes with 10 rad/s², at once or after a while."""
    slowing, begun = 10.0, max(0.0, time - coast)
    lasting = min(begun, abs(speed) / slowing)
    end = speed - math.copysign(slowing * lasting, speed)
    return speed * min(time, coast) + 0.5 * (speed + end) * lasting, end


def coasts(speed: float, time: float) -> tuple[float, float]:
    """As the virtual cabinet does."""
    return brakes(speed, time, coast=2 * PERIOD)


@pytest.mark.parametrize("speed", [-1.2, -0.3, 0.0, 0.05, 1.4])
@pytest.mark.parametrize("time", [0.03, 0.06, 0.15, 0.5])
@pytest.mark.parametrize("controller", [goes_on, stands, brakes])
def test_place_and_speed_are_reported_from_the_way(controller: Travel, time: float, speed: float) -> None:
    chain, lag = 0.4, 2 * PERIOD
    travel, end = controller(speed, time)
    then, now = chain - lag * speed, chain + travel - lag * end
    for is_exact in (True, False):
        (place,), (later,) = joints_after_gap(
            [chain], [speed], [then], [now], time=time, period=PERIOD, is_exact=is_exact
        )
        # a lagging reading has caught up when the arm rests
        assert later == pytest.approx(end, abs=2.1 * lag * abs(speed) / time + 1e-12)
        assert place == pytest.approx(chain + travel, abs=2.1 * lag * abs(speed) + 1e-12)


@pytest.mark.parametrize("time", [0.03, 0.06, 0.12, 0.4])
@pytest.mark.parametrize("controller", [goes_on, stands, brakes, coasts])
def test_what_is_sent_after_it_makes_no_step_of_the_velocity(controller: Travel, time: float) -> None:
    guard, start = JointGuard(LIMITS), (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
    guard.start(start, (0.0,) * 7, period=PERIOD)
    goal = [value + 1.0 for value in start]
    for _ in range(60):
        guard.position(goal)
    speeds = [v / PERIOD for v in guard.v]
    assert max(speeds) > 0.9
    chain = [q - v for q, v in zip(guard.q, guard.v, strict=True)]
    paths, ends = zip(*(controller(v, time) for v in speeds), strict=True)
    there = np.add(chain, paths)
    places, later = joints_after_gap(
        chain, speeds, chain, there.tolist(), time=time, period=PERIOD, is_exact=True
    )
    guard.start(places, later, period=PERIOD)
    first = np.subtract(guard.position(goal), there) / PERIOD
    assert first == pytest.approx(ends, abs=0.16), "rad/s; beginning at rest it would be up to 1.4"
    before = np.array(guard.q)
    for _ in range(400):
        now = np.array(guard.position(goal))
        assert (np.abs(now - before) <= np.multiply(LIMITS.dq_max, PERIOD) * (1 + 1e-6)).all()
        before = now
    assert before == pytest.approx(goal)


def test_an_arm_that_was_pushed_or_jumps_in_its_readings_is_not_followed() -> None:
    compliant = {"time": 0.06, "period": PERIOD, "is_exact": False}
    assert joints_after_gap([0.4], [0.0], [0.3], [0.1], **compliant) == ([0.4], [0.0])  # type: ignore[arg-type]
    (place,), (speed,) = joints_after_gap([0.4], [0.5], [0.3], [2.0], **compliant)  # type: ignore[arg-type]
    assert place == pytest.approx(0.4 + 0.03) and speed == 0.5, "no further than with the old speed"
    exact = {**compliant, "is_exact": True}
    assert joints_after_gap([0.4], [0.0], [0.4], [0.9], **exact) == ([0.4], [0.0])  # type: ignore[arg-type]


@given(st.floats(-2, 2), st.floats(-1, 1), st.floats(1e-3, 2.0))
def test_the_speed_is_never_more_than_before_nor_the_other_way(
    speed: float, travel: float, time: float
) -> None:
    gone, later = motion_in_gap(speed, travel, time)
    assert abs(later) <= abs(speed) and later * speed >= 0.0
    assert abs(gone) <= abs(speed * time) and gone * speed >= 0.0


def test_a_pose_is_carried_on_along_its_direction() -> None:
    assert vector_in_gap((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.05) == ([0.0] * 3, [0.0] * 3)
    travel, speed = vector_in_gap(
        (0.0, 0.2, 0.0), (0.5, 0.01, 0.0), 0.05
    )  # it continued, and was pushed aside
    assert travel == pytest.approx([0.0, 0.01, 0.0]) and speed == pytest.approx([0.0, 0.2, 0.0])
    travel, speed = vector_in_gap((0.0, 0.2, 0.0), (0.0, -0.01, 0.0), 0.05)
    assert travel == speed == [0.0, 0.0, 0.0]
