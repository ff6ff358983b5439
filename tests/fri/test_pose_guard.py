"""The guard of poses: sent poses never exceed the limits; valid ones pass unchanged; limited ones are reported."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.errors import LimitError
from heptarm.fri.guard.pose_guard import PoseLimited, PoseLimits, PoseReport
from tests.long import longer
from tests.oracles.fri.pose_guard import PoseGuard, between, moved

LIMITS = PoseLimits()
START = (0.5, 0.1, 0.4, 0.0, 1.0, 0.0, 0.0)
REST = (0.0,) * 6
NAN = math.nan


def begun(limits: PoseLimits = LIMITS, *, twist: tuple[float, ...] = REST, period: float = 1e-3) -> PoseGuard:
    guard = PoseGuard(limits)
    guard.start(START, twist, period=period)
    return guard


def run(guard: PoseGuard, targets: Iterable[object]) -> np.ndarray:
    """Sent commands, shape (n, 7)."""
    return np.array([guard.pose(wanted) for wanted in targets])  # type: ignore[arg-type]


def check(guard: PoseGuard, sent: np.ndarray, twist: tuple[float, ...] = REST) -> None:
    """Assert that the differences of the sent poses keep every limit."""
    period, limits = guard.period, guard.limits
    track = [START, *sent.tolist()]
    speeds = np.array([twist, *(np.divide(between(*two), period) for two in itertools.pairwise(track))])
    changes = np.diff(speeds, axis=0) / period
    noise = 1e-13 / period**2
    for part, top, most in (
        (slice(0, 3), limits.velocity, limits.acceleration),
        (slice(3, 6), limits.angular_velocity, limits.angular_acceleration),
    ):
        assert np.linalg.norm(speeds[:, part], axis=1).max() <= top * 1.000001
        assert np.linalg.norm(changes[:, part], axis=1).max() <= most * 1.000001 + noise
    assert np.abs(np.linalg.norm(sent[:, 3:], axis=1) - 1.0).max() < 1e-12


def test_a_motion_within_the_limits_passes_as_it_is() -> None:
    guard = begun()
    targets = [
        moved(START, [0.025 * (1 - math.cos(2 * t * 1e-3)), 0, 0, 0, 0.2 * (1 - math.cos(t * 1e-3)), 0])
        for t in range(2000)
    ]
    assert run(guard, targets) == pytest.approx(np.array(targets), abs=1e-15)
    assert guard.report.lines == []


def test_a_step_of_half_a_metre_becomes_a_motion_that_ends_there() -> None:
    guard = begun()
    goal = moved(START, (0.5, 0, 0, 0, 0, 0))
    sent = run(guard, [goal] * 3000)
    check(guard, sent)
    assert tuple(sent[-1]) == pytest.approx(goal, abs=1e-12) and guard.is_still
    assert sent[:, 0].max() <= goal[0] + 1e-9, "it does not go beyond"
    assert len(sent[np.abs(sent[:, 0] - goal[0]) > 1e-9]) < 2400, "2 s at 0.25 m/s, and the ramps"
    assert guard.report.lines[0].startswith("flange: velocity limited in ")
    assert "500 m/s requested, 0.25 allowed" in guard.report.lines[0]
    assert guard.report.lines[1].startswith("flange: acceleration limited in ")


def test_half_a_turn_at_once_becomes_a_motion_too() -> None:
    guard = begun()
    goal = (*START[:3], 1.0, 0.0, 0.0, 0.0)
    sent = run(guard, [goal] * 4000)
    check(guard, sent)
    assert between(sent[-1].tolist(), goal) == pytest.approx(REST, abs=1e-9) and guard.is_still
    assert all(line.startswith("rotation: ") for line in guard.report.lines)


def test_the_other_quaternion_of_a_rotation_is_no_motion() -> None:
    guard = begun()
    assert run(guard, [(*START[:3], 0.0, -1.0, 0.0, 0.0)] * 3)[-1].tolist() == list(START)
    assert guard.report.lines == [] and guard.is_still


def test_what_is_no_number_keeps_the_last_target() -> None:
    guard = begun()
    goal = moved(START, (0.01, 0.0, 0.0, 0.0, 0.0, 0.1))
    run(guard, [goal] * 1000)
    for wanted in ((NAN,) * 7, (math.inf,) * 7, (*goal[:3], 0.0, 0.0, 0.0, 0.0), (goal[0], NAN, *goal[2:])):
        assert guard.pose(wanted) == pytest.approx(goal) and guard.was_limited
    assert any("flange: target not finite in 3 cycles" in line for line in guard.report.lines)
    assert any("rotation: target not finite in 3 cycles" in line for line in guard.report.lines)
    sent = run(guard, [(NAN, NAN, goal[2] + 0.02, NAN, NAN, NAN, NAN)] * 1000)
    assert sent[-1] == pytest.approx(moved(goal, (0.0, 0.0, 0.02, 0, 0, 0))), "one coordinate is a number"


def test_it_starts_with_the_interpolators_speed_and_brakes_from_it() -> None:
    twist = (0.1, -0.1, 0.0, 0.3, 0.0, 0.2)
    guard = begun(twist=twist)
    on = [moved(START, [value * k * 1e-3 for value in twist]) for k in range(1, 100)]
    assert run(guard, on) == pytest.approx(np.array(on)) and guard.report.lines == []
    last = np.array(guard.sent)
    sent = run(guard, [None] * 400)
    assert guard.is_still and np.ptp(sent[-200:], axis=0).max() == 0.0
    travel = between(last.tolist(), sent[-1].tolist())
    assert np.linalg.norm(travel[:3]) == pytest.approx(0.02 / 2 / LIMITS.acceleration, rel=0.02)  # v²/2a
    assert np.cross(travel[:3], twist[:3]) == pytest.approx(np.zeros(3), abs=1e-12), "straight on"


def test_the_reach_is_a_ball_around_the_interpolator() -> None:
    guard = begun(PoseLimits(reach=0.05))
    goal = moved(START, (0.3, 0.4, 0.0, 0.0, 0.0, 0.0))
    sent = [guard.pose(goal, START) for _ in range(1500)]
    assert sent[-1][:3] == pytest.approx((0.53, 0.14, 0.4))
    assert any(
        "flange: reach limited" in line and "0.5 m requested, 0.05" in line for line in guard.report.lines
    )


coordinate = st.floats(-1.0, 1.0) | st.sampled_from([NAN, math.inf, 1e300, 0.5])
targets = st.lists(
    st.tuples(st.tuples(*[coordinate] * 7) | st.just(None) | st.just(START), st.integers(1, 120)),
    min_size=1,
    max_size=8,
)


@pytest.mark.slow
@given(targets, st.sampled_from([1e-3, 5e-3]))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_whatever_is_asked_the_limits_are_kept(asked: list[tuple[object, int]], period: float) -> None:
    guard = begun(period=period)
    sent = run(guard, [wanted for wanted, count in asked for _ in range(count)])
    check(guard, sent)
    home = run(guard, [START] * round(30.0 / period / 5))
    check(guard, np.vstack((sent, home)))
    if np.linalg.norm(sent[-1, :3] - np.array(START[:3])) < 1.0:
        assert between(home[-1].tolist(), START) == pytest.approx(REST, abs=1e-9), "and it comes back"


def test_a_limit_that_is_none() -> None:
    with pytest.raises(LimitError, match=r"angular_velocity must be positive, got 0 rad/s"):
        PoseLimits(angular_velocity=0.0)


@given(
    targets=st.lists(st.floats(-3.0, 3.0) | st.just(NAN) | st.none(), min_size=1, max_size=20),
    speed=st.floats(-0.9, 0.9),
)
@settings(max_examples=longer(40, 60), deadline=None)
def test_the_elbow_keeps_its_limits_too(targets: list[float | None], speed: float) -> None:
    guard, begin = PoseGuard(LIMITS), 0.3
    guard.start(START, period=1e-3, e1=begin, e1_speed=speed * LIMITS.elbow_velocity)
    sent = [begin - speed * LIMITS.elbow_velocity * 1e-3, begin]
    for wanted in targets:
        for _ in range(40):
            guard.pose(START)
            sent.append(guard.elbow(wanted))
    speeds = np.diff(sent) / 1e-3
    assert np.abs(speeds).max() <= LIMITS.elbow_velocity * 1.000001
    assert np.abs(np.diff(speeds)).max() / 1e-3 <= LIMITS.elbow_acceleration * 1.000001 + 1e-6


def test_an_elbow_reaches_its_target_and_the_report_names_it() -> None:
    guard = begun()
    guard.start(START, period=1e-3, e1=0.0)
    for _ in range(3000):
        guard.pose(START)
        guard.elbow(0.8)
    assert guard.e1 == 0.8 and guard.is_still
    guard.elbow(NAN)
    assert guard.e1 == 0.8
    assert any("elbow: velocity limited" in line for line in guard.report.lines)
    assert any("elbow: target not finite" in line for line in guard.report.lines)


def test_a_report_keeps_the_worst_and_what_was_allowed_then() -> None:
    report = PoseReport()
    for asked, allowed in ((3.0, 1.0), (4.0, 1.5), (4.0, 1.25), (2.0, 1.0)):
        report.add(PoseLimited.VELOCITY, 0, asked, allowed)
    report.add(PoseLimited.NOT_FINITE, 1, 0.0, 0.0)
    assert report.lines == [
        "rotation: target not finite in 1 cycle; the last one was kept",
        "flange: velocity limited in 4 cycles: 4 m/s requested, 1.25 allowed",
    ]
