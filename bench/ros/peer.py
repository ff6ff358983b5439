"""Measurements of the peers of ROS 1 and ROS 2, without ROS: accuracy of a trajectory, regularity of joint states."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt

from bench.measure.blocks import BLOCKS, pin, placed, placements
from bench.measure.noise import Noise
from heptarm.ros.trajectory.goal import GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import arrives, rests
from tests.conformance.client import Client
from tests.conformance.streams import DURATION, measure, paced, single, swing

Floats = npt.NDArray[np.float64]

#: A trajectory of so many seconds and points.
SECONDS, POINTS = 10.0, 100
#: Required accuracy at a point by execution [rad]; longest time until its motion starts [s].
NEAR, OPENING = {"servo": 2e-3, "fri": 5e-4}, 4.0
#: States per second while a trajectory or a stream is followed.
RATE = 200.0
#: States per second whose latency is measured, and for how long each.
RATES, WATCHED = (200.0, 500.0), 40.0
#: How much faster the bare topic is [Hz]. Where both streams meet, each waits for the other: their phase passes through
#: all values every second, instead of a random one that lasts for the whole run.
DRIFT = 1.0
#: Amplitude of every joint [rad], and how many periods a trajectory has.
SWING = np.array([0.5, 0.3, 0.5, 0.4, 0.6, 0.4, 0.8])
TURNS = np.array([1.0, 2.0, 1.5, 1.0, 2.0, 1.5, 2.5])


class Watch:
    """Records all messages of a topic of joint states or robot states.

    Args:
        stamp: time stamp of a message [s].
    """

    def __init__(self, stamp: Callable[[Any], float]) -> None:
        self._stamp = stamp
        self._taken: list[tuple[float, Any]] = []

    def take(self, message: Any) -> None:
        """Record a message; any thread."""
        self._taken.append((time.time(), message))

    def restart(self) -> None:
        """Clear the records."""
        self._taken = []

    def __len__(self) -> int:
        return len(self._taken)

    @property
    def times(self) -> tuple[Floats, Floats]:
        """Times of receipt and stamps of the messages [s]."""
        taken = list(self._taken)
        return np.array([came for came, _ in taken]), np.array([self._stamp(one) for _, one in taken])

    @property
    def track(self) -> tuple[Floats, Floats, Floats]:
        """Of robot states: stamps, controller's clock [s], and positions [rad], shapes (n,), (n,) and (n, 7)."""
        taken = [one for _, one in self._taken]
        clock = 1e-9 * np.array([one.cabinet_stamp for one in taken])
        return np.array([self._stamp(one) for one in taken]), clock, np.array([one.position for one in taken])


def wave(fraction: Floats) -> tuple[Floats, Floats, Floats]:
    """Offset, velocity and acceleration at fractions of the duration, shape (n, 7): at rest at both ends."""
    s = fraction[:, None]
    # the window begins and ends with zero velocity and acceleration
    w = 64 * (s * (1 - s)) ** 3
    dw = 192 * (s * (1 - s)) ** 2 * (1 - 2 * s)
    ddw = 384 * s * (1 - s) * (1 - 2 * s) ** 2 - 384 * (s * (1 - s)) ** 2
    k = 2 * np.pi * TURNS
    p, dp, ddp = SWING * np.sin(k * s), SWING * k * np.cos(k * s), -SWING * k * k * np.sin(k * s)
    q = w * p
    dq = (dw * p + w * dp) / SECONDS
    ddq = (ddw * p + 2 * dw * dp + w * ddp) / SECONDS**2
    return q, dq, ddq


