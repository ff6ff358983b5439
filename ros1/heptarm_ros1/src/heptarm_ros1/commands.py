"""What the node is told: command and servo topics, services."""

from __future__ import annotations

import contextlib
import importlib
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import rospy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty
from trajectory_msgs.msg import JointTrajectory

from heptarm.bridge.driver import Driver
from heptarm.bridge.fri_services import fri_joint, fri_pose, fri_wrench
from heptarm.bridge.messages import trajectory_goal
from heptarm.bridge.motions import stamped_pose
from heptarm.bridge.service import Service, fill
from heptarm.bridge.services import SERVICES, Services
from heptarm.errors import HeptarmError, NotReady
from heptarm_ros1 import convert

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode

Work = Callable[[Driver, Any], object]


def _command_joint(driver: Driver, message: JointState) -> None:
    driver.move(driver.positions(message.name, message.position))


def _command_pose(driver: Driver, message: PoseStamped) -> None:
    driver.move(stamped_pose(message, driver.configuration.frame("base")))


def _command_lin(driver: Driver, message: PoseStamped) -> None:
    driver.move(stamped_pose(message, driver.configuration.frame("base")), straight=True)


def _servo_joint(driver: Driver, message: JointState) -> None:
    target = driver.positions(message.name, message.position)
    driver.follow(target, driver.velocities(message.name, message.velocity) if message.velocity else None)


def _servo_velocity(driver: Driver, message: JointState) -> None:
    driver.follow_velocity(driver.velocities(message.name, message.velocity))


def _servo_pose(driver: Driver, message: PoseStamped) -> None:
    driver.follow(stamped_pose(message, driver.configuration.frame("base")))


def _servo_lin(driver: Driver, message: PoseStamped) -> None:
    driver.follow(stamped_pose(message, driver.configuration.frame("base")), straight=True)


def joint_trajectory(driver: Driver, message: JointTrajectory) -> None:
    """Follow a trajectory of the topic; an empty one stops."""
    if not message.points and not message.joint_names:
        stop(driver, message)
        return
    driver.accept(trajectory_goal(convert.ROS, message, now=driver.now))


def stop(driver: Driver, message: object) -> None:
    """Stop whatever runs."""
    answer = driver.stop()
    if not answer.success:
        raise NotReady(answer.message)


#: Topics: type, name, what to do.
TOPICS: tuple[tuple[type, str, Work], ...] = (
    (JointState, "~command/joint", _command_joint),
    (PoseStamped, "~command/pose", _command_pose),
    (PoseStamped, "~command/lin", _command_lin),
    (JointState, "~servo/joint", _servo_joint),
    (JointState, "~servo/velocity", _servo_velocity),
    (PoseStamped, "~servo/pose", _servo_pose),
    (PoseStamped, "~servo/lin", _servo_lin),
    (JointTrajectory, "~joint_trajectory", joint_trajectory),
    (JointState, "~fri/joint", fri_joint),
    (WrenchStamped, "~fri/wrench", fri_wrench),
    (PoseStamped, "~fri/pose", fri_pose),
    (Empty, "~stop", stop),
)


def subscriber(
    node: HeptarmNode, one_by_one: threading.Lock, kind: type, name: str, work: Work
) -> rospy.Subscriber:
    """A subscriber that tells the log why a message was refused; a stop never waits behind another command.

    Args:
        node: whose driver is told.
        one_by_one: held by a command.
        kind: type of the messages.
        name: of the topic.
        work: what to do.
    """

    def callback(message: Any) -> None:
        try:
            driver = node.driver
            if driver is None:
                raise NotReady("the node is not configured")
            with contextlib.nullcontext() if work is stop else one_by_one:
                work(driver, message)
        except HeptarmError as error:
            rospy.logwarn_throttle(1.0, f"{name}: {error}")

    return rospy.Subscriber(name, kind, callback, queue_size=1, tcp_nodelay=True)


class Commands:
    """Takes commands and services to the driver."""

    def __init__(self, node: HeptarmNode, driver: Driver) -> None:
        one_by_one = threading.Lock()
        self._subscribers = [subscriber(node, one_by_one, *topic) for topic in TOPICS]
        offered = Services(driver, convert.ROS)
        self._services = [_service(offered, row) for row in SERVICES]

    def destroy(self) -> None:
        """End them."""
        for one in self._subscribers:
            one.unregister()
        for service in self._services:
            service.shutdown("the node was cleaned up")


def _service(offered: Services, row: Service) -> rospy.Service:
    package, _, name = row.type.partition("/")
    kind = getattr(importlib.import_module(f"{package}.srv"), name)

    def callback(request: Any) -> Any:
        return fill(kind._response_class(), offered.answer(row, request))

    return rospy.Service(f"~{row.name[2:]}", kind, callback)
