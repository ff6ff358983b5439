"""The topics that both nodes subscribe to: handlers, and `TOPICS`, the table of them.

A new topic is a function and a row of the table. Which rows a node subscribes to: `heptarm.ros.interface.offered`.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import is_installed, trajectory_goal
from heptarm.ros.interface.motions import (
    partial_joints,
    positions,
    stamped_pose,
    target_of,
    velocities,
)
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.planning import scene
from heptarm.ros.trajectory.send_times import PublishInfo
from heptarm.values.checks import Array, array
from heptarm.values.motion.line import lin
from heptarm.values.motion.ptp import ptp

#: Frames of a twist.
_FRAMES: tuple[Literal["base", "flange", "tool"], ...] = ("base", "flange", "tool")
#: Handles a message of a topic; that of one that is `counted` takes when or as which the message was published as well.
Handler = Callable[..., None]


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the nodes subscribe to.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type".
        handler: handles a message; raises HeptarmError to refuse it.
        at_once: never waits for another topic.
        counted: its handler takes a `PublishInfo` after the message.
        depth: most messages that wait; further ones replace the oldest.
        aside: its messages are handled in order, but neither wait for those of another topic nor let these wait.
        is_sensor: sensors publish it, in ROS 2 mostly without a guarantee that each message arrives.
        is_latched: the last messages of its publishers from before the subscription arrive, too.
    """

    name: str
    type: str
    handler: Handler
    at_once: bool = False
    counted: bool = False
    depth: int = 1
    aside: bool = False
    is_sensor: bool = False
    is_latched: bool = False


