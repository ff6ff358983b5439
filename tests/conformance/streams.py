"""Streams on the trajectory topic, as MoveIt Servo and teleoperation nodes send them."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from heptarm.values.checks import Array
from tests.conformance.case import (
    REST,
    STALL,
    TOUCH,
    arrives,
    case,
    goal,
    long,
    point,
    rests,
    stays,
    step,
    succeeds,
    under_way,
)
from tests.conformance.client import Client, SentGoal

#: The swing of A7 [rad] and its duration [s].
SWING, DURATION = 0.3, 3.0
#: Largest lag [s], and largest error of the speed, a fraction of its peak.
LAG, SPEED = 0.04, 0.05
#: How far ahead the windows of MoveIt Servo reach, its parameter `max_expected_latency` [s].
LATENCY = 0.1
#: Attempts on a machine that others use as well, and how late a message may be that counts as punctual [s].
ATTEMPTS, PUNCTUAL = 4, 0.005

Send = Callable[[int], None]


@dataclass(frozen=True)
class Followed:
    """How the arm followed a swing: its lag [s], errors of the speed over 0.2 s and its least over 0.05 s, fractions of
    the peak, and the overshoot, a fraction of the swing."""

    lag: float
    speed: float
    slowest: float
    overshoot: float

    def is_good(self, *, disturbed: bool) -> bool:
        """Whether the arm has followed; the speed of a stream whose messages come late is not that of the swing."""
        steady = disturbed or (self.speed <= SPEED and self.slowest > 0.6)
        return self.lag <= LAG and self.overshoot < 0.03 and steady


def fraction(times: Array) -> Array:
    """A smooth swing from 0 to 1 within `DURATION`."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(times / DURATION, 0.0, 1.0)))


def swing(client: Client) -> Array:
    """A swing of A7 towards the middle of its range, shape (7,) [rad]."""
    return np.asarray(SWING * (np.arange(7) == 6) * (-1.0 if client.place().q[6] > 0 else 1.0))


def paced(client: Client, rate: float, count: int, send: Send) -> float:
    """Call with 1 to `count` at a rate [Hz]; returns how late the latest call was [s]."""
    begin, late = client.now(), 0.0
    for k in range(1, count + 1):
        send(k)
        client.sleep(max(0.0, begin + k / rate - client.now()))
        late = max(late, client.now() - begin - k / rate)
    return late


def is_busy(client: Client, late: float) -> bool:
    """Whether others use this machine so much that messages come late."""
    load, processors = os.getloadavg()[0], os.cpu_count() or 1
    return not client.timely and (late > PUNCTUAL or load > 0.75 * processors)


def measure(client: Client, begin: float, here: Array, away: Array, delay: float) -> Followed:
    """Compare the arm's path with the swing that began at a time [s].

    Args:
        client: with the joint states.
        begin: of the swing [s].
        here: where it began, shape (7,) [rad].
        away: the swing, shape (7,) [rad].
        delay: how much later the messages want the arm there [s].
    """
    track = client.track(begin)
    times = np.array([time for time, _ in track]) - begin - delay
    progress = np.array([(q - here) @ away / (away @ away) for _, q in track])
    middle = (times > 0.25 * DURATION) & (times < 0.95 * DURATION)
    lags = np.arange(-0.05, 0.5, 0.001)
    errors = [float(((progress - fraction(times - lag))[middle] ** 2).sum()) for lag in lags]
    lag = float(lags[int(np.argmin(errors))])

    def speeds(half: float, low: float, high: float) -> tuple[Array, Array]:
        at = np.arange(low * DURATION, high * DURATION, 0.02)
        arm = np.interp(at + half, times, progress) - np.interp(at - half, times, progress)
        return arm / (2.0 * half), (fraction(at + half - lag) - fraction(at - half - lag)) / (2.0 * half)

    peak = 0.5 * np.pi / DURATION
    arm, wanted = speeds(0.1, 0.3, 0.9)
    fine, expected = speeds(0.025, 0.3, 0.7)
    return Followed(
        lag,
        float(np.abs(arm - wanted).max() / peak),
        float((fine / expected).min()),
        float(progress.max() - 1.0),
    )


def follows(
    client: Client, rate: float, message: Callable[[int, Array, Array], None], delay: float = 0.0
) -> None:
    """Stream a swing: the arm follows it without lag and without stops."""
    found: list[Followed] = []
    counted = 0
    for _ in range(1 if client.timely else 3 * ATTEMPTS):
        here = rests(client)
        away = swing(client)
        begin = client.now()
        late = paced(client, rate, round(DURATION * rate), lambda k: message(k, here, away))  # noqa: B023
        rest = rests(client)
        stood = not client.timely and np.diff([time for time, _ in client.track(begin)]).max() >= STALL
        if stood and np.abs(rest - here - away).max() >= TOUCH:
            continue  # messages that have become too old are left out
        arrives(client, here + away)
        found.append(measure(client, begin, here, away, delay))
        if found[-1].is_good(disturbed=is_busy(client, late)):
            return
        counted += not stood  # an attempt in which the machine stood still does not count
        if counted == ATTEMPTS:
            break
    raise AssertionError(f"the arm does not follow: {found}")


