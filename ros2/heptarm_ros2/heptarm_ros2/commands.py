"""What the node is told: command and servo topics, services."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup

from heptarm.bridge.messages import class_of
from heptarm.bridge.service import Service, fill
from heptarm.bridge.services import SERVICES, Services
from heptarm.bridge.topics import Topic, Topics, topics_of
from heptarm.errors import HeptarmError

if TYPE_CHECKING:
    from heptarm.bridge.driver import Driver
    from heptarm_ros2.node import HeptarmNode


class Commands:
    """Takes commands and services to the driver. A stop never waits behind another command."""

    def __init__(self, node: HeptarmNode, driver: Driver) -> None:
        self._node = node
        self._topics, self._offered = Topics(driver, node.ros), Services(driver, node.ros)
        at_once = ReentrantCallbackGroup()
        told, asked = MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()
        self._subscriptions = [
            node.create_subscription(
                class_of(row.type, "msg"),
                row.name,
                self._taker(row),
                1,
                callback_group=at_once if row.at_once else told,
            )
            for row in topics_of(node.value("names"))
        ]
        self._services = [
            node.create_service(
                class_of(row.type, "srv"),
                row.name,
                self._server(row),
                callback_group=at_once if row.at_once else asked,
            )
            for row in SERVICES
        ]

    def destroy(self) -> None:
        """End them."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        for service in self._services:
            self._node.destroy_service(service)

    def _taker(self, row: Topic) -> Callable[[Any], None]:
        """A callback that tells the log why a message was refused."""

        def callback(message: Any) -> None:
            try:
                self._topics.take(row, message)
            except HeptarmError as error:
                self._node.get_logger().warning(f"{row.name}: {error}", throttle_duration_sec=1.0)

        return callback

    def _server(self, row: Service) -> Callable[[Any, Any], Any]:
        def callback(request: Any, response: Any) -> Any:
            return fill(response, self._offered.answer(row, request))

        return callback
