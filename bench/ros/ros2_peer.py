"""The part of the ROS 2 figures that needs rclpy; `bench.ros.nodes` starts it. Prints one JSON object.

build/ros2/bin/python -m bench.ros.ros2_peer trajectory_servo|trajectory_fri TARGET
build/ros2/bin/python -m bench.ros.ros2_peer stream TARGET
build/ros2/bin/python -m bench.ros.ros2_peer states TARGET CABINET-PROCESS
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any, NoReturn

import rclpy
from heptarm_msgs.msg import RobotState
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from bench.ros.peer import DRIFT, RATE, RATES, Watch, compare, follow, stream
from tests.ros2.peer import Client, NodeProcess, Ros, stamp, until


def watched(ros: Ros, topic: str, kind: type = JointState) -> Watch:
    """Watch a topic."""
    watch = Watch(stamp)
    ros.node.create_subscription(kind, topic, watch.take, 100)
    return watch


def trajectory(target: str, execution: str) -> dict[str, Any]:
    """Measure at which distance and when the arm passes the points of a trajectory."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=RATE, execution=execution)
    client = Client(ros, None)
    client.ready()
    found = follow(client, watched(ros, "/heptarm/state", RobotState), execution)
    node.finish()
    ros.close()
    return found


def streams(target: str) -> dict[str, Any]:
    """Measure how the arm follows streams of several rates."""
    ros = Ros("bench")
    node = NodeProcess(target, state_rate=RATE)
    client = Client(ros, None)
    client.ready()
    found = {f"{rate:g}": stream(client, rate) for rate in (50.0, 100.0, 250.0)}
    node.finish()
    ros.close()
    return found


def states(target: str, cabinet: int) -> dict[str, Any]:
    """Measure the regularity of joint states, and their latency beside that of a bare topic, by their rate."""
    ros = Ros("bench")
    client = Client(ros, None)
    both = watched(ros, "/joint_states"), watched(ros, "/bare")
    found = {}
    for rate in RATES:
        node = NodeProcess(target, state_rate=rate)
        client.ready()
        ros.forget(0)
        with subprocess.Popen(
            [sys.executable, "-m", "bench.ros.ros2_peer", "publish", str(rate + DRIFT)]
        ) as process:
            for one in both:
                one.restart()
            until(lambda: min(map(len, both)) > rate, "messages come")  # noqa: B023  called at once
            found[f"{rate:g}"] = compare(*both, rate, [node.process.pid, process.pid, cabinet])
            process.terminate()
        node.finish()
    ros.close()
    return found


def publish(rate: float) -> NoReturn:
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
        following += 1.0 / rate
        time.sleep(max(0.0, following - time.monotonic()))


if __name__ == "__main__":
    what, _, execution = sys.argv[1].partition("_")
    if what == "publish":
        publish(float(sys.argv[2]))
    elif what == "stream":
        print(json.dumps(streams(sys.argv[2])))
    elif what == "trajectory":
        print(json.dumps(trajectory(sys.argv[2], execution)))
    else:
        print(json.dumps(states(sys.argv[2], int(sys.argv[3]))))