def single(client: Client, rate: float, **more: object) -> Callable[[int, Array, Array], None]:
    """Send one point a message, a period ahead."""

    def message(k: int, here: Array, away: Array) -> None:
        there = here + fraction(np.array(k / rate)) * away
        client.topic(goal(client, point(1.0 / rate, there), **more))

    return message


class Windows:
    """What MoveIt Servo sends: the points of the last and the next 0.1 s, with velocities, and with a time stamp."""

    def __init__(self, client: Client, rate: float, *, bare: bool = False) -> None:
        self._client, self._rate, self._bare = client, rate, bare
        self._window: deque[tuple[float, Array]] = deque()

    def message(self, k: int, here: Array, away: Array) -> None:
        now = self._client.now()
        if k == 1:
            self._window.clear()
        while self._window and self._window[0][0] < now - LATENCY:
            self._window.popleft()
        self._window.append((now + LATENCY, here + fraction(np.array(k / self._rate)) * away))
        if len(self._window) < 3:
            return
        start = self._window[0][0]
        points = []
        held = list(self._window)
        for before, this, after in zip(held[:1] + held, held, held[1:]):
            other = (after[1] - this[1]) / (after[0] - this[0])
            one = (this[1] - before[1]) / (this[0] - before[0]) if this[0] > before[0] else other
            dq = np.where(
                np.sign(one) != np.sign(other), 0.0, np.where(np.abs(one) < np.abs(other), one, other)
            )
            points.append(point(this[0] - start, this[1], dq=() if self._bare else tuple(dq.tolist())))
        self._client.topic(TrajectoryGoal(self._client.joints, tuple(points), start))


@case
def points_streamed_at_50_hz_are_followed(client: Client) -> None:
    follows(client, 50.0, single(client, 50.0))


@case
def points_streamed_at_100_hz_are_followed(client: Client) -> None:
    follows(client, 100.0, single(client, 100.0))


@case
def points_streamed_at_250_hz_are_followed(client: Client) -> None:
    follows(client, 250.0, single(client, 250.0))


@case
def windows_of_moveit_servo_are_followed(client: Client) -> None:
    # the first message has the point of the next period
    follows(client, 50.0, Windows(client, 50.0).message, LATENCY - 1.0 / 50.0)


# ------------------------------------------------------------------------------------ short streams


def streamed(
    client: Client,
    rate: float = 50.0,
    seconds: float = 1.0,
    *,
    lost: int = 0,
    stamped: bool = False,
    order: Sequence[int] = range(7),
) -> tuple[Array, Array]:
    """Stream A7 away at 0.2 rad/s, with velocities; returns where it began and the last point.

    Args:
        client: to send.
        rate: of messages [Hz].
        seconds: how long [s].
        lost: leave out every so many messages; 0: none.
        stamped: with time stamps.
        order: of the joints.
    """
    here = client.place().q
    speed = 0.2 * (np.arange(7) == 6) * (-1.0 if here[6] > 0 else 1.0)
    sent: list[Array] = []

    def send(k: int) -> None:
        if not lost or k % lost:
            sent.append(here + k / rate * speed)
            one = point(1.0 / rate, sent[-1][list(order)], dq=tuple(speed[list(order)].tolist()))
            names = tuple(client.joints[joint] for joint in order)
            client.topic(TrajectoryGoal(names, (one,), client.now() if stamped else None))

    paced(client, rate, round(seconds * rate), send)
    return here, sent[-1]


@case
def a_stream_that_breaks_off_ends_at_its_last_point(client: Client) -> None:
    here, last = streamed(client)
    arrives(client, last)
    rest = rests(client)
    stays(client, rest)
    assert np.abs(np.delete(rest - here, 6)).max() < TOUCH


@case
def a_stream_may_lose_messages(client: Client) -> None:
    _, last = streamed(client, lost=3)
    arrives(client, last)


@case
def a_stream_goes_on_after_a_pause(client: Client) -> None:
    _, last = streamed(client, seconds=0.5)
    client.sleep(0.6)
    arrives(client, last)
    _, last = streamed(client, seconds=0.5)
    arrives(client, last)


@case
def a_slow_stream_is_followed_to_its_end(client: Client) -> None:
    _, last = streamed(client, rate=10.0)
    arrives(client, last)


@case
def points_with_time_stamps_are_followed(client: Client) -> None:
    _, last = streamed(client, seconds=0.6, stamped=True)
    arrives(client, last)