def follow(client: Client, watch: Watch, execution: str) -> dict[str, Any]:
    """Send the trajectory, wait for its end, and measure its accuracy.

    The moments at which the arm passes the points are of the controller's clock, compared with that of ROS until the
    start: a virtual cabinet that its machine holds up loses time, and passes all later points as much later by ROS.

    Args:
        client: of the action.
        watch: on the node's robot states.
        execution: of the node.
    """
    fraction = np.arange(1, POINTS + 1) / POINTS
    q, dq, ddq = wave(fraction)
    here = client.place().q
    start = client.now() + OPENING
    points = tuple(
        TrajectoryPoint(float(s * SECONDS), tuple((here + a).tolist()), tuple(b.tolist()), tuple(c.tolist()))
        for s, a, b, c in zip(fraction, q, dq, ddq)
    )
    sent = client.send(TrajectoryGoal(client.joints, points, start))
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    time.sleep(0.1)  # the last states are in transit
    stamps, clock, places = watch.track
    by_ros = stamps - start
    apart = clock - stamps
    times = by_ros + apart - np.median(apart[by_ros < 0.0])
    fine = np.arange(-0.02, 0.02005, 0.0001)
    distances, moments = [], []
    for point in points:
        at = np.stack([np.interp(point.time + fine, times, places[:, j]) for j in range(7)], axis=1)
        off = np.abs(at - np.array(point.q)).max(axis=1)
        near = off <= NEAR[execution]
        moments.append(float(np.abs(fine[near]).min()) if near.any() else float("inf"))
        distances.append(float(off.min()))
    plain = np.stack([np.interp([p.time for p in points], by_ros, places[:, j]) for j in range(7)], axis=1)
    error = np.abs(plain - np.array([p.q for p in points])).max(axis=1)
    gaps = np.diff(by_ros[(by_ros > 0.0) & (by_ros < SECONDS)])
    return {
        "distance": max(distances),
        "moment": max(moments),
        "missed": int(np.isinf(moments).sum()),
        "at_its_time": float(error.max()),
        "at_its_time_rms": float(np.sqrt((error**2).mean())),
        "held_up": float((by_ros - times)[(by_ros > 0.0) & (by_ros < SECONDS)].max()),
        "states": len(times),
        "longest_gap": float(gaps.max()),
    }


def stream(client: Client, rate: float) -> dict[str, float]:
    """Stream a swing of A7 by single points, and measure how the arm follows.

    Args:
        client: of the trajectory topic.
        rate: of messages [Hz].
    """
    here = rests(client)
    away = swing(client)
    begin = client.now()
    send = single(client, rate)
    paced(client, rate, round(DURATION * rate), lambda k: send(k, here, away))
    arrives(client, here + away)
    return asdict(measure(client, begin, here, away, 0.0))


def compare(states: Watch, bare: Watch, rate: float, processes: Sequence[int]) -> dict[str, Any]:
    """Regularity of joint states, and their latency beside that of a bare topic in the same windows of time.

    Args:
        states: on the node's joint states.
        bare: on a publisher without a robot, of the same type.
        rate: of the states [Hz]; that of the bare topic is higher by `DRIFT`.
        processes: what serves both: node, publisher, cabinet.
    """
    where = placements()
    seconds = WATCHED / BLOCKS / len(where)
    gaps: list[Floats] = []
    blocks = []
    with placed():
        for _ in range(BLOCKS):
            for placement in where:
                pin(os.getpid(), placement.near)
                for process in processes:
                    pin(process, placement.far)
                time.sleep(0.2)  # messages in transit while the threads change
                states.restart()
                bare.restart()
                with Noise(measured=tuple(processes)) as noise:
                    time.sleep(seconds)
                came, stamps = states.times
                gaps.append(np.diff(came))
                values = came - stamps
                floors = np.subtract(*bare.times)
                block = {"placement": placement.name, "values": values.tolist(), "floors": floors.tolist()}
                blocks.append(block | {"others": noise.others, "stolen": noise.stolen})
    every = np.concatenate(gaps)
    return {
        "rate": float(1.0 / every.mean()),
        "late": float((every > 2.0 / rate).mean()),
        "gap_p999": float(np.percentile(every, 99.9)),
        "blocks": blocks,
    }
