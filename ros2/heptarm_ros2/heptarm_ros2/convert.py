"""What of ROS 2 the bridge makes messages of, and poses that come."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Duration, Time
from control_msgs.action import FollowJointTrajectory
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

from heptarm.bridge.messages import Ros
from heptarm.errors import ShapeError
from heptarm.values.pose import Pose


def ros(node: Node) -> Ros:
    """Types and time of a node's ROS."""
    return Ros(
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
    )


def _duration(seconds: float) -> Duration:
    nanos = round(seconds * 1e9)
    return Duration(sec=nanos // 10**9, nanosec=nanos % 10**9)


def pose_value(message: Any, base: str) -> Pose:
    """The pose of a PoseStamped.

    Raises:
        ShapeError: it is given in another frame than the base, or its quaternion is none.
    """
    frame = message.header.frame_id.lstrip("/")
    if frame not in ("", base):
        raise ShapeError(f"the pose is given in {frame!r}", hint=f"give it in {base!r}")
    place, turn = message.pose.position, message.pose.orientation
    return Pose.of([place.x, place.y, place.z], [turn.x, turn.y, turn.z, turn.w])
