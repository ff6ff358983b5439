"""Subscribers and services for the tables of `heptarm.ros.interface`."""

from __future__ import annotations

from typing import Any

import rospy

from heptarm.errors import HeptarmError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.offered import offered
from heptarm.ros.interface.service import Service, ServiceDispatcher
from heptarm.ros.interface.topics import Topic, TopicDispatcher
from heptarm.ros.trajectory.send_times import PublishInfo
from heptarm_ros1 import convert


class Commands:
    """Passes messages and requests to their handlers."""

    def __init__(self, context: NodeContext) -> None:
        table = offered(context.driver.configuration.values)
        for package in table.missing:
            rospy.logwarn(f"{package} is not installed: topics and services with its types are left out")
        topics, requests = TopicDispatcher(context), ServiceDispatcher(context)
        self._subscribers = [_subscriber(topics, row) for row in table.topics]
        self._services = [_service(requests, row) for row in table.services]

    def destroy(self) -> None:
        """Destroy subscribers and services."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        for service in self._services:
            service.shutdown("the node was cleaned up")


def _subscriber(topics: TopicDispatcher, row: Topic) -> rospy.Subscriber:
    name = convert.name(row.name)

    def callback(message: Any) -> None:
        try:
            topics.handle(row, message, _sent(message))
        except HeptarmError as error:
            rospy.logwarn_throttle(1.0, f"{name}: {error}")

    kind = class_of(row.type, "msg")
    return rospy.Subscriber(name, kind, callback, queue_size=row.depth, tcp_nodelay=True)


def _sent(message: Any) -> PublishInfo:
    """As which message of its publisher it was published: ROS 1 numbers those with a header."""
    header = getattr(message, "header", None)
    return PublishInfo() if header is None else PublishInfo(number=header.seq)


def _service(requests: ServiceDispatcher, row: Service) -> rospy.Service:
    kind = class_of(row.type, "srv")

    def callback(request: Any) -> Any:
        return requests.answer(row, request).fill(kind._response_class())

    return rospy.Service(convert.name(row.name), kind, callback)
