"""The part of the ROS 2 figures that runs where rclpy is; `bench.ros2` starts it. Prints one JSON object.

build/ros2/bin/python -m bench.ros2_peer trajectory_servo|trajectory_fri|states|bare TARGET
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState

from heptarm.bridge.goal import Goal, Outcome, Point
from tests.ros2.peer import Client, NodeProcess, Ros, stamp, until

#: A trajectory of so many seconds and points.
SECONDS, POINTS = 10.0, 100
#: How near each way of execution is to pass a point [rad]; how long its motion may take to open [s].
NEAR, OPENING = {"servo": 2e-3, "fri": 5e-4}, 4.0
#: States per second, and for how long.
RATE, WATCHED = 200.0, 60.0
#: Every joint swings so far [rad], so often in a trajectory.
SWING = np.array([0.5, 0.3, 0.5, 0.4, 0.6, 0.4, 0.8])
TURNS = np.array([1.0, 2.0, 1.5, 1.0, 2.0, 1.5, 2.5])


def wave(share: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


class Watch:
    """Everything that comes on a topic of joint states, with the time at which it came."""

    def __init__(self, ros: Ros, topic: str) -> None:
        self.came: list[float] = []
        self.messages: list[Any] = []
        ros.node.create_subscription(JointState, topic, self._take, 100)

    def _take(self, message: Any) -> None:
        self.came.append(time.time())
        self.messages.append(message)


def trajectory(target: str, execution: str) -> dict[str, Any]:
    """How near the arm passes the points of a trajectory, and when."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=200.0, execution=execution)
    client = Client(ros, None)
    client.ready()
    share = np.arange(1, POINTS + 1) / POINTS
    q, dq, ddq = wave(share)
    here = client.place().q
    start = client.now() + OPENING
    points = tuple(
        Point(float(s * SECONDS), tuple((here + a).tolist()), tuple(b.tolist()), tuple(c.tolist()))
        for s, a, b, c in zip(share, q, dq, ddq)
    )
    watch = Watch(ros, "/joint_states")
    sent = client.send(Goal(client.joints, points, start))
    ended = client.result(sent)
    node.finish()
    ros.close()
    assert ended.outcome is Outcome.SUCCEEDED, ended
    times = np.array([stamp(message) for message in watch.messages]) - start
    places = np.array([message.position for message in watch.messages])
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
    return {
        "distance": max(distances),
        "moment": max(moments),
        "at_its_time": float(error.max()),
        "at_its_time_rms": float(np.sqrt((error**2).mean())),
        "states": len(times),
    }


def _timing(watch: Watch) -> dict[str, Any]:
    came = np.array(watch.came)
    gaps = np.diff(came)
    delays = came - np.array([stamp(message) for message in watch.messages])
    return {
        "rate": float(1.0 / gaps.mean()),
        "late": float((gaps > 2.0 / RATE).mean()),
        "gap_p999": float(np.percentile(gaps, 99.9)),
        "latency_median": float(np.median(delays)),
        "latency_p99": float(np.percentile(delays, 99)),
        "states": len(came),
    }


def states(target: str) -> dict[str, Any]:
    """How evenly joint states come."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=RATE)
    client = Client(ros, None)
    client.ready()
    ros.node.destroy_subscription(client.subscription)
    time.sleep(1.0)
    watch = Watch(ros, "/joint_states")
    until(lambda: len(watch.came) > 10, "states come")
    del watch.came[:], watch.messages[:]
    time.sleep(WATCHED)
    found = _timing(watch)
    node.finish()
    ros.close()
    return found


def bare(target: str) -> dict[str, Any]:
    """The same from a publisher without a robot, in a process of its own."""
    ros = Ros("bench")
    watch = Watch(ros, "/bare")
    import subprocess

    with subprocess.Popen([sys.executable, "-m", "bench.ros2_peer", "publish", ""]) as process:
        until(lambda: len(watch.came) > 100, "messages come")
        del watch.came[:], watch.messages[:]
        time.sleep(WATCHED / 4)
        found = _timing(watch)
        process.terminate()
    ros.close()
    return found


def publish(target: str) -> dict[str, Any]:
    """Publish joint states with nothing behind them, until told to end."""
    rclpy.init()
    node = rclpy.create_node("bare")
    publisher = node.create_publisher(JointState, "/bare", 10)
    names = [f"A{i}" for i in range(1, 8)]
    zeros = [0.0] * 7
    ended = threading.Event()
    rclpy.get_default_context().on_shutdown(ended.set)
    following = time.monotonic()
    try:
        while not ended.is_set():
            message = JointState(name=names, position=zeros, velocity=zeros, effort=zeros)
            message.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(message)
            following += 1.0 / RATE
            time.sleep(max(0.0, following - time.monotonic()))
    except (ExternalShutdownException, KeyboardInterrupt):
        pass
    return {}


if __name__ == "__main__":
    what, _, way = sys.argv[1].partition("_")
    if what == "trajectory":
        print(json.dumps(trajectory(sys.argv[2], way)))
    else:
        print(json.dumps({"states": states, "bare": bare, "publish": publish}[what](sys.argv[2])))
