"""A node in which a policy moves the arm through the servo topics of the heptarm node.

ros2 run heptarm_ros2 reach
ros2 topic pub --once /reach/target geometry_msgs/msg/PointStamped "{point: {x: 0.55, y: 0.1, z: 0.4}}"
ros2 run heptarm_ros2 reach --ros-args -p policy:=peg-in-hole
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, NoReturn

from rclpy.node import Node

from heptarm.ros.interface.messages import class_of, put
from heptarm.ros.policy_node import PolicyNode, PolicyParameters, Send
from heptarm_ros2.process import run


class Reach(Node):
    """The node of `heptarm.ros.policy_node`; the arm brakes when either node falls silent."""

    def __init__(self, name: str = "reach", **options: Any) -> None:
        super().__init__(name, **options)
        given = {
            key: self.declare_parameter(key, value).value for key, value in asdict(PolicyParameters()).items()
        }
        node = PolicyNode(_Ros(self), PolicyParameters(**given))
        self.create_timer(1.0 / node.rate, node.decide)


class _Ros:
    """What the node needs of ROS 2."""

    def __init__(self, node: Node) -> None:
        self._node, self._log = node, node.get_logger()
        self.info, self.warn = self._log.info, self._log.warning

    def now(self) -> float:
        return float(self._node.get_clock().now().nanoseconds * 1e-9)

    def publisher(self, topic: str, kind: str) -> Send:
        made = class_of(kind, "msg")
        publisher = self._node.create_publisher(made, topic, 10 if topic.startswith("~") else 1)

        def send(fields: Mapping[str, Any]) -> None:
            message = made()
            put(message, fields)
            publisher.publish(message)

        return send

    def subscribe(self, topic: str, kind: str, handler: Callable[[Any], None]) -> None:
        self._node.create_subscription(class_of(kind, "msg"), topic, handler, 1)

    def call(self, service: str, kind: str, fields: Mapping[str, Any], then: Callable[[Any], None]) -> None:
        made = class_of(kind, "srv")
        client = self._node.create_client(made, service)
        if not client.service_is_ready():
            self.warn(f"there is no service {service}: is the name of the driver right?")
            return
        request = made.Request()
        put(request, fields)
        client.call_async(request).add_done_callback(lambda done: then(done.result()))


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the node, and end the process."""
    run(Reach, arguments)


if __name__ == "__main__":
    main()
