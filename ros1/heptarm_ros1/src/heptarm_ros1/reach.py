"""A node in which a reach policy moves the arm through the servo topic of the heptarm node.

rosrun heptarm_ros1 reach
rostopic pub -1 /reach/target geometry_msgs/PointStamped "{point: {x: 0.55, y: 0.1, z: 0.4}}"
"""

from __future__ import annotations

import threading

import rospy
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Float64

from heptarm.errors import HeptarmError
from heptarm.rl.follower import Follower
from heptarm.rl.policy import Policy, shipped


class Reach:
    """Reaches for ~target until ~hold; the arm brakes when either node falls silent."""

    def __init__(self) -> None:
        driver = rospy.get_param("~driver", "heptarm")
        self._joints = list(rospy.get_param("~joint_names", [f"A{i}" for i in range(1, 8)]))
        self._base = rospy.get_param("~base_frame", "link_0")
        path = rospy.get_param("~policy", "")
        policy = Policy.load(path) if path else shipped(feature=rospy.get_param("~feature", True))
        self._follower = Follower(policy, self._joints)
        self._lock = threading.Lock()  # every topic has a thread of its own
        self._commands = rospy.Publisher(f"{driver}/servo/joint", JointState, queue_size=1, tcp_nodelay=True)
        self._distance = rospy.Publisher("~distance", Float64, queue_size=10)
        rospy.Subscriber("joint_states", JointState, self._on_joints, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("~target", PointStamped, self._on_target, queue_size=1)
        rospy.Subscriber("~hold", Empty, self._on_hold, queue_size=1)

    def run(self) -> None:
        """Command at the rate of the task until ROS shuts down."""
        rate = rospy.Rate(self._follower.task.rate)
        while not rospy.is_shutdown():
            self._decide()
            try:
                rate.sleep()
            except rospy.ROSInterruptException:
                return

    def _on_joints(self, message: JointState) -> None:
        with self._lock:
            self._follower.on_joints(message.name, message.position, message.velocity, rospy.get_time())

    def _on_target(self, message: PointStamped) -> None:
        point, frame = message.point, message.header.frame_id
        if frame not in ("", self._base):
            rospy.logwarn(f"frame of the target must be {self._base!r}, got {frame!r}")
            return
        try:
            with self._lock:
                self._follower.on_target((point.x, point.y, point.z))
        except HeptarmError as error:
            rospy.logwarn(str(error))

    def _on_hold(self, _: Empty) -> None:
        with self._lock:
            self._follower.on_target(None)

    def _decide(self) -> None:
        with self._lock:
            command, distance = self._follower.command(rospy.get_time()), self._follower.distance
        if command is not None:
            self._commands.publish(JointState(name=self._joints, position=command.tolist()))
            self._distance.publish(Float64(data=distance))


def main() -> int:
    """Run the node; returns the exit code of the process."""
    rospy.init_node("reach")
    Reach().run()
    return 0
