#!/usr/bin/env python3
"""Send joint and pose commands by topics, and wait for the states that show their ends."""

import math
from collections.abc import Callable

import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState


class Arm:
    """Keeps the newest states, and sends commands and waits for their ends."""

    def __init__(self) -> None:
        self.joints = JointState()
        self.pose = PoseStamped()
        rospy.Subscriber("/joint_states", JointState, self.on_joints, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/heptarm/pose", PoseStamped, self.on_pose, queue_size=1, tcp_nodelay=True)
        self.to_joints = rospy.Publisher("/heptarm/command/joint", JointState, queue_size=1)
        self.to_pose = rospy.Publisher("/heptarm/command/lin", PoseStamped, queue_size=1)
        self.until(lambda: self.to_joints.get_num_connections() and self.to_pose.get_num_connections())
        self.until(lambda: self.joints.name and self.pose.header.frame_id)

    def on_joints(self, message: JointState) -> None:
        self.joints = message

    def on_pose(self, message: PoseStamped) -> None:
        self.pose = message

    def until(self, condition: Callable[[], object]) -> None:
        while not condition():
            if rospy.is_shutdown():
                raise SystemExit("ROS ends")
            rospy.sleep(0.01)

    def move_joints(self, **target: float) -> None:
        """Move some joints to positions [rad]; the others keep theirs."""
        self.to_joints.publish(JointState(name=list(target), position=list(target.values())))
        self.until(lambda: all(abs(self.position(name) - value) < 2e-3 for name, value in target.items()))

    def position(self, name: str) -> float:
        return float(self.joints.position[self.joints.name.index(name)])

    def move_straight(self, dx: float = 0.0, dy: float = 0.0, dz: float = 0.0) -> None:
        """Move the flange on a straight line [m]."""
        target = self.pose
        place = target.pose.position
        place.x, place.y, place.z = place.x + dx, place.y + dy, place.z + dz
        target.header.stamp = rospy.Time.now()
        self.to_pose.publish(target)

        def there() -> bool:
            now = self.pose.pose.position
            return math.dist((now.x, now.y, now.z), (place.x, place.y, place.z)) < 1e-3

        self.until(there)


rospy.init_node("move")
arm = Arm()
arm.move_joints(A1=0.0, A2=0.5, A3=0.0, A4=-1.5, A5=0.0, A6=1.1, A7=0.0)
print("joints:", [round(value, 3) for value in arm.joints.position])
for dx, dz in ((0.05, 0.0), (0.0, -0.05), (-0.05, 0.0), (0.0, 0.05)):
    arm.move_straight(dx=dx, dz=dz)
    place = arm.pose.pose.position
    print(f"flange at {place.x:.3f} {place.y:.3f} {place.z:.3f} m")
