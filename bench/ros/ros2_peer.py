"""The part of the ROS 2 figures that runs where rclpy is; `bench.ros` starts it. Prints one JSON object.

build/ros2/bin/python -m bench.ros2_peer trajectory_servo|trajectory_fri|states|bare TARGET
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any, NoReturn

import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from bench.ros_peer import RATE, WATCHED, follow, timing
from tests.ros2.peer import Client, NodeProcess, Ros, stamp, until


class Watch:
    """Everything that comes on a topic of joint states, with the time at which it came."""

    def __init__(self, ros: Ros, topic: str) -> None:
        self.came: list[float] = []
        self.messages: list[Any] = []
        ros.node.create_subscription(JointState, topic, self._take, 100)

    def _take(self, message: Any) -> None:
        self.came.append(time.time())
        self.messages.append(message)

    def stamps(self) -> Any:
        return np.array([stamp(message) for message in list(self.messages)])


def trajectory(target: str, execution: str) -> dict[str, Any]:
    """How near the arm passes the points of a trajectory, and when."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=RATE, execution=execution)
    client = Client(ros, None)
    client.ready()
    found = follow(client, Watch(ros, "/joint_states"), execution)
    node.finish()
    ros.close()
    return found


def states(target: str) -> dict[str, Any]:
    """How evenly joint states come."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=RATE)
    client = Client(ros, None)
    client.ready()
    ros.forget(0)
    time.sleep(1.0)
    watch = Watch(ros, "/joint_states")
    until(lambda: len(watch.came) > 10, "states come")
    del watch.came[:], watch.messages[:]
    time.sleep(WATCHED)
    found = timing(watch)
    node.finish()
    ros.close()
    return found


def bare(target: str) -> dict[str, Any]:
    """The same from a publisher without a robot, in a process of its own."""
    ros = Ros("bench")
    watch = Watch(ros, "/bare")
    with subprocess.Popen([sys.executable, "-m", "bench.ros2_peer", "publish", ""]) as process:
        until(lambda: len(watch.came) > 100, "messages come")
        del watch.came[:], watch.messages[:]
        time.sleep(WATCHED / 4)
        found = timing(watch)
        process.terminate()
    ros.close()
    return found


def publish(target: str) -> NoReturn:
    """Publish joint states with nothing behind them, until a signal ends the process."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("bare")
    publisher = node.create_publisher(JointState, "/bare", 10)
    names = [f"A{i}" for i in range(1, 8)]
    zeros = [0.0] * 7
    following = time.monotonic()
    while True:
        message = JointState(name=names, position=zeros, velocity=zeros, effort=zeros)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)
        following += 1.0 / RATE
        time.sleep(max(0.0, following - time.monotonic()))


if __name__ == "__main__":
    what, _, way = sys.argv[1].partition("_")
    if what == "trajectory":
        print(json.dumps(trajectory(sys.argv[2], way)))
    else:
        print(json.dumps({"states": states, "bare": bare, "publish": publish}[what](sys.argv[2])))
