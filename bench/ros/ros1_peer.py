"""The part of the ROS 1 figures that needs rospy; `bench.ros.nodes` starts it. Prints one JSON object.

build/ros1/bin/python -m bench.ros.ros1_peer trajectory_servo|trajectory_fri TARGET
build/ros1/bin/python -m bench.ros.ros1_peer stream TARGET
build/ros1/bin/python -m bench.ros.ros1_peer states TARGET CABINET-PROCESS
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import rospy
from heptarm_msgs.msg import RobotState
from sensor_msgs.msg import JointState

from bench.ros.peer import DRIFT, RATE, RATES, Watch, compare, follow, stream
from tests.ros1.peer import Client, Core, NodeProcess, until


def watched(topic: str, kind: type = JointState) -> Watch:
    """Watch a topic."""
    watch = Watch(lambda message: message.header.stamp.to_sec())
    rospy.Subscriber(topic, kind, watch.take, queue_size=100, tcp_nodelay=True)
    return watch


def _end(node: NodeProcess) -> None:
    code = node.end()
    print(node.said)
    assert code == 0, code


def trajectory(target: str, execution: str) -> dict[str, Any]:
    """Measure at which distance and when the arm passes the points of a trajectory."""
    node = NodeProcess(target, state_rate=RATE, execution=execution)
    client = Client(None)
    client.ready()
    found = follow(client, watched("/heptarm/state", RobotState), execution)
    _end(node)
    return found


def streams(target: str) -> dict[str, Any]:
    """Measure how the arm follows streams of several rates."""
    node = NodeProcess(target, state_rate=RATE)
    client = Client(None)
    client.ready()
    found = {f"{rate:g}": stream(client, rate) for rate in (50.0, 100.0, 250.0)}
    _end(node)
    return found


def states(target: str, cabinet: int) -> dict[str, Any]:
    """Measure the regularity of joint states, and their latency beside that of a bare topic, by their rate."""
    both = watched("/joint_states"), watched("/bare")
    found = {}
    for rate in RATES:
        node = NodeProcess(target, state_rate=rate)
        until(lambda: rospy.get_published_topics("/heptarm"), "the node is not there")
        with subprocess.Popen(
            [sys.executable, "-m", "bench.ros.ros1_peer", "publish", str(rate + DRIFT)]
        ) as process:
            for one in both:
                one.restart()
            until(lambda: min(map(len, both)) > rate, "messages come")  # noqa: B023  called at once
            found[f"{rate:g}"] = compare(*both, rate, [node.process.pid, process.pid, cabinet])
            process.terminate()
        _end(node)
    return found


def publish(rate: float) -> None:
    """Publish joint states with nothing behind them, until a signal ends the process."""
    rospy.init_node("bare")
    publisher = rospy.Publisher("/bare", JointState, queue_size=10, tcp_nodelay=True)
    names = [f"A{i}" for i in range(1, 8)]
    zeros = [0.0] * 7
    following = time.monotonic()
    while not rospy.is_shutdown():
        message = JointState(name=names, position=zeros, velocity=zeros, effort=zeros)
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        following += 1.0 / rate
        time.sleep(max(0.0, following - time.monotonic()))


if __name__ == "__main__":
    what, _, execution = sys.argv[1].partition("_")
    if what == "publish":
        publish(float(sys.argv[2]))
    else:
        with Core("bench"):
            if what == "trajectory":
                measured = trajectory(sys.argv[2], execution)
            elif what == "stream":
                measured = streams(sys.argv[2])
            else:
                measured = states(sys.argv[2], int(sys.argv[3]))
        print(json.dumps(measured))
