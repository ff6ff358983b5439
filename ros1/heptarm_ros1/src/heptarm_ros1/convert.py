"""What of ROS 1 the bridge makes messages of, and names as ROS 1 writes them."""

from __future__ import annotations

import rospy
from control_msgs.msg import FollowJointTrajectoryFeedback
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

from heptarm.bridge.messages import Ros

#: Types and time of ROS.
ROS = Ros(
    joint_state=JointState,
    point=JointTrajectoryPoint,
    feedback=FollowJointTrajectoryFeedback,
    pose=PoseMessage,
    wrench=Wrench,
    diagnostic=DiagnosticStatus,
    key_value=KeyValue,
    now=lambda: int(rospy.Time.now().to_nsec()),
    time=lambda nanos: rospy.Time(nanos // 10**9, nanos % 10**9),
    seconds=lambda message: float(message.to_sec()),
    duration=rospy.Duration.from_sec,
    level=int,
)


def name(ours: str) -> str:
    """A name as in ROS 2; ROS 1 writes the node's own without the slash."""
    return f"~{ours[2:]}" if ours.startswith("~/") else ours
