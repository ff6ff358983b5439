"""Topics that tell the arm what to do, free of ROS: one table for both nodes, and what each does.

A node listens to every row of `topics_of`; the fields of a message are those of the row's type::

    topics = Topics(driver, ros)
    for row in topics_of(names):
        ...                       # of row.type, under row.name: topics.take(row, message), and log why not
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from heptarm.bridge.driver import Driver
from heptarm.bridge.messages import Ros, trajectory_goal
from heptarm.bridge.motions import stamped_pose
from heptarm.bridge.names import PRESETS, Meaning, joint_target, pose_target
from heptarm.bridge.order import positions, velocities, wishes
from heptarm.values.motion import lin, ptp
from heptarm.values.pose import Pose


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the nodes listen to.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type".
        work: what to do with a message, of an instance of `Topics`.
        at_once: it never waits behind another one.
    """

    name: str
    type: str
    work: Callable[[Any, Any], None]
    at_once: bool = False


class Topics:
    """What the topics do with an arm.

    Args:
        driver: whose arm it is.
        ros: of which ROS the messages are.
    """

    def __init__(self, driver: Driver, ros: Ros) -> None:
        self._driver = driver
        self._ros = ros
        self._lock = threading.Lock()

    def take(self, row: Topic, message: Any) -> None:
        """Do what a message wants.

        Args:
            row: which topic.
            message: of its type.

        Raises:
            HeptarmError: refused; the text says why.
        """
        with contextlib.nullcontext() if row.at_once else self._lock:
            row.work(self, message)

    def _pose(self, message: Any) -> Pose:
        return stamped_pose(message, self._driver.configuration.frame("base"))

    def stop(self, message: Any = None) -> None:
        """Stop whatever runs."""
        self._driver.stop()

    # --------------------------------------------------------------------------------- motions

    def command_joint(self, message: Any) -> None:
        """A motion to the positions of a sensor_msgs/JointState."""
        self._driver.start(ptp(positions(self._driver, message.name, message.position)))

    def command_pose(self, message: Any) -> None:
        """A motion to a geometry_msgs/PoseStamped."""
        self._driver.start(ptp(self._pose(message)))

    def command_lin(self, message: Any) -> None:
        """Likewise on a straight line."""
        self._driver.start(lin(self._pose(message)))

    def joint_trajectory(self, message: Any) -> None:
        """Follow a trajectory_msgs/JointTrajectory; an empty one stops."""
        if not message.points and not message.joint_names:
            self.stop()
            return
        self._driver.accept(trajectory_goal(self._ros, message, now=self._driver.now))

    def their_joint(self, message: Any) -> None:
        """A motion to the positions of a sensor_msgs/JointState as libiiwa takes it."""
        self._driver.start(ptp(joint_target(self._driver, message.name, message.position)))

    def their_pose(self, message: Any) -> None:
        """A motion to a geometry_msgs/Pose as libiiwa takes it."""
        place, turn = message.position, message.orientation
        xyz, quat = (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
        self._driver.start(ptp(pose_target(self._driver, xyz, quat)))

    # ----------------------------------------------------------------------------------- servo

    def servo_joint(self, message: Any) -> None:
        """Follow the positions, and the velocities if there are some, of a sensor_msgs/JointState."""
        target = positions(self._driver, message.name, message.position)
        given = len(message.velocity) > 0
        self._driver.follow(
            target, velocities(self._driver, message.name, message.velocity) if given else None
        )

    def servo_velocity(self, message: Any) -> None:
        """Move at the velocities of a sensor_msgs/JointState."""
        self._driver.follow_velocity(velocities(self._driver, message.name, message.velocity))

    def servo_pose(self, message: Any) -> None:
        """Follow a geometry_msgs/PoseStamped."""
        self._driver.follow(self._pose(message))

    def servo_lin(self, message: Any) -> None:
        """Likewise on straight lines."""
        self._driver.follow(self._pose(message), straight=True)

    # ------------------------------------------------------------------------------------- FRI

    def fri_joint(self, message: Any) -> None:
        """Positions and torques of a sensor_msgs/JointState; joints left out keep their last wish."""
        name, position, effort = message.name, message.position, message.effort
        q = wishes(self._driver, name, position) if len(position) else None
        tau = wishes(self._driver, name, effort) if len(effort) else None
        self._driver.fri.command(q=q, tau=tau)

    def fri_wrench(self, message: Any) -> None:
        """Force and torque of a geometry_msgs/WrenchStamped."""
        f, t = message.wrench.force, message.wrench.torque
        self._driver.fri.command(wrench=np.array([f.x, f.y, f.z, t.x, t.y, t.z]))

    def fri_pose(self, message: Any) -> None:
        """The flange's pose in the base, of a geometry_msgs/PoseStamped."""
        self._driver.fri.command(pose=self._pose(message))


_JOINTS, _POSE = "sensor_msgs/JointState", "geometry_msgs/PoseStamped"
#: All of heptarm's own.
TOPICS = (
    Topic("~/stop", "std_msgs/Empty", Topics.stop, at_once=True),
    Topic("~/command/joint", _JOINTS, Topics.command_joint),
    Topic("~/command/pose", _POSE, Topics.command_pose),
    Topic("~/command/lin", _POSE, Topics.command_lin),
    Topic("~/joint_trajectory", "trajectory_msgs/JointTrajectory", Topics.joint_trajectory),
    Topic("~/servo/joint", _JOINTS, Topics.servo_joint),
    Topic("~/servo/velocity", _JOINTS, Topics.servo_velocity),
    Topic("~/servo/pose", _POSE, Topics.servo_pose),
    Topic("~/servo/lin", _POSE, Topics.servo_lin),
    Topic("~/fri/joint", _JOINTS, Topics.fri_joint),
    Topic("~/fri/wrench", "geometry_msgs/WrenchStamped", Topics.fri_wrench),
    Topic("~/fri/pose", _POSE, Topics.fri_pose),
)
#: What to do under other drivers' names.
_THEIRS: Mapping[Meaning, Callable[[Any, Any], None]] = MappingProxyType(
    {
        Meaning.STOP: Topics.stop,
        Meaning.JOINT: Topics.their_joint,
        Meaning.CARTESIAN: Topics.their_pose,
        Meaning.TRAJECTORY: Topics.joint_trajectory,
    }
)


def topics_of(names: str) -> tuple[Topic, ...]:
    """Heptarm's own, and those under the names that the parameter `names` asks for."""
    return TOPICS + tuple(
        Topic(entry.name, entry.type, _THEIRS[entry.meaning], at_once=entry.meaning is Meaning.STOP)
        for entry in PRESETS[names].entries
        if entry.meaning in _THEIRS
    )
