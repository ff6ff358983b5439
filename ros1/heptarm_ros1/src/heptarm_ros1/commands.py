"""What the node is told: command and servo topics, services."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import rospy

from heptarm.bridge.messages import class_of
from heptarm.bridge.service import Service, fill
from heptarm.bridge.services import SERVICES, Services
from heptarm.bridge.topics import Topic, Topics, topics_of
from heptarm.errors import HeptarmError
from heptarm_ros1 import convert

if TYPE_CHECKING:
    from heptarm.bridge.driver import Driver


class Commands:
    """Takes commands and services to the driver."""

    def __init__(self, driver: Driver) -> None:
        names = driver.configuration.values["names"]
        topics, services = Topics(driver, convert.ROS), Services(driver, convert.ROS)
        self._subscribers = [_subscriber(topics, row) for row in topics_of(names)]
        self._services = [_service(services, row) for row in SERVICES]

    def destroy(self) -> None:
        """End them."""
        for one in self._subscribers:
            one.unregister()
        for service in self._services:
            service.shutdown("the node was cleaned up")


def _subscriber(topics: Topics, row: Topic) -> rospy.Subscriber:
    """One that tells the log why a message was refused."""
    name = convert.name(row.name)

    def callback(message: Any) -> None:
        try:
            topics.take(row, message)
        except HeptarmError as error:
            rospy.logwarn_throttle(1.0, f"{name}: {error}")

    return rospy.Subscriber(name, class_of(row.type, "msg"), callback, queue_size=1, tcp_nodelay=True)


def _service(services: Services, row: Service) -> rospy.Service:
    kind = class_of(row.type, "srv")

    def callback(request: Any) -> Any:
        return fill(kind._response_class(), services.answer(row, request))

    return rospy.Service(convert.name(row.name), kind, callback)
