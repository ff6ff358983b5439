"""The reach policy over ROS 1: joint states in, servo targets out, changing targets."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Float64

from heptarm.rl.task import ReachTask
from tests.conformance.case import rests
from tests.ros1.peer import NODE, PATIENCE, Client, collect, publisher, until


@pytest.fixture
def reach(ros: None) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, str(NODE.with_name("reach"))])
    yield
    process.terminate()
    process.wait(PATIENCE)


def target(x: float, y: float, z: float) -> PointStamped:
    message = PointStamped()
    message.point.x, message.point.y, message.point.z = x, y, z
    return message


@pytest.mark.long  # every run has it with the node of ROS 2
def test_it_reaches_targets_one_after_the_other_and_holds(client: Client, reach: None) -> None:
    home = list(ReachTask().home)
    states = collect("/joint_states", JointState)
    distances = collect("/reach/distance", Float64)
    poses = collect("/heptarm/pose", PoseStamped)
    targets, hold = publisher("/reach/target", PointStamped), publisher("/reach/hold", Empty)
    ptp = publisher("/heptarm/command/joint", JointState)
    ptp.publish(JointState(name=list(client.joints), position=home))
    until(lambda: states and np.abs(np.array(states[-1].position) - home).max() < 1e-3, "not at home")
    for point in ((0.6, 0.15, 0.35), (0.55, -0.1, 0.5)):

        def reached(point: tuple[float, float, float] = point) -> bool:
            targets.publish(target(*point))  # repeatedly: the first may be sent before discovery is complete
            time.sleep(0.2)
            if not poses or not distances or distances[-1].data >= 0.01:
                return False
            place = poses[-1].pose.position  # a distance may still be that to the last target
            return bool(np.linalg.norm(np.array([place.x, place.y, place.z]) - point) < 0.02)

        until(reached, f"{point} is not reached")
    targets.publish(target(3.0, 0.0, 0.4))  # refused; the last one stays
    hold.publish(Empty())
    rests(client)
