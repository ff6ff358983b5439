"""Subscribers and services for the tables of `heptarm.ros.interface`."""

from __future__ import annotations

from typing import Any

import rospy

from heptarm.errors import HeptarmError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.newest_message import NewestMessage
from heptarm.ros.interface.offered import offered
from heptarm.ros.interface.service import Service, ServiceDispatcher
from heptarm.ros.interface.topics import Topic, TopicDispatcher
from heptarm.ros.trajectory.send_times import PublishInfo
from heptarm_ros1 import convert

#: Messages of a topic without numbers that are counted in one burst.
_BURST = 1000


class Commands:
    """Passes messages and requests to their handlers."""

    def __init__(self, context: NodeContext) -> None:
        table = offered(context.driver.configuration.values)
        for package in table.missing:
            rospy.logwarn(f"{package} is not installed: topics and services with its types are left out")
        topics, requests = TopicDispatcher(context), ServiceDispatcher(context)
        self._subscribers = [_Subscriber(topics, row) for row in table.topics]
        self._services = [_service(requests, row) for row in table.services]

    def destroy(self) -> None:
        """Destroy subscribers and services."""
        for subscriber in self._subscribers:
            subscriber.end()
        for service in self._services:
            service.shutdown("the node was cleaned up")


class _Subscriber:
    """Passes the messages of a topic to its handler.

    Args:
        topics: handles them.
        row: of the topic.
    """

    def __init__(self, topics: TopicDispatcher, row: Topic) -> None:
        self._topics, self._row, self._name = topics, row, convert.name(row.name)
        kind = class_of(row.type, "msg")
        self._newest: NewestMessage | None = None
        take, depth = self._on_message, row.depth
        if row.counted and "header" not in kind.__slots__:
            self._newest = NewestMessage(self._name, self._handle)
            take, depth = self._newest.put, _BURST
        self._subscriber = rospy.Subscriber(self._name, kind, take, queue_size=depth, tcp_nodelay=True)

    def end(self) -> None:
        """Handle no more messages."""
        self._subscriber.unregister()
        if self._newest is not None:
            self._newest.end()

    def _on_message(self, message: Any) -> None:
        header = getattr(message, "header", None)
        self._handle(message, None if header is None else header.seq)

    def _handle(self, message: Any, number: int | None) -> None:
        """Handle a message; ROS 1 numbers those with a header."""
        try:
            self._topics.handle(self._row, message, PublishInfo(number=number))
        except HeptarmError as error:
            rospy.logwarn_throttle(1.0, f"{self._name}: {error}")


def _service(requests: ServiceDispatcher, row: Service) -> rospy.Service:
    kind = class_of(row.type, "srv")

    def callback(request: Any) -> Any:
        return requests.answer(row, request).fill(kind._response_class())

    return rospy.Service(convert.name(row.name), kind, callback)
