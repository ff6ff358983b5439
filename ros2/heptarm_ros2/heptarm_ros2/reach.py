"""A node in which a reach policy moves the arm through the servo topic of the heptarm node.

ros2 run heptarm_ros2 reach
ros2 topic pub --once /reach/target geometry_msgs/msg/PointStamped "{point: {x: 0.55, y: 0.1, z: 0.4}}"
"""

from __future__ import annotations

from typing import Any, NoReturn

from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Float64

from heptarm.errors import HeptarmError
from heptarm.rl.follower import Follower
from heptarm.rl.policy import Policy, shipped
from heptarm_ros2.process import run


class Reach(Node):
    """Reaches for ~/target until ~/hold; the arm brakes when either node falls silent."""

    def __init__(self, name: str = "reach", **options: Any) -> None:
        super().__init__(name, **options)
        driver = self.declare_parameter("driver", "heptarm").value
        joints = self.declare_parameter("joint_names", [f"A{i}" for i in range(1, 8)]).value
        self._base = self.declare_parameter("base_frame", "link_0").value
        path = self.declare_parameter("policy", "").value
        feature = self.declare_parameter("feature", True).value
        policy = Policy.load(path) if path else shipped(feature=feature)
        self._follower = Follower(policy, joints)
        self._joints = list(joints)
        self._commands = self.create_publisher(JointState, f"{driver}/servo/joint", 1)
        self._distance = self.create_publisher(Float64, "~/distance", 10)
        self.create_subscription(JointState, "joint_states", self._on_joints, 1)
        self.create_subscription(PointStamped, "~/target", self._on_target, 1)
        self.create_subscription(Empty, "~/hold", lambda _: self._follower.on_target(None), 1)
        self.create_timer(1.0 / policy.task.rate, self._decide)

    def _now(self) -> float:
        return float(self.get_clock().now().nanoseconds * 1e-9)

    def _on_joints(self, message: JointState) -> None:
        self._follower.on_joints(message.name, message.position, message.velocity, self._now())

    def _on_target(self, message: PointStamped) -> None:
        point, frame = message.point, message.header.frame_id
        if frame not in ("", self._base):
            self.get_logger().warning(f"frame of the target must be {self._base!r}, got {frame!r}")
            return
        try:
            self._follower.on_target((point.x, point.y, point.z))
        except HeptarmError as error:
            self.get_logger().warning(str(error))

    def _decide(self) -> None:
        command = self._follower.command(self._now())
        if command is not None:
            self._commands.publish(JointState(name=self._joints, position=command.tolist()))
            self._distance.publish(Float64(data=self._follower.distance))


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the node, and end the process."""
    run(Reach, arguments)


if __name__ == "__main__":
    main()
