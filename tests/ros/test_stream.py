"""Streams: what belongs to one, and points that cannot be followed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heptarm.planning.seam import ServoTiming
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.trajectory.goal import GoalRefused, TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.point_stream import PointStream, is_streamed
from heptarm.ros.trajectory.runner import MeasuredJoints, TrajectoryRunner
from heptarm.ros.trajectory.send_times import PublishInfo, SendTimes
from heptarm.ros.trajectory.trajectory import KinematicState
from heptarm.sim.controller.servo import DirectFollower, ServoLimits, SmartFollower
from heptarm.values.robot import robot
from tests.long import few

ARM = robot("iiwa14")
HERE = KinematicState.at_rest(np.zeros(7))
ACCELERATION = np.full(7, 2.0)
POINT = TrajectoryGoal(("A1",), (TrajectoryPoint(0.02, (0.0,)),), from_topic=True)
WINDOW = replace(POINT, points=tuple(TrajectoryPoint(0.02 * k, (0.0,)) for k in range(10)), start=99.9)


@pytest.mark.parametrize(
    ("goal", "streamed"),
    [
        (POINT, True),
        (WINDOW, True),
        (replace(POINT, from_topic=False), False),
        (replace(WINDOW, from_topic=False), False),
        (replace(POINT, points=(TrajectoryPoint(0.5, (0.0,)),)), False),
        (replace(POINT, points=(TrajectoryPoint(0.0, (0.0,)),)), False),
        (replace(POINT, start=90.0), False),
        (replace(POINT, start=99.9), True),
        (replace(WINDOW, start=110.0), False),
        (replace(WINDOW, points=(*WINDOW.points, TrajectoryPoint(0.8, (0.0,)))), False),
        (replace(POINT, points=()), False),
    ],
)
def test_what_belongs_to_a_stream(goal: TrajectoryGoal, streamed: bool) -> None:
    assert is_streamed(goal, 100.0) is streamed


def test_a_steady_stream_is_followed_where_it_is() -> None:
    """Not where it was a period or a horizon ago."""
    stream, speed, period = PointStream(ARM), 0.3 * np.eye(7)[6], 0.02
    here, path = HERE, None
    for k in range(50):
        now = 10.0 + k * period
        path = stream.add_point(now, now, here, period, (k + 1) * period * speed, None, ACCELERATION)
        here = path.sample(period)
    np.testing.assert_allclose(here.q, 50 * period * speed, atol=1e-4)
    np.testing.assert_allclose(here.dq, speed, atol=1e-3)
    assert path is not None and not path.end.dq.any()
    np.testing.assert_allclose(path.end.q, 50 * period * speed, atol=1e-9)


def test_jitter_of_arrivals_hardly_shows() -> None:
    rng = np.random.default_rng(5)
    stream, speed, period = PointStream(ARM), 0.3 * np.eye(7)[6], 0.01
    here, speeds = HERE, []
    times = 10.0 + period * np.arange(200) + rng.uniform(0.0, 0.004, 200)
    for k, now in enumerate(times):
        path = stream.add_point(now, now, here, period, (k + 1) * period * speed, None, ACCELERATION)
        here = path.sample(float(times[k + 1] - now) if k + 1 < len(times) else period)
        speeds.append(here.dq[6])
    assert np.abs(np.array(speeds[50:]) / 0.3 - 1.0).max() < 0.15
    smooth = np.convolve(speeds, np.ones(20) / 20.0, "valid")
    assert np.abs(smooth[50:] / 0.3 - 1.0).max() < 0.03


def arrivals(rng: np.random.Generator, period: float, count: int, *, actual: float = 1.0) -> np.ndarray:
    """Times at which messages arrive over a busy machine: late by milliseconds, and held up for up to 50 ms."""
    sent = 10.0 + actual * period * np.arange(count)
    came = sent + rng.exponential(0.001, count)
    for begin in rng.uniform(sent[0], sent[-1], 12):
        end = begin + rng.uniform(0.01, 0.05)
        held = (sent > begin) & (sent < end)
        came[held] = np.maximum(came[held], end)
    return np.maximum.accumulate(came)


@pytest.mark.parametrize("counts", ["numbers", "times"])
@pytest.mark.parametrize("rate", [50, 100, 250])
def test_late_and_lost_points_hardly_show_where_the_sender_counts(rate: int, counts: str) -> None:
    """Of points that are held up together only the newest is seen."""
    rng, period = np.random.default_rng(7), 1.0 / rate
    stream, speed = PointStream(ARM), 0.3 * np.eye(7)[6]
    came = arrivals(rng, period, 4 * rate)
    seen = np.flatnonzero(np.diff(came, append=np.inf) > 1e-4)
    assert len(seen) < len(came)
    here, path, begin, speeds = HERE, None, 0.0, []
    for k in seen:
        if path is not None:
            for t in np.arange(begin, came[k], 0.005):
                speeds.append(path.sample(t - begin).dq[6])
            here = path.sample(float(came[k] - begin))
        published = 123.0 + k * period + rng.uniform(0.0, 0.2 * period)
        sent = PublishInfo(number=int(k)) if counts == "numbers" else PublishInfo(time=published)
        begin = float(came[k])
        path = stream.add_point(
            begin, begin, here, period, (k + 1) * period * speed, None, ACCELERATION, sent
        )
    ratios = np.array(speeds[240:]) / 0.3  # it has caught up with a stream that began with its full speed
    assert np.abs(ratios - 1.0).max() < 0.05
    assert np.abs(np.convolve(ratios, np.ones(40) / 40.0, "valid") - 1.0).max() < 0.02


SWING = 0.3, 3.0  # amplitude [rad] and time [s]


def swing(time: np.ndarray) -> np.ndarray:
    """Joint positions of a stream, and those that the arm should have: a cosine from rest to rest [rad]."""
    amplitude, seconds = SWING
    return np.asarray(amplitude * (0.5 - 0.5 * np.cos(np.pi * np.clip(time / seconds, 0.0, 1.0))))


def held_up(rng: np.random.Generator, came: np.ndarray) -> np.ndarray:
    """Times at which a receiver that is held up for 30 ms at a time sees the messages that came."""
    for begin in rng.uniform(10.0, 13.0, 12):
        held = (came > begin) & (came < begin + 0.03)
        came[held] = begin + 0.03
    return came


def error_of_the_speed(path: list[float]) -> float:
    """Largest deviation of the speed over 0.05 s from that of a swing with the lag of the path, of its peak."""
    amplitude, seconds = SWING
    moved = np.array(path[50:]) - np.array(path[:-50])
    times = 1e-3 * np.arange(len(path))
    middle = slice(900, 2700)
    wanted = [swing(times - lag) for lag in np.arange(-0.05, 0.15, 0.001)]
    best = min(wanted, key=lambda track: float(((track - np.array(path))[middle] ** 2).sum()))
    error = (moved - (best[50:] - best[:-50]))[middle]
    return float(np.abs(error).max() / 0.05 / (0.5 * np.pi * amplitude / seconds))


@pytest.mark.parametrize(
    ("rate", "declared"), few([(50, 0.01), (50, 0.02), (100, 0.1), (250, 0.004), (250, 0.02)])
)
def test_the_arm_follows_single_points_on_a_busy_machine(rate: int, declared: float) -> None:
    """Sender, network and node are late, and the declared period may be wrong: on a simulated clock.

    The speed over 0.05 s deviates by 15 % of its peak at most.
    """
    rng = np.random.default_rng(8)
    came = held_up(rng, arrivals(rng, 1.0 / rate, round(SWING[1] * rate)))
    seen = [int(k) for k in np.flatnonzero(np.diff(came, append=np.inf) > 1e-4)]
    ticks = np.unique(arrivals(rng, 0.01, 350))
    options, configuration = NodeConfiguration.of({}).servo, NodeConfiguration.of({})
    runner = TrajectoryRunner(configuration.joints, ARM, configuration.settings)
    cabinet = DirectFollower(servo_limits(options.horizon), np.zeros(7))
    path: list[float] = []
    for when, k in sorted([(float(came[k]), k) for k in seen] + [(float(tick), -1) for tick in ticks]):
        while 10.0 + 1e-3 * len(path) < when:
            path.append(float(cabinet.advance(1e-3)[6]))
        state = MeasuredJoints(when, cabinet.advance(0.0), np.full(7, np.nan))
        if k < 0:
            command = runner.advance(when, state).command
            cabinet.aim(command.q + options.horizon * command.dq)
        else:
            point = TrajectoryPoint(declared, (0.0,) * 6 + (float(swing(np.array((k + 1) / rate))),))
            goal = TrajectoryGoal(configuration.joints, (point,), from_topic=True, sent=PublishInfo(number=k))
            runner.accept(goal, now=when, state=state)
    assert error_of_the_speed(path) < 0.15


@pytest.mark.parametrize(("rate", "busy"), few([(100, True), (50, True), (250, True), (50, False)]))
def test_the_arm_follows_servo_targets_without_velocities_on_a_busy_machine(rate: int, busy: bool) -> None:
    """They come late by milliseconds, and held up for 10 to 50 ms: on a simulated clock, as the test above."""
    rng, count = np.random.default_rng(8), round(SWING[1] * rate)
    came = arrivals(rng, 1.0 / rate, count) if busy else 10.0 + np.arange(count) / rate
    shortest = NodeConfiguration.of({}).values["servo.min_trajectory_time"]
    cabinet = SmartFollower(servo_limits(shortest), np.zeros(7))
    path: list[float] = []
    for k in np.flatnonzero(np.diff(came, append=np.inf) > 1e-4):
        while 10.0 + 1e-3 * len(path) < came[k]:
            path.append(float(cabinet.advance(1e-3)[6]))
        cabinet.aim(swing(np.array((k + 1) / rate)) * np.eye(7)[6])
    assert error_of_the_speed(path) < (0.15 if busy else 0.05)


def servo_limits(shortest: float) -> ServoLimits:
    """Those of a servo motion of a node, with a shortest trajectory to a target [s]."""
    options = NodeConfiguration.of({}).servo
    speed, acceleration = (options.speed,) * 7, (options.acceleration,) * 7
    timing = ServoTiming(min_trajectory_time=shortest)
    return ServoLimits.of(ARM, velocity=speed, acceleration=acceleration, timing=timing)


def test_a_pause_between_two_streams_is_no_jitter_of_the_second() -> None:
    """It follows a swing from the rest in which the first one ended, as one that began after a long pause."""
    period = 0.01

    def followed(pause: float) -> np.ndarray:
        stream, here, path, begin, found = PointStream(ARM), HERE, None, 0.0, []
        last = 1.19 + pause
        for k in range(200):
            now = 1.0 + k * period if k < 20 else last + (k - 20) * period
            if path is not None:
                here = path.sample(min(now - begin, path.duration))
                found.append(here.q[6])
            place = 0.05 * (1.0 - np.cos(np.pi * period * max(0, k - 19))) * np.eye(7)[6]
            begin = now
            path = stream.add_point(now, now, here, period, place, None, ACCELERATION, PublishInfo(number=k))
        return np.array(found[60:])  # it has caught up

    np.testing.assert_allclose(followed(0.1), followed(2.0), atol=2e-4)
    np.testing.assert_allclose(followed(0.25), followed(2.0), atol=2e-4)


@pytest.mark.parametrize("actual", [0.8, 0.98, 1.0, 1.02, 1.25])
def test_the_period_is_measured_where_the_declared_one_is_wrong(actual: float) -> None:
    period, times = 0.01, SendTimes()
    came = arrivals(np.random.default_rng(3), period, 400, actual=actual)
    late = [
        times.add(float(now), period, PublishInfo(number=k))[0] - (10.0 + actual * period * k)
        for k, now in enumerate(came)
    ]
    assert np.abs(late[100:]).max() < 0.012
    assert np.abs(np.diff(late[100:])).max() < 0.002


def test_a_count_that_begins_again_begins_at_the_arrival() -> None:
    times = SendTimes()
    assert times.add(10.0, 0.02, PublishInfo(number=5)) == (10.0, 0.0)
    assert times.add(10.04, 0.02, PublishInfo(number=6))[0] == pytest.approx(10.02, abs=0.011)
    assert times.add(10.06, 0.02, PublishInfo(number=3)) == (10.06, 0.0)
    assert times.add(10.5, 0.02, PublishInfo(number=4)) == pytest.approx((10.5, 0.42)), "the sender paused"
    assert times.add(10.53, 0.02, None) == (10.53, 0.0)
    assert times.add(10.55, 0.02, PublishInfo(time=3.0)) == (10.55, 0.0)
    assert times.add(10.57, 0.02, PublishInfo(time=3.0)) == (10.57, 0.0), (
        "a clock that stands still counts nothing"
    )


def test_a_joint_at_its_limit_stays_inside() -> None:
    stream, period = PointStream(ARM), 0.02
    here = KinematicState.at_rest(0.95 * ARM.q_max * np.eye(7)[6])
    for k in range(100):
        now = 10.0 + k * period
        q = np.minimum(here.q + 0.002, ARM.q_max) * np.eye(7)[6]
        path = stream.add_point(now, now, here, period, q, None, ACCELERATION)
        assert path.positions(np.linspace(0.0, path.duration, 50)).max() <= ARM.q_max[6] + 1e-3
        here = path.sample(period)


def test_points_too_far_away_and_windows_of_the_past_are_refused() -> None:
    stream = PointStream(ARM)
    with pytest.raises(GoalRefused, match="within 0.5 rad"):
        stream.add_point(1.0, 1.0, HERE, 0.02, 0.6 * np.eye(7)[2], None, ACCELERATION)
    times = np.array([-0.3, -0.2, -0.1])
    with pytest.raises(GoalRefused, match="in the future"):
        stream.add_window(HERE, times, np.zeros((3, 7)), None, ACCELERATION)
    with pytest.raises(GoalRefused, match="within 0.5 rad"):
        stream.add_window(HERE, np.array([0.1, 0.2]), np.ones((2, 7)), None, ACCELERATION)


def test_a_window_is_passed_at_its_times() -> None:
    stream, speed = PointStream(ARM), 0.1 * np.eye(7)[3]
    times = np.arange(-0.1, 0.11, 0.02)
    here = KinematicState(-0.0 * speed, speed, np.zeros(7))
    path = stream.add_window(here, times, times[:, None] * speed, None, ACCELERATION)
    for t in (0.06, 0.08, 0.1):
        np.testing.assert_allclose(path.sample(t).q, t * speed, atol=1e-9)
        np.testing.assert_allclose(path.sample(t).dq, speed, atol=1e-9)
    assert not path.end.dq.any()
    np.testing.assert_allclose(path.end.q, 0.1 * speed, atol=1e-12)
