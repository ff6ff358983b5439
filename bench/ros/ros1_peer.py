"""The part of the ROS 1 figures that runs where rospy is; `bench.ros` starts it. Prints one JSON object.

build/ros1/bin/python -m bench.ros1_peer trajectory_servo|trajectory_fri|states|bare TARGET
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import numpy as np
import rospy
from sensor_msgs.msg import JointState

from bench.ros_peer import RATE, WATCHED, follow, timing
from tests.ros1.peer import Client, Core, NodeProcess, until


class Watch:
    """Everything that comes on a topic of joint states, with the time at which it came."""

    def __init__(self, topic: str) -> None:
        self.came: list[float] = []
        self.messages: list[Any] = []
        self.subscriber = rospy.Subscriber(topic, JointState, self._take, queue_size=100, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        self.came.append(time.time())
        self.messages.append(message)

    def stamps(self) -> Any:
        return np.array([message.header.stamp.to_sec() for message in list(self.messages)])


def _end(node: NodeProcess) -> None:
    code = node.end()
    print(node.said)
    assert code == 0, code


def trajectory(target: str, execution: str) -> dict[str, Any]:
    """How near the arm passes the points of a trajectory, and when."""
    node = NodeProcess(target, state_rate=RATE, execution=execution)
    client = Client(None)
    client.ready()
    found = follow(client, Watch("/joint_states"), execution)
    _end(node)
    return found


def states(target: str) -> dict[str, Any]:
    """How evenly joint states come."""
    node = NodeProcess(target, state_rate=RATE)
    until(lambda: rospy.get_published_topics("/heptarm"), "the node is not there")
    watch = Watch("/joint_states")
    until(lambda: len(watch.came) > RATE, "states come")
    del watch.came[:], watch.messages[:]
    time.sleep(WATCHED)
    found = timing(watch)
    _end(node)
    return found


def bare(target: str) -> dict[str, Any]:
    """The same from a publisher without a robot, in a process of its own."""
    watch = Watch("/bare")
    with subprocess.Popen([sys.executable, "-m", "bench.ros1_peer", "publish", ""]) as process:
        until(lambda: len(watch.came) > 100, "messages come")
        del watch.came[:], watch.messages[:]
        time.sleep(WATCHED / 4)
        found = timing(watch)
        process.terminate()
    return found


def publish(target: str) -> dict[str, Any]:
    """Publish joint states with nothing behind them, until told to end."""
    rospy.init_node("bare")
    publisher = rospy.Publisher("/bare", JointState, queue_size=10, tcp_nodelay=True)
    names = [f"A{i}" for i in range(1, 8)]
    zeros = [0.0] * 7
    following = time.monotonic()
    while not rospy.is_shutdown():
        message = JointState(name=names, position=zeros, velocity=zeros, effort=zeros)
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        following += 1.0 / RATE
        time.sleep(max(0.0, following - time.monotonic()))
    return {}


if __name__ == "__main__":
    what, _, way = sys.argv[1].partition("_")
    if what == "publish":
        publish(sys.argv[2])
    else:
        with Core("bench"):
            if what == "trajectory":
                measured = trajectory(sys.argv[2], way)
            else:
                measured = {"states": states, "bare": bare}[what](sys.argv[2])
        print(json.dumps(measured))
