"""Subscriptions and services for the tables of `heptarm.ros.interface`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from heptarm.errors import HeptarmError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.offered import offered
from heptarm.ros.interface.service import Service, ServiceDispatcher
from heptarm.ros.interface.topics import Topic, TopicDispatcher
from heptarm.ros.trajectory.send_times import PublishInfo
from heptarm_ros2.topic_thread import LeftAlone, TopicThread

#: By whether sensors publish a topic: a subscription that accepts best effort receives reliable publishers, too.
_RELIABILITY = {True: ReliabilityPolicy.BEST_EFFORT, False: ReliabilityPolicy.RELIABLE}
_DURABILITY = {True: DurabilityPolicy.TRANSIENT_LOCAL, False: DurabilityPolicy.VOLATILE}


class Commands:
    """Passes messages and requests to their handlers. A stop never waits for another command."""

    def __init__(self, node: Node, context: NodeContext) -> None:
        self._node = node
        self._topics, self._requests = TopicDispatcher(context), ServiceDispatcher(context)
        table = offered(context.driver.configuration.values)
        for package in table.missing:
            node.get_logger().warning(
                f"{package} is not installed: topics and services with its types are left out"
            )
        at_once, one_service = ReentrantCallbackGroup(), MutuallyExclusiveCallbackGroup()
        one_topic, aside = LeftAlone(), LeftAlone()
        self._subscriptions = [
            node.create_subscription(
                class_of(row.type, "msg"),
                row.name,
                self._on_message(row),
                QoSProfile(
                    depth=row.depth,
                    reliability=_RELIABILITY[row.is_sensor],
                    durability=_DURABILITY[row.is_latched],
                ),
                callback_group=at_once if row.at_once else aside if row.aside else one_topic,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
            for row in table.topics
        ]
        self._threads = [
            TopicThread(
                node,
                [one for one in self._subscriptions if one.callback_group is group],
            )
            for group in (one_topic, aside)
        ]
        self._services = [
            node.create_service(
                class_of(row.type, "srv"),
                row.name,
                self._on_request(row),
                callback_group=at_once if row.at_once else one_service,
            )
            for row in table.services
        ]

    def end(self) -> None:
        """Handle no more messages; returns when the last one is handled."""
        for thread in self._threads:
            thread.end()

    def destroy(self) -> None:
        """Destroy subscriptions and services."""
        self.end()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        for service in self._services:
            self._node.destroy_service(service)

    def _on_message(self, row: Topic) -> Callable[..., None]:
        # rclpy's executor passes no info to it: that of Humble has none
        def callback(message: Any, info: Any = None) -> None:
            try:
                self._topics.handle(row, message, _sent(info))
            except HeptarmError as error:
                self._node.get_logger().warning(f"{row.name}: {error}", throttle_duration_sec=1.0)

        return callback

    def _on_request(self, row: Service) -> Callable[[Any, Any], Any]:
        def callback(request: Any, response: Any) -> Any:
            # an empty one where its type cannot say that something failed
            return self._requests.answer(row, request).fill(response) or response

        return callback


def _sent(info: Any) -> PublishInfo:
    """What the middleware knows of the publishing of a message: not all number them."""
    if info is None:
        return PublishInfo()
    return PublishInfo(number=info.get("publication_sequence_number"), time=1e-9 * info["source_timestamp"])
