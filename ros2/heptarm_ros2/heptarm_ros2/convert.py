"""Types and time of ROS 2 for `heptarm.ros`."""

from __future__ import annotations

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
        now=lambda: int(node.get_clock().now().nanoseconds),
        time=lambda nanos: Time(sec=nanos // 10**9, nanosec=nanos % 10**9),
        seconds=lambda message: float(message.sec + message.nanosec * 1e-9),
        duration=_duration,
        level=lambda level: bytes([level]),
        empty_stops=False,
    )


def _duration(seconds: float) -> Duration:
    nanos = round(seconds * 1e9)
    return Duration(sec=nanos // 10**9, nanosec=nanos % 10**9)
