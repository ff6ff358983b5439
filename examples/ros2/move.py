#!/usr/bin/env python3
"""Send joint and pose commands by topics, and wait for the states that show their ends."""

import math
from collections.abc import Callable

import rclpy
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.task import Future
from sensor_msgs.msg import JointState


class Mover(Node):
    """Keeps the newest states, and sends commands and waits for their ends."""

    def __init__(self) -> None:
        super().__init__("move")
        self.joints = JointState()
        self.pose = PoseStamped()
        self.create_subscription(JointState, "/joint_states", self.on_joints, 1)
        self.create_subscription(PoseStamped, "/heptarm/pose", self.on_pose, 1)
        self.to_joints = self.create_publisher(JointState, "/heptarm/command/joint", 1)
        self.to_pose = self.create_publisher(PoseStamped, "/heptarm/command/lin", 1)
        # until the node has discovered these, what they send is lost: ask for nothing, and again after a second
        probe, answer = self.create_client(GetParameters, "/heptarm/get_parameters"), Future()
        while not answer.done():
            answer = probe.call_async(GetParameters.Request())
            rclpy.spin_until_future_complete(self, answer, timeout_sec=1.0)
        self.until(lambda: self.to_joints.get_subscription_count() and self.to_pose.get_subscription_count())
        self.until(lambda: self.joints.name and self.pose.header.frame_id)

    def on_joints(self, message: JointState) -> None:
        self.joints = message

    def on_pose(self, message: PoseStamped) -> None:
        self.pose = message

    def until(self, condition: Callable[[], object]) -> None:
        while not condition():
            rclpy.spin_once(self, timeout_sec=0.1)

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
        target.header.stamp = self.get_clock().now().to_msg()
        self.to_pose.publish(target)

        def there() -> bool:
            now = self.pose.pose.position
            return math.dist((now.x, now.y, now.z), (place.x, place.y, place.z)) < 1e-3

        self.until(there)


rclpy.init()
arm = Mover()
arm.move_joints(A1=0.0, A2=0.5, A3=0.0, A4=-1.5, A5=0.0, A6=1.1, A7=0.0)
print("joints:", [round(value, 3) for value in arm.joints.position])
for dx, dz in ((0.05, 0.0), (0.0, -0.05), (-0.05, 0.0), (0.0, 0.05)):
    arm.move_straight(dx=dx, dz=dz)
    place = arm.pose.pose.position
    print(f"flange at {place.x:.3f} {place.y:.3f} {place.z:.3f} m")
arm.destroy_node()
rclpy.shutdown()
