"""What the node is told: command and servo topics, services."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import Pose, PoseStamped, WrenchStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty
from trajectory_msgs.msg import JointTrajectory

from heptarm.bridge.driver import Answer, Driver
from heptarm.bridge.fri_services import fri_joint, fri_pose, fri_wrench
from heptarm.bridge.messages import trajectory_goal
from heptarm.bridge.motions import stamped_pose
from heptarm.bridge.names import Meaning
from heptarm.bridge.service import Service, fill
from heptarm.bridge.services import SERVICES, Services
from heptarm.errors import HeptarmError, NotReady
from heptarm_ros2 import convert, peers

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode


class Commands:
    """Takes commands and services to the driver. A stop never waits behind another command."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        one_by_one, at_once = MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup()
        topics: tuple[tuple[type, str, Callable[[Driver, Any], None]], ...] = (
            (JointState, "~/command/joint", self._command_joint),
            (PoseStamped, "~/command/pose", self._command_pose),
            (PoseStamped, "~/command/lin", self._command_lin),
            (JointState, "~/servo/joint", self._servo_joint),
            (JointState, "~/servo/velocity", self._servo_velocity),
            (PoseStamped, "~/servo/pose", self._servo_pose),
            (PoseStamped, "~/servo/lin", self._servo_lin),
            (JointTrajectory, "~/joint_trajectory", self._joint_trajectory),
            (JointState, "~/fri/joint", fri_joint),
            (WrenchStamped, "~/fri/wrench", fri_wrench),
            (PoseStamped, "~/fri/pose", fri_pose),
        )
        theirs: dict[Meaning, tuple[type, Callable[[Driver, Any], None]]] = {
            Meaning.JOINT: (JointState, peers.joint),
            Meaning.CARTESIAN: (Pose, peers.cartesian),
            Meaning.TRAJECTORY: (JointTrajectory, self._joint_trajectory),
        }
        topics += tuple(
            (theirs[entry.meaning][0], entry.name, theirs[entry.meaning][1])
            for entry in peers.entries(node, *theirs)
        )
        self._subscriptions = [
            node.create_subscription(kind, name, self._guarded(name, work), 1, callback_group=one_by_one)
            for kind, name, work in topics
        ]
        stops = [(Empty, "~/stop"), *((Empty, entry.name) for entry in peers.entries(node, Meaning.STOP))]
        for kind, name in stops:
            work = self._guarded(name, lambda driver, _: self._stopped(driver))
            self._subscriptions.append(node.create_subscription(kind, name, work, 1, callback_group=at_once))
        groups = {True: at_once, False: MutuallyExclusiveCallbackGroup()}
        self._offered: tuple[Driver, Services] | None = None
        self._services = [
            node.create_service(_type(row), row.name, self._service(row), callback_group=groups[row.at_once])
            for row in SERVICES
        ]

    def destroy(self) -> None:
        """End them."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        for service in self._services:
            self._node.destroy_service(service)

    def _guarded(self, name: str, work: Callable[[Driver, Any], None]) -> Callable[[Any], None]:
        """A callback that tells the log why a message was refused."""

        def callback(message: Any) -> None:
            try:
                driver = self._node.driver
                if driver is None:
                    raise NotReady("the node is not configured")
                work(driver, message)
            except HeptarmError as error:
                self._node.get_logger().warning(f"{name}: {error}", throttle_duration_sec=1.0)

        return callback

    def _service(self, row: Service) -> Callable[[Any, Any], Any]:
        def callback(request: Any, response: Any) -> Any:
            driver = self._node.driver
            if driver is None:
                answer = Answer(False, "the node is not configured")
            else:
                if self._offered is None or self._offered[0] is not driver:
                    self._offered = driver, Services(driver, convert.ros(self._node))
                answer = self._offered[1].answer(row, request)
            return fill(response, answer)

        return callback

    @staticmethod
    def _stopped(driver: Driver) -> None:
        answer = driver.stop()
        if not answer.success:
            raise NotReady(answer.message)

    @staticmethod
    def _command_joint(driver: Driver, message: JointState) -> None:
        driver.move(driver.positions(message.name, message.position))

    def _command_pose(self, driver: Driver, message: PoseStamped) -> None:
        driver.move(stamped_pose(message, driver.configuration.frame("base")))

    def _command_lin(self, driver: Driver, message: PoseStamped) -> None:
        driver.move(stamped_pose(message, driver.configuration.frame("base")), straight=True)

    @staticmethod
    def _servo_joint(driver: Driver, message: JointState) -> None:
        target = driver.positions(message.name, message.position)
        driver.follow(target, driver.velocities(message.name, message.velocity) if message.velocity else None)

    @staticmethod
    def _servo_velocity(driver: Driver, message: JointState) -> None:
        driver.follow_velocity(driver.velocities(message.name, message.velocity))

    @staticmethod
    def _servo_pose(driver: Driver, message: PoseStamped) -> None:
        driver.follow(stamped_pose(message, driver.configuration.frame("base")))

    @staticmethod
    def _servo_lin(driver: Driver, message: PoseStamped) -> None:
        driver.follow(stamped_pose(message, driver.configuration.frame("base")), straight=True)

    def _joint_trajectory(self, driver: Driver, message: JointTrajectory) -> None:
        if not message.points and not message.joint_names:  # as in ROS 1: an empty one stops
            self._stopped(driver)
            return
        driver.accept(trajectory_goal(self._node.ros, message, now=driver.now))


def _type(row: Service) -> Any:
    package, _, name = row.type.partition("/")
    return getattr(importlib.import_module(f"{package}.srv"), name)
