"""What the peers of both ROS measure, free of ROS: how near its points a trajectory came, how evenly states come."""

from __future__ import annotations

import time
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from heptarm.bridge.goal import Goal, Outcome, Point
from tests.conformance.client import Client

Floats = npt.NDArray[np.float64]

#: A trajectory of so many seconds and points.
SECONDS, POINTS = 10.0, 100
#: How near each way of execution is to pass a point [rad]; how long its motion may take to open [s].
NEAR, OPENING = {"servo": 2e-3, "fri": 5e-4}, 4.0
#: States per second, and for how long.
RATE, WATCHED = 200.0, 60.0
#: Every joint swings so far [rad], so often in a trajectory.
SWING = np.array([0.5, 0.3, 0.5, 0.4, 0.6, 0.4, 0.8])
TURNS = np.array([1.0, 2.0, 1.5, 1.0, 2.0, 1.5, 2.5])


class Watch(Protocol):
    """Everything that comes on a topic of joint states.

    Attributes:
        came: when each came [s].
        messages: the messages.
    """

    came: list[float]
    messages: list[Any]

    def stamps(self) -> Floats:
        """Their time stamps [s]."""
        ...


def wave(share: Floats) -> tuple[Floats, Floats, Floats]:
    """Offset, velocity and acceleration at shares of the duration, shape (n, 7): at rest at both ends."""
    s = share[:, None]
    # the window begins and ends with no slope and no bend
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
    """Send the trajectory, wait for its end, and look how near the arm came.

    Args:
        client: of the action.
        watch: on the node's joint states.
        execution: way of execution that the node has.
    """
    share = np.arange(1, POINTS + 1) / POINTS
    q, dq, ddq = wave(share)
    here = client.place().q
    start = client.now() + OPENING
    points = tuple(
        Point(float(s * SECONDS), tuple((here + a).tolist()), tuple(b.tolist()), tuple(c.tolist()))
        for s, a, b, c in zip(share, q, dq, ddq)
    )
    sent = client.send(Goal(client.joints, points, start))
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended
    time.sleep(0.1)  # the last states are on their way
    times = watch.stamps() - start
    places = np.array([message.position for message in watch.messages])[: len(times)]
    fine = np.arange(-0.02, 0.02005, 0.0001)
    distances, moments = [], []
    for point in points:
        at = np.stack([np.interp(point.time + fine, times, places[:, j]) for j in range(7)], axis=1)
        off = np.abs(at - np.array(point.q)).max(axis=1)
        near = off <= NEAR[execution]
        moments.append(float(np.abs(fine[near]).min()) if near.any() else float("inf"))
        distances.append(float(off.min()))
    plain = np.stack([np.interp([p.time for p in points], times, places[:, j]) for j in range(7)], axis=1)
    error = np.abs(plain - np.array([p.q for p in points])).max(axis=1)
    gaps = np.diff(times[(times > 0.0) & (times < SECONDS)])
    return {
        "distance": max(distances),
        "moment": max(moments),
        "missed": int(np.isinf(moments).sum()),
        "at_its_time": float(error.max()),
        "at_its_time_rms": float(np.sqrt((error**2).mean())),
        "states": len(times),
        "longest_gap": float(gaps.max()),
    }


def timing(watch: Watch) -> dict[str, Any]:
    """How evenly messages came, and how long after their stamps."""
    stamps = watch.stamps()
    came = np.array(watch.came)[: len(stamps)]
    gaps, delays = np.diff(came), came - stamps
    return {
        "rate": float(1.0 / gaps.mean()),
        "late": float((gaps > 2.0 / RATE).mean()),
        "gap_p999": float(np.percentile(gaps, 99.9)),
        "latency_median": float(np.median(delays)),
        "latency_p99": float(np.percentile(delays, 99)),
        "states": len(came),
    }