@case
def streamed_joints_may_have_any_order(client: Client) -> None:
    here, last = streamed(client, seconds=0.6, order=(6, 2, 0, 1, 5, 3, 4))
    arrives(client, last)
    assert np.abs(np.delete(client.place().q - here, 6)).max() < TOUCH


@case
def windows_without_velocities_that_break_off_end_at_their_last_point(client: Client) -> None:
    here = rests(client)
    away = swing(client)
    windows = Windows(client, 50.0, bare=True)
    count = round(0.4 * DURATION * 50.0)
    paced(client, 50.0, count, lambda k: windows.message(k, here, away))
    arrives(client, here + fraction(np.array((count - 1) / 50.0)) * away)


@case
def a_stream_turns_back(client: Client) -> None:
    here, rate, count = rests(client), 50.0, 75
    away = swing(client) / 2.0

    def send(k: int) -> None:
        client.topic(goal(client, point(1.0 / rate, here + away * np.sin(np.pi * k / count) ** 2)))

    begin = client.now()
    paced(client, rate, count, send)
    arrives(client, here)
    far = max(float((q - here) @ away / (away @ away)) for _, q in client.track(begin))
    # messages that come late are continued by the velocity of the stream
    assert far < (1.15 if client.timely else 1.6), f"it overshoots: {far:.2f}"
    assert far > 0.5, f"it has not turned: {far:.2f}"


@case
def a_stream_takes_the_place_of_a_goal(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    _, last = streamed(client, seconds=0.5)
    ended = client.result(sent)
    assert ended.outcome in client.preempted and ended.code is ErrorCode.INVALID_GOAL, ended
    arrives(client, last)


@case
def a_goal_takes_the_place_of_a_stream(client: Client) -> None:
    streamed(client, seconds=0.4)
    succeeds(client, step(client, time=0.6))


@case
def what_is_wrong_in_a_stream_is_left_out(client: Client) -> None:
    here = rests(client)
    beyond = here + 1.0 * (np.arange(7) == 4) * (-1.0 if here[4] > 0 else 1.0)
    for q in (np.full(7, np.nan), beyond, here[:6]):
        for _ in range(3):
            client.topic(goal(client, point(0.02, q)))
            client.sleep(0.02)
    stays(client, here)
    client.topic(
        TrajectoryGoal(("elbow", *client.joints[1:]), (TrajectoryPoint(0.02, tuple(here.tolist())),))
    )
    stays(client, here)
    _, last = streamed(client, seconds=0.4)
    arrives(client, last)


@case
def a_stream_of_some_joints_where_it_is_allowed(client: Client) -> None:
    assert client.set(allow_partial_joints_goal=True)
    here, rate = rests(client), 50.0
    sign = -1.0 if here[6] > 0 else 1.0

    def send(k: int) -> None:
        there = float(here[6] + sign * 0.1 * min(1.0, k / 40))
        client.topic(TrajectoryGoal((client.joints[6],), (TrajectoryPoint(1.0 / rate, (there,)),)))

    paced(client, rate, 45, send)
    arrives(client, here + sign * 0.1 * (np.arange(7) == 6))


@case
def deactivating_ends_a_stream(client: Client) -> None:
    streamed(client, seconds=0.4)
    client.activate(on=False)
    try:
        rest = rests(client)
        client.topic(goal(client, point(0.02, rest + 0.05 * (np.arange(7) == 6))))
        stays(client, rest)
    finally:
        client.activate(on=True)
    succeeds(client, step(client))


@case
def a_short_trajectory_of_the_topic_ends_where_it_should(client: Client) -> None:
    """It is as short as the window of a stream, but the only message."""
    here = rests(client)
    away = 0.05 * (np.arange(7) == 6) * (-1.0 if here[6] > 0 else 1.0)
    client.topic(goal(client, point(0.2, here + away / 2), point(0.4, here + away, dq=REST)))
    arrives(client, here + away)
    rest = rests(client)
    stays(client, rest)


@case
def an_old_window_is_left_out(client: Client) -> None:
    here = rests(client)
    away = 0.05 * (np.arange(7) == 6)
    now = client.now()
    points = (point(0.0, here), point(0.05, here + away / 2), point(0.1, here + away))
    client.topic(goal(client, *points, start=now - 0.4))
    stays(client, here)


def cancelled(client: Client, sent: SentGoal) -> None:
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.CANCELED and ended.code is ErrorCode.SUCCESSFUL, ended


@case
def an_empty_trajectory_on_the_topic_does_as_upstreams_controller(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    client.topic(TrajectoryGoal((), ()))
    if client.empty_stops:
        cancelled(client, sent)
        rest = rests(client)
        stays(client, rest)
    else:
        assert client.result(sent).outcome is GoalOutcome.SUCCEEDED, "it is refused, and the goal goes on"
