"""The guard: sent commands never exceed the limits; valid commands pass unchanged; limited ones are reported."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.errors import LimitError
from heptarm.fri.guard.joint_guard import JointReport, Limited, Limits
from heptarm.values.robot import robot
from tests.long import longer
from tests.oracles.fri.joint_guard import JointGuard, brake, overrun

LIMITS = Limits.of(robot("iiwa14"))
START = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
STILL = (0.0,) * 7


def begun(*, q: tuple[float, ...] = START, dq: tuple[float, ...] = STILL, period: float = 1e-3) -> JointGuard:
    guard = JointGuard(LIMITS)
    guard.start(q, dq, period=period)
    return guard


def run(guard: JointGuard, targets: Iterable[object]) -> np.ndarray:
    """Sent commands, shape (n, 7)."""
    return np.array([list(guard.position(wanted)) for wanted in targets])  # type: ignore[arg-type]


def check(
    guard: JointGuard, sent: np.ndarray, q: tuple[float, ...] = START, dq: tuple[float, ...] = STILL
) -> None:
    """Assert that the finite differences of the sent commands keep every limit."""
    period, limits = guard.period, guard.limits
    before = np.array([np.subtract(q, np.multiply(n * period, dq)) for n in (3, 2, 1, 0)])
    track = np.vstack((before, sent))
    noise = 1e-14  # rounding of a position
    for order, most in ((1, limits.dq_max), (2, limits.ddq_max), (3, limits.dddq_max)):
        slope = np.abs(np.diff(track, order, axis=0)).max(axis=0) / period**order
        assert (slope <= np.multiply(most, 1 + 1e-6) + noise / period**order).all(), (order, slope)
    assert (sent >= np.minimum(guard.low, limits.q_min) - 1e-9).all()
    assert (sent <= np.maximum(guard.high, limits.q_max) + 1e-9).all()


wild = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-3.5, 3.5)


@st.composite
def requests(draw: st.DrawFn) -> list[tuple[float, ...] | None]:
    """Jumps, ramps, sines, noise, NaN and pauses, one after the other."""
    targets: list[tuple[float, ...] | None] = []
    for _ in range(draw(st.integers(1, 5))):
        kind, size = (
            draw(st.sampled_from(["jump", "ramp", "sine", "noise", "brake"])),
            draw(st.integers(1, 300)),
        )
        level, pace = draw(st.tuples(*[wild] * 7)), draw(st.floats(-20.0, 20.0))
        random = np.random.default_rng(draw(st.integers(0, 1000)))
        for index in range(size):
            if kind == "brake":
                targets.append(None)
                continue
            with np.errstate(invalid="ignore", over="ignore"):
                offset = {
                    "jump": 0.0,
                    "ramp": pace * index * 1e-3,
                    "sine": 0.3 * math.sin(pace * index * 1e-3),
                    "noise": random.uniform(-3, 3),
                }[kind]
                targets.append(tuple(value + offset for value in level))
    return targets


@pytest.mark.slow
@settings(max_examples=longer(40, 60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(targets=requests(), period=st.sampled_from([1e-3, 2e-3, 5e-3, 1e-2, 0.1]), data=st.data())
def test_whatever_is_asked_the_limits_hold(
    targets: list[tuple[float, ...] | None], period: float, data: st.DataObject
) -> None:
    q = tuple(data.draw(st.floats(low, high)) for low, high in zip(LIMITS.q_min, LIMITS.q_max, strict=True))
    dq = tuple(data.draw(st.floats(-0.9, 0.9)) * most for most in LIMITS.dq_max)
    guard = begun(q=q, dq=dq, period=period)
    sent = run(guard, targets)
    check(guard, sent, q, dq)
    stopped = run(guard, [None] * (1 + int(4.0 / period)))
    check(guard, np.vstack((sent, stopped)), q, dq)
    assert np.abs(guard.v).max() < 1e-12, "and it can always be brought to a stop"


@settings(max_examples=150, deadline=None)
@given(
    v=st.floats(-1, 1),
    a=st.floats(-1, 1),
    top=st.floats(1.0, 15.0),
    jerk=st.floats(10.0, 10_000.0),
    period=st.sampled_from([1e-3, 5e-3, 2e-2]),
)
def test_braking_never_goes_further_than_foretold(
    v: float, a: float, top: float, jerk: float, period: float
) -> None:
    top, jerk = top * period**2, jerk * period**3
    speed, acceleration, travel, furthest = 2.0 * v * period, a * top, 0.0, 0.0
    foretold = overrun(speed, acceleration, top, jerk)
    for _ in range(100_000):
        if abs(speed) < 1e-15 and abs(acceleration) < 1e-15:
            break
        acceleration = brake(speed, acceleration, top, jerk)
        speed += acceleration
        travel += speed
        furthest = max(furthest, travel)
    else:
        pytest.fail("braking does not end")
    assert furthest <= foretold + 1e-9 * (1 + foretold)


def test_a_motion_within_the_limits_passes_unchanged() -> None:
    """A sine that starts smoothly passes unchanged and unreported."""
    times = np.arange(1, 4001) * 1e-3
    rise = np.minimum(times, 1.0)
    envelope = rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2)
    targets = np.array(START) + (0.1 * envelope * np.sin(2.0 * times))[:, None]
    guard = begun()
    assert (run(guard, targets.tolist()) == targets).all()
    assert not guard.report.lines and not guard.was_limited


def test_a_step_is_walked_up_without_overshoot_and_ends_exactly() -> None:
    guard, goal = begun(), tuple(value + 0.5 for value in START)
    sent = run(guard, [goal] * 1500)
    check(guard, sent)
    assert (sent <= np.array(goal) + 1e-12).all() and tuple(sent[-1]) == goal and guard.is_still
    assert np.abs(sent[900] - goal).max() < 1e-6, "and it takes little more than the fastest path"
    assert any(
        "A1: velocity limited" in line and "500 rad/s requested" in line for line in guard.report.lines
    )


def test_no_number_keeps_the_last_target_and_is_named() -> None:
    guard = begun()
    broken = (math.nan, *START[1:])
    sent = run(guard, [broken] * 10)
    assert (sent == np.array(START)).all()
    assert guard.report.counts[Limited.NOT_FINITE][0] == 10
    assert guard.report.lines == ["A1: target not finite in 10 cycles; the last one was kept"]


def test_ten_times_the_velocity_is_followed_as_fast_as_it_may() -> None:
    guard = begun()
    most = LIMITS.dq_max[6]
    sent = run(guard, [(*START[:6], 10 * most * 1e-3 * (k + 1)) for k in range(500)])
    check(guard, sent)
    assert np.diff(sent[:, 6]).max() / 1e-3 == pytest.approx(most)
    assert guard.report.counts[Limited.VELOCITY][6] and guard.report.lines[0].startswith("A7: ")
    assert (sent[:, :6] == np.array(START[:6])).all(), "the other axes are left alone"


def test_a_goal_beyond_the_range_ends_at_its_edge() -> None:
    guard = begun()
    sent = run(guard, [(9.0, *START[1:])] * 4000)
    check(guard, sent)
    assert sent[-1, 0] == pytest.approx(LIMITS.q_max[0], abs=1e-6)
    assert guard.report.lines[0] == "A1: position limited in 4000 cycles: 9 rad requested, 2.95 allowed"


def test_a_start_outside_the_range_goes_only_inwards() -> None:
    q = (LIMITS.q_max[0] + 0.01, *START[1:])
    guard = begun(q=q)
    assert (run(guard, [(3.2, *START[1:])] * 500)[:, 0] <= q[0]).all()
    sent = run(guard, [START] * 4000)
    assert tuple(sent[-1]) == START


def test_a_start_in_motion_has_no_jump() -> None:
    dq = (0.5, 0.0, -0.5, 0.0, 0.3, 0.0, 1.0)
    guard = begun(dq=dq)
    sent = run(guard, [START] * 3000)
    check(guard, sent, dq=dq)
    assert (
        sent[0] == pytest.approx(np.add(START, np.multiply(1e-3, dq)), abs=2e-6) and tuple(sent[-1]) == START
    )


def test_the_reach_around_the_interpolator_bounds_the_target() -> None:
    guard = JointGuard(Limits.of(robot("iiwa14"), reach=0.05))
    guard.start(START, STILL, period=1e-3)
    for _ in range(2000):
        sent = guard.position([value + 1.0 for value in START], ipo=START)
    assert sent == pytest.approx([value + 0.05 for value in START])
    assert guard.report.counts[Limited.POSITION][0] == 2000


@given(targets=st.lists(st.tuples(*[wild] * 7), min_size=1, max_size=50))
def test_torques_keep_magnitude_and_rate_and_start_from_zero(targets: list[tuple[float, ...]]) -> None:
    guard = begun()
    sent = np.array([STILL, *(list(guard.torque(one)) for one in targets)])
    assert (np.abs(sent) <= LIMITS.tau_max).all() and np.isfinite(sent).all()
    assert (np.abs(np.diff(sent, axis=0)) <= np.multiply(LIMITS.dtau_max, 1e-3) * (1 + 1e-9)).all()
    force = np.array([list(guard.force(one[:6])) for one in targets])
    assert (np.abs(force) <= LIMITS.wrench_max).all()


def test_torque_reports_magnitude() -> None:
    guard = begun()
    guard.torque((1e6, *STILL[1:]))
    assert guard.report.lines == ["A1: torque limited in 1 cycle: 1e+06 Nm requested, 304 allowed"]
    guard.start(START, STILL, period=1e-3)
    assert guard.tau == [0.0] * 7, "a new start begins without torque"


def test_limits_without_room_are_refused() -> None:
    with pytest.raises(LimitError, match="empty"):
        Limits.of(robot("iiwa7"), margin=4.0)
    with pytest.raises(LimitError, match=r"fraction must be in \(0, 1\], got 0"):
        Limits.of(robot("iiwa7"), fraction=0.0)


def test_limits_of_a_robot_lie_slightly_inside_its_own() -> None:
    arm, limits = robot("iiwa14"), Limits.of(robot("iiwa14"))
    for name in ("dq_max", "ddq_max", "dddq_max", "tau_max"):
        assert getattr(limits, name) == pytest.approx(0.95 * getattr(arm, name)), name
        assert getattr(Limits.of(arm, fraction=0.5), name) == pytest.approx(0.5 * getattr(arm, name)), name
    assert limits.q_min == pytest.approx(arm.q_min + math.radians(1.0))
    assert limits.q_max == pytest.approx(arm.q_max - math.radians(1.0))
    assert limits.dtau_max == pytest.approx(20.0 * 0.95 * arm.tau_max)
    assert limits.wrench_max == (150.0,) * 3 + (50.0,) * 3
    assert limits.dwrench_max == (3000.0,) * 3 + (1000.0,) * 3
    assert limits.reach == math.inf and Limits.of(arm, fraction=1.0).tau_max == tuple(arm.tau_max)


def test_a_report_counts_each_quantity_and_keeps_the_worst_with_what_was_allowed_then() -> None:
    assert [(one.name, one.value) for one in Limited] == [
        *(("NOT_FINITE", 0), ("POSITION", 1), ("VELOCITY", 2), ("ACCELERATION", 3)),
        *(("JERK", 4), ("TORQUE", 5), ("WRENCH", 6)),
    ], "as in C"
    report = JointReport()
    for asked, allowed in ((3.0, 1.0), (-4.0, -1.5), (4.0, 1.25), (2.0, 1.0)):
        report.add(Limited.VELOCITY, 3, asked, allowed)
    report.add(Limited.WRENCH, 2, 200.0, 150.0)
    assert report.lines == [
        "A4: velocity limited in 4 cycles: 4 rad/s requested, 1.25 allowed",
        "wrench[2]: wrench limited in 1 cycle: 200 N or Nm requested, 150 allowed",
    ]
