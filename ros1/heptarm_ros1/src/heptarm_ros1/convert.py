"""Types and time of ROS 1 for `heptarm.ros`, and names in its notation."""

from __future__ import annotations

import rospy
from control_msgs.msg import FollowJointTrajectoryFeedback
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

from heptarm.ros.interface.messages import RosAdapter

#: Types and time of ROS 1.
ROS = RosAdapter(
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
    doubles=list,
    empty_stops=True,
)


def name(native: str) -> str:
    """Convert a name from the notation of ROS 2: ROS 1 writes private names without the slash."""
    return f"~{native[2:]}" if native.startswith("~/") else native
