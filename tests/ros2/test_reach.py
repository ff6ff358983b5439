"""The reach policy over ROS 2: joint states in, servo targets out, changing targets."""

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
from tests.ros2.peer import PATIENCE, Client, Ros, until


@pytest.fixture
def reach() -> Iterator[None]:
    process = subprocess.Popen([sys.executable, "-m", "heptarm_ros2.reach"])
    yield
    process.terminate()
    process.wait(PATIENCE)


def target(x: float, y: float, z: float) -> PointStamped:
    message = PointStamped()
    message.point.x, message.point.y, message.point.z = x, y, z
    return message


def test_it_reaches_targets_one_after_the_other_and_holds(client: Client, ros: Ros, reach: None) -> None:
    home = list(ReachTask().home)
    ptp = ros.publisher(JointState, "/heptarm/command/joint")
    targets, hold = ros.publisher(PointStamped, "/reach/target"), ros.publisher(Empty, "/reach/hold")
    distances = ros.collect(Float64, "/reach/distance")
    poses = ros.collect(PoseStamped, "/heptarm/pose")
    ptp.publish(JointState(name=list(client.joints), position=home))
    until(lambda: np.abs(np.array(client.states[-1].position) - home).max() < 1e-3, "the arm is not at home")
    for point in ((0.6, 0.15, 0.35), (0.55, -0.1, 0.5)):

        def reached(point: tuple[float, float, float] = point) -> bool:
            targets.publish(target(*point))
            time.sleep(0.2)
            if not poses or not distances or distances[-1].data >= 0.01:
                return False
            place = poses[-1].pose.position  # a distance may still be that to the last target
            return bool(np.linalg.norm(np.array([place.x, place.y, place.z]) - point) < 0.02)

        until(reached, f"{point} is not reached")
    targets.publish(target(3.0, 0.0, 0.4))  # refused; the last one stays
    hold.publish(Empty())
    rests(client)