class TopicDispatcher:
    """Calls the handlers of topics, one at a time unless a topic is `at_once` or `aside`.

    Args:
        context: of the node.
    """

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._lock = threading.Lock()

    def handle(self, topic: Topic, message: Any, sent: PublishInfo) -> None:
        """Handle a message.

        Args:
            topic: its row.
            message: of its type.
            sent: when or as which it was published.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        with contextlib.nullcontext() if topic.at_once or topic.aside else self._lock:
            if topic.counted:
                topic.handler(self._context, message, sent)
            else:
                topic.handler(self._context, message)


def stop(context: NodeContext, message: Any) -> None:
    """Stop the arm on its path."""
    context.driver.stop()


# --------------------------------------------------------------------------------- motions


def command_joint(context: NodeContext, message: Any) -> None:
    """Move to the positions of a sensor_msgs/JointState."""
    context.driver.start(ptp(positions(context.driver, message.name, message.position)))


def command_pose(context: NodeContext, message: Any) -> None:
    """Move to a geometry_msgs/PoseStamped."""
    context.driver.start(ptp(target_of(message, context.driver)))


def command_lin(context: NodeContext, message: Any) -> None:
    """Move on a straight line to a geometry_msgs/PoseStamped."""
    context.driver.start(lin(target_of(message, context.driver)))


def joint_trajectory(context: NodeContext, message: Any, sent: PublishInfo) -> None:
    """Execute a trajectory_msgs/JointTrajectory, or follow a stream; in ROS 1 one without points stops the arm."""
    if not message.points and context.ros.empty_stops:
        context.driver.end_trajectory()
        return
    goal = trajectory_goal(context.ros, message, now=lambda: context.driver.now)
    context.driver.accept(replace(goal, from_topic=True, sent=sent))


# ----------------------------------------------------------------------------------- servo


def servo_joint(context: NodeContext, message: Any) -> None:
    """Follow the positions, and the velocities if there are any, of a sensor_msgs/JointState."""
    target = positions(context.driver, message.name, message.position)
    speed = velocities(context.driver, message.name, message.velocity) if len(message.velocity) else None
    context.driver.follow(target, speed)


def servo_velocity(context: NodeContext, message: Any) -> None:
    """Move with the velocities of a sensor_msgs/JointState."""
    context.driver.follow_velocity(velocities(context.driver, message.name, message.velocity))


def servo_pose(context: NodeContext, message: Any) -> None:
    """Follow a geometry_msgs/PoseStamped."""
    context.driver.follow(stamped_pose(message, context.driver))


def servo_lin(context: NodeContext, message: Any) -> None:
    """Follow a geometry_msgs/PoseStamped on straight lines."""
    context.driver.follow(stamped_pose(message, context.driver), straight=True)


def servo_twist(context: NodeContext, message: Any) -> None:
    """Move with a geometry_msgs/TwistStamped, in axes of the base, the flange or the tool."""
    name = message.header.frame_id.lstrip("/")
    frames = {context.driver.configuration.frame(frame): frame for frame in _FRAMES}
    if name and name not in frames:
        raise CommandRejected(
            f"frame_id must be one of {', '.join(frames)}, got {name!r}", parameter="frame_id", value=name
        )
    context.driver.follow_twist(_twist(message.twist), frames.get(name, "base"))


def servo_twist_unstamped(context: NodeContext, message: Any) -> None:
    """Move with a geometry_msgs/Twist, in axes of the base."""
    context.driver.follow_twist(_twist(message))


def _twist(message: Any) -> Array:
    v, w = message.linear, message.angular
    return np.array([v.x, v.y, v.z, w.x, w.y, w.z])


def servo_jog(context: NodeContext, message: Any) -> None:
    """Move with the velocities of a control_msgs/JointJog; joints that are not named rest."""
    if not len(message.velocities):
        raise ShapeError(
            "a JointJog must have velocities; displacements are not supported",
            parameter="velocities",
            hint="send positions to servo/joint",
        )
    context.driver.follow_velocity(velocities(context.driver, message.joint_names, message.velocities))


def tf(context: NodeContext, message: Any) -> None:
    """Take the frames of a tf2_msgs/TFMessage."""
    if context.driver.transforms is not None:
        context.driver.transforms.add(message)


def tf_static(context: NodeContext, message: Any) -> None:
    """Take the frames of a tf2_msgs/TFMessage that do not move."""
    if context.driver.transforms is not None:
        context.driver.transforms.add(message, is_static=True)


# --------------------------------------------------------------------- controllers of ros2_control


def forward_position(context: NodeContext, message: Any, sent: PublishInfo) -> None:
    """Follow seven positions [rad], a std_msgs/Float64MultiArray as for position_controllers."""
    context.driver.follow_stream(_seven(message, "rad"), sent)


def forward_velocity(context: NodeContext, message: Any) -> None:
    """Move with seven velocities [rad/s], a std_msgs/Float64MultiArray as for velocity_controllers."""
    context.driver.follow_velocity(_seven(message, "rad/s"))


def _seven(message: Any, unit: str) -> Array:
    return array(list(message.data), 7, f"data [{unit}]")


# ------------------------------------------------------------------------------------- FRI


def lbr_position(context: NodeContext, message: Any, sent: PublishInfo) -> None:
    """Follow the positions of a lbr_fri_idl/LBRJointPositionCommand: by the open FRI session, if there is one."""
    q = array(list(message.joint_position), 7, "joint_position [rad]")
    if context.driver.fri.active:
        context.driver.fri.command(q=q)
    else:
        context.driver.follow_stream(q, sent)


def lbr_torque(context: NodeContext, message: Any) -> None:
    """Command the positions and torques of a lbr_fri_idl/LBRTorqueCommand to the open FRI session."""
    q, tau = (
        array(list(values), 7, name)
        for values, name in (
            (message.joint_position, "joint_position [rad]"),
            (message.torque, "torque [Nm]"),
        )
    )
    context.driver.fri.command(q=q, tau=tau)


def lbr_wrench(context: NodeContext, message: Any) -> None:
    """Command the positions and the wrench of a lbr_fri_idl/LBRWrenchCommand to the open FRI session."""
    q = array(list(message.joint_position), 7, "joint_position [rad]")
    context.driver.fri.command(q=q, wrench=array(list(message.wrench), 6, "wrench [N, Nm]"))


def fri_joint(context: NodeContext, message: Any) -> None:
    """Command positions and torques of a sensor_msgs/JointState; missing joints keep their last command."""
    q, tau = (
        partial_joints(context.driver, message.name, values) if len(values) else None
        for values in (message.position, message.effort)
    )
    context.driver.fri.command(q=q, tau=tau)


def fri_wrench(context: NodeContext, message: Any) -> None:
    """Command force and torque of a geometry_msgs/WrenchStamped."""
    f, t = message.wrench.force, message.wrench.torque
    context.driver.fri.command(wrench=np.array([f.x, f.y, f.z, t.x, t.y, t.z]))


def fri_pose(context: NodeContext, message: Any) -> None:
    """Command the pose of the flange in the base by a geometry_msgs/PoseStamped."""
    context.driver.fri.command(pose=stamped_pose(message, context.driver))


def camera_image(context: NodeContext, message: Any) -> None:
    """Keep the newest sensor_msgs/Image of the camera that the action `calibrate` measures."""
    context.images.put(message)


_JOINTS, _POSE = "sensor_msgs/JointState", "geometry_msgs/PoseStamped"
_SCENE = "moveit_msgs/PlanningScene"
_FORWARD_POSITION, _FORWARD_VELOCITY = (
    "forward_position_controller/commands",
    "forward_velocity_controller/commands",
)

#: Of the frames of others, with the parameter `tf_frames`.
_TF = (
    Topic("/tf", "tf2_msgs/TFMessage", tf, depth=100, aside=True),
    Topic("/tf_static", "tf2_msgs/TFMessage", tf_static, depth=100, aside=True, is_latched=True),
)
#: All topics with heptarm's own names.
TOPICS = (
    Topic("~/stop", "std_msgs/Empty", stop, at_once=True),
    Topic("~/command/joint", _JOINTS, command_joint),
    Topic("~/command/pose", _POSE, command_pose),
    Topic("~/command/lin", _POSE, command_lin),
    Topic("~/joint_trajectory", "trajectory_msgs/JointTrajectory", joint_trajectory, counted=True),
    Topic("~/servo/joint", _JOINTS, servo_joint),
    Topic("~/servo/velocity", _JOINTS, servo_velocity),
    Topic("~/servo/pose", _POSE, servo_pose),
    Topic("~/servo/lin", _POSE, servo_lin),
    Topic("~/servo/twist", "geometry_msgs/TwistStamped", servo_twist),
    Topic("~/servo/twist_unstamped", "geometry_msgs/Twist", servo_twist_unstamped),
    Topic("~/servo/jog", "control_msgs/JointJog", servo_jog),
    Topic(_FORWARD_POSITION, "std_msgs/Float64MultiArray", forward_position, counted=True),
    Topic(_FORWARD_VELOCITY, "std_msgs/Float64MultiArray", forward_velocity),
    Topic("~/fri/joint", _JOINTS, fri_joint),
    Topic("~/fri/wrench", "geometry_msgs/WrenchStamped", fri_wrench),
    Topic("~/fri/pose", _POSE, fri_pose),
    Topic("~/points", "sensor_msgs/PointCloud2", scene.points, aside=True, is_sensor=True),
    Topic("~/image", "sensor_msgs/Image", camera_image, aside=True, is_sensor=True),
    Topic("planning_scene", _SCENE, scene.planning_scene, depth=100, aside=True),
    Topic("collision_object", "moveit_msgs/CollisionObject", scene.collision_object, depth=100, aside=True),
    Topic(
        "attached_collision_object",
        "moveit_msgs/AttachedCollisionObject",
        scene.attached_collision_object,
        depth=100,
        aside=True,
    ),
)
#: Handlers of topics with the names of other drivers.
_PRESET_HANDLERS: Mapping[NameRole, Handler] = MappingProxyType(
    {
        NameRole.STOP: stop,
        NameRole.TRAJECTORY: joint_trajectory,
        NameRole.FORWARD: forward_position,
        NameRole.LBR_POSITION: lbr_position,
        NameRole.LBR_TORQUE: lbr_torque,
        NameRole.LBR_WRENCH: lbr_wrench,
    }
)

#: Those whose handlers count the messages of their publisher.
_COUNTED = (NameRole.TRAJECTORY, NameRole.FORWARD, NameRole.LBR_POSITION)


def topics_of(values: Mapping[str, Any]) -> tuple[Topic, ...]:
    """List the topics that a node subscribes to.

    Args:
        values: of the node's parameters: `names` and `tf_frames` add some, `forward_controllers` leaves some out.
            Without the package moveit_msgs those of the world are left out, too.
    """
    forward = values["forward_controllers"]
    left_out: tuple[str, ...] = () if forward else (_FORWARD_POSITION, _FORWARD_VELOCITY)
    if not is_installed(_SCENE):
        left_out += ("planning_scene", "collision_object", "attached_collision_object")
    ours = tuple(row for row in TOPICS if row.name not in left_out) + (_TF if values["tf_frames"] else ())
    return ours + tuple(
        Topic(
            entry.name,
            entry.type,
            _PRESET_HANDLERS[entry.role],
            at_once=entry.role is NameRole.STOP,
            counted=entry.role in _COUNTED,
        )
        for entry in PRESETS[values["names"]].entries
        if entry.role in _PRESET_HANDLERS and entry.is_available
    )
