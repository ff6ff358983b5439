"""Types and time of ROS 2 for `heptarm.ros`."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable

from builtin_interfaces.msg import Duration, Time
from control_msgs.action import FollowJointTrajectory
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

from heptarm.ros.interface.messages import RosAdapter


def ros(node: Node) -> RosAdapter:
    """Make the adapter of a node."""
    return RosAdapter(
        joint_state=JointState,
        point=JointTrajectoryPoint,
        feedback=FollowJointTrajectory.Feedback,
        pose=PoseMessage,
        wrench=Wrench,
        diagnostic=DiagnosticStatus,
        key_value=KeyValue,
        now=_now(node),
        time=lambda nanos: Time(sec=nanos // 10**9, nanosec=nanos % 10**9),
        seconds=lambda message: float(message.sec + message.nanosec * 1e-9),
        duration=_duration,
        level=lambda level: bytes([level]),
        doubles=lambda numbers: array("d", numbers),  # each number of a list is checked twice
        empty_stops=False,
    )


def _now(node: Node) -> Callable[[], int]:
    """ROS time [ns]; unless it is simulated, that of the system, which rclpy takes ten times as long to read."""
    clock = node.get_clock()
    return lambda: int(clock.now().nanoseconds) if clock.ros_time_is_active else time.time_ns()


def _duration(seconds: float) -> Duration:
    nanos = round(seconds * 1e9)
    return Duration(sec=nanos // 10**9, nanosec=nanos % 10**9)
