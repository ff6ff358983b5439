"""A node in which a policy moves the arm through the servo topics of the heptarm node.

rosrun heptarm_ros1 reach
rostopic pub -1 /reach/target geometry_msgs/PointStamped "{point: {x: 0.55, y: 0.1, z: 0.4}}"
rosrun heptarm_ros1 reach _policy:=peg-in-hole
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import rospy

from heptarm.errors import HeptarmError
from heptarm.ros.interface.messages import class_of, put
from heptarm.ros.policy_node import PolicyNode, PolicyParameters, Send


class _Ros:
    """What the node needs of ROS 1."""

    def __init__(self) -> None:
        self.now, self.info, self.warn = rospy.get_time, rospy.loginfo, rospy.logwarn

    def publisher(self, topic: str, kind: str) -> Send:
        made = class_of(kind, "msg")
        publisher = rospy.Publisher(
            topic.replace("~/", "~"), made, queue_size=10 if topic.startswith("~") else 1, tcp_nodelay=True
        )

        def send(fields: Mapping[str, Any]) -> None:
            message = made()
            put(message, fields)
            publisher.publish(message)

        return send

    def subscribe(self, topic: str, kind: str, handler: Callable[[Any], None]) -> None:
        made = class_of(kind, "msg")
        rospy.Subscriber(topic.replace("~/", "~"), made, handler, queue_size=1, tcp_nodelay=True)

    def call(self, service: str, kind: str, fields: Mapping[str, Any], then: Callable[[Any], None]) -> None:
        proxy = rospy.ServiceProxy(service, class_of(kind, "srv"))

        def wait() -> None:
            try:
                response = proxy(**fields)
            except (rospy.ServiceException, rospy.ROSException) as error:
                self.warn(f"the service {service} did not answer, is the name of the driver right? {error}")
                return
            then(response)

        threading.Thread(target=wait, name="heptarm-call", daemon=True).start()


def main() -> int:
    """Run the node; returns the exit code of the process."""
    rospy.init_node("reach")
    given = {name: rospy.get_param(f"~{name}", value) for name, value in asdict(PolicyParameters()).items()}
    try:
        node = PolicyNode(_Ros(), PolicyParameters(**given))
    except HeptarmError as error:  # of a parameter
        rospy.logfatal(str(error))
        return 1
    rate = rospy.Rate(node.rate)
    while not rospy.is_shutdown():
        node.decide()
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    return 0
