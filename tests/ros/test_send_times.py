"""Streams over a machine that delivers messages late: the arm's speed is that of the stream, not of the arrivals."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from heptarm.ros.trajectory.goal import TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.runner import MeasuredJoints, TrajectoryRunner
from heptarm.ros.trajectory.send_times import SendTimes
from heptarm.values.arrays import Array
from heptarm.values.robot import robot

ARM = robot("iiwa14")
NAMES = tuple(f"A{number}" for number in range(1, 8))
A7 = np.eye(7)[6]
#: A swing [rad] and its duration [s], as the nodes' benchmark has it.
SWING, DURATION = 0.3, 4.0
#: Period of the execution, time constant of the servo engine, and step of the simulated arm [s].
TICK, HORIZON, STEP = 0.01, 0.1, 0.002
#: Largest error of the speed, a fraction of its peak, and largest lag [s].
SPEED, LAG = 0.05, 0.04

#: When messages arrive [s], and the time of the swing that each is for [s].
Arrivals = list[tuple[float, float]]
Scene = Callable[[np.random.Generator, float], Arrivals]


def fraction(times: Array | float) -> Array:
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(np.asarray(times) / DURATION, 0.0, 1.0)))


def sent(rate: float) -> Iterator[tuple[float, float]]:
    """When a program sends its points [s], each a period ahead, and what they are for [s]."""
    for number in range(1, round(DURATION * rate) + 1):
        yield (number - 1) / rate, number / rate


def in_order(arrivals: Arrivals) -> Arrivals:
    """A connection keeps the order of messages."""
    times = np.maximum.accumulate([arrived for arrived, _ in arrivals])
    return [(float(time), wanted) for time, (_, wanted) in zip(times, arrivals, strict=True)]


def jitter(rng: np.random.Generator, rate: float) -> Arrivals:
    """Each message arrives up to 4 ms early or late."""
    return in_order([(time + rng.uniform(-4e-3, 4e-3), wanted) for time, wanted in sent(rate)])


def stalls(rng: np.random.Generator, rate: float) -> Arrivals:
    """Three times in a second the receiver stands for 10 to 50 ms; it finds what has come meanwhile at once."""
    found: Arrivals = []
    until = 0.0
    for time, wanted in sent(rate):
        if time > until and rng.random() < 3.0 / rate:
            until = time + rng.uniform(0.01, 0.05)
        found.append((max(time, until), wanted))
    return found


def short_queue(rng: np.random.Generator, rate: float) -> Arrivals:
    """The same, with a queue of one message: the others are lost."""
    return list({time: (time, wanted) for time, wanted in stalls(rng, rate)}.values())


def losses(rng: np.random.Generator, rate: float) -> Arrivals:
    """Every third message is lost, and the others arrive up to 2 ms late."""
    return in_order(
        [(time + rng.uniform(0.0, 2e-3), wanted) for time, wanted in sent(rate) if round(wanted * rate) % 3]
    )


def faster(rng: np.random.Generator, rate: float) -> Arrivals:
    """The sender's clock is 3 % fast: what it calls a period is shorter."""
    return in_order([(time / 1.03 + rng.uniform(0.0, 2e-3), wanted / 1.03) for time, wanted in sent(rate)])


def sampled(rng: np.random.Generator, rate: float) -> Arrivals:
    """A program that samples a moving thing at irregular moments."""
    moments = [(time + rng.uniform(0.0, 4e-3), wanted) for time, wanted in sent(rate)]
    return in_order([(moment + rng.uniform(0.0, 5e-4), moment + 1.0 / rate) for moment, _ in moments])


def followed(arrivals: Arrivals, rate: float) -> tuple[float, float]:
    """Lag [s] and largest error of the speed over 0.2 s of an arm that follows, as a fraction of the peak."""
    runner = TrajectoryRunner(NAMES, ARM)
    arm = target = np.zeros(7)
    waiting, times, places = iter([*arrivals, (np.inf, 0.0)]), [], []
    arrived, wanted = next(waiting)
    for step in range(round((DURATION + 0.5) / STEP)):
        now = step * STEP
        state = MeasuredJoints(10.0 + now, arm, np.zeros(7))
        while arrived <= now:
            point = TrajectoryPoint(1.0 / rate, tuple((SWING * fraction(wanted) * A7).tolist()))
            runner.accept(TrajectoryGoal(NAMES, (point,), from_topic=True), now=10.0 + arrived, state=state)
            arrived, wanted = next(waiting)
        if runner.busy and not step % round(TICK / STEP):
            command = runner.advance(10.0 + now, state).command
            target = command.q + HORIZON * command.dq
        arm = arm + (target - arm) * STEP / HORIZON
        times.append(now + STEP)
        places.append(arm[6] / SWING)
    return compared(np.array(times), np.array(places))


def compared(times: Array, places: Array) -> tuple[float, float]:
    middle = (times > 0.25 * DURATION) & (times < 0.95 * DURATION)
    lags = np.arange(-0.05, 0.2, 0.001)
    lag = float(lags[np.argmin([((places - fraction(times - lag))[middle] ** 2).sum() for lag in lags])])
    at, half = np.arange(0.3 * DURATION, 0.9 * DURATION, 0.02), 0.1
    arm = np.interp(at + half, times, places) - np.interp(at - half, times, places)
    wanted = fraction(at + half - lag) - fraction(at - half - lag)
    return lag, float(np.abs(arm - wanted).max() / (2.0 * half) / (0.5 * np.pi / DURATION))


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0])
@pytest.mark.parametrize("scene", [jitter, stalls, short_queue, losses, faster, sampled])
def test_the_speed_of_a_stream_is_followed(scene: Scene, rate: float) -> None:
    lag, error = followed(scene(np.random.default_rng(7), rate), rate)
    assert abs(lag) <= LAG and error <= SPEED, f"lag {lag * 1e3:.0f} ms, error {error:.1%}"


def test_a_burst_has_the_times_at_which_it_was_sent() -> None:
    """Ten messages that waited 36 ms for the receiver; the clock stays within a tenth of a period."""
    clock, period, speed = SendTimes(), 0.004, 0.1 * A7
    errors = []
    for number in range(200):
        now = number * period
        arrived = 0.436 if 0.4 <= now < 0.436 else now
        errors.append(clock.add(arrived, period, now * speed, speed) - now)
    assert np.abs(errors).max() < 0.1 * period


def test_lost_points_are_no_delay_and_another_rate_is_found() -> None:
    clock, speed = SendTimes(), 0.1 * A7
    times = [0.02 * number for number in range(200) if number not in (50, 51, 100)]
    assert np.abs([clock.add(now, 0.02, now * speed, speed) - now for now in times]).max() < 1e-3
    clock.forget()
    late = [clock.add(now, 0.1, now * speed, speed) - now for now in np.arange(100.0, 104.0, 0.02)]
    assert np.abs(late[100:]).max() < 2e-3, "declared 0.1 s, sent each 20 ms"
