"""Messages of either ROS to values of heptarm and back: their types differ, their fields do not.

A node says once what it has, and its modules only publish and subscribe::

    ros = Ros(joint_state=JointState, ..., seconds=seconds, duration=duration)
    message = feedback(ros, value, names)
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from heptarm.bridge.goal import Goal, Point, Tolerance
from heptarm.bridge.report import Report
from heptarm.bridge.runner import Feedback
from heptarm.bridge.trajectory import Sample
from heptarm.values.pose import Pose
from heptarm.values.state import State

#: Fields of a goal that only ROS 2 has, and that no server of an arm's joints can follow.
_EXTRAS = ("component_path_tolerance", "component_goal_tolerance")


@dataclass(frozen=True, slots=True, kw_only=True)
class Ros:
    """What differs between ROS 1 and ROS 2, and between versions.

    Attributes:
        joint_state: type sensor_msgs/JointState.
        point: type trajectory_msgs/JointTrajectoryPoint.
        feedback: type of the feedback of control_msgs/FollowJointTrajectory.
        pose: type geometry_msgs/Pose.
        wrench: type geometry_msgs/Wrench.
        diagnostic: type diagnostic_msgs/DiagnosticStatus.
        key_value: type diagnostic_msgs/KeyValue.
        now: ROS' clock [ns].
        time: a time of a message, of [ns].
        seconds: a time or a duration of a message [s].
        duration: a duration of a message, of [s].
        level: a level of diagnostics as its message has it.
    """

    joint_state: Any
    point: Any
    feedback: Any
    pose: Any
    wrench: Any
    diagnostic: Any
    key_value: Any
    now: Callable[[], int]
    time: Callable[[int], Any]
    seconds: Callable[[Any], float]
    duration: Callable[[float], Any]
    level: Callable[[int], Any]


def class_of(kind: str, part: Literal["msg", "srv", "action"]) -> Any:
    """The class that ROS' generators made of a "package/Type".

    Args:
        kind: the type.
        part: in which module of the package it is.
    """
    package, _, name = kind.partition("/")
    return getattr(importlib.import_module(f"{package}.{part}"), name)


def put(message: Any, fields: Mapping[str, Any]) -> None:
    """Give fields of a message values; those of a message in it are a mapping."""
    for name, value in fields.items():
        if isinstance(value, Mapping):
            put(getattr(message, name), value)
        else:
            setattr(message, name, value)


# -------------------------------------------------------------------------------------- trajectories


def trajectory_goal(ros: Ros, message: Any, *, now: float) -> Goal:
    """A trajectory without tolerances.

    Args:
        ros: whose message it is.
        message: trajectory_msgs/JointTrajectory.
        now: the time on the runner's clock [s].
    """
    stamp = ros.seconds(message.header.stamp)
    return Goal(
        joints=tuple(message.joint_names),
        points=tuple(
            Point(
                ros.seconds(point.time_from_start),
                tuple(point.positions),
                tuple(point.velocities),
                tuple(point.accelerations),
                tuple(point.effort),
            )
            for point in message.points
        ),
        start=None if stamp == 0.0 else now + (stamp - 1e-9 * ros.now()),
    )


def action_goal(ros: Ros, message: Any, *, now: float) -> Goal:
    """A goal of control_msgs/FollowJointTrajectory; see `trajectory_goal`."""
    plain = trajectory_goal(ros, message.trajectory, now=now)
    several = getattr(message, "multi_dof_trajectory", None)
    extras = ["multi_dof_trajectory"] if several and (several.joint_names or several.points) else []
    extras += [name for name in _EXTRAS if getattr(message, name, None)]
    return Goal(
        plain.joints,
        plain.points,
        plain.start,
        _tolerances(message.path_tolerance),
        _tolerances(message.goal_tolerance),
        ros.seconds(message.goal_time_tolerance),
        tuple(extras),
    )


def _tolerances(messages: Sequence[Any]) -> tuple[Tolerance, ...]:
    return tuple(Tolerance(one.name, one.position, one.velocity, one.acceleration) for one in messages)


def feedback(ros: Ros, value: Feedback, names: Sequence[str]) -> Any:
    """Feedback of control_msgs/FollowJointTrajectory."""
    message = ros.feedback()
    message.header.stamp = ros.time(ros.now())
    message.joint_names = list(names)
    message.desired = _point(ros, value.desired, value.time)
    message.actual = _point(ros, value.actual, value.elapsed)
    message.error = ros.point(
        positions=(value.desired.q - value.actual.q).tolist(),
        velocities=(value.desired.dq - value.actual.dq).tolist(),
        time_from_start=ros.duration(value.time - value.elapsed),
    )
    if hasattr(message, "index"):  # since control_msgs 6.3
        message.index = value.index
    return message


def _point(ros: Ros, sample: Sample, time: float) -> Any:
    return ros.point(
        positions=sample.q.tolist(),
        velocities=np.nan_to_num(sample.dq).tolist(),
        accelerations=sample.ddq.tolist(),
        time_from_start=ros.duration(time),
    )


# -------------------------------------------------------------------------------------------- states


def joint_state(ros: Ros, state: State, names: Sequence[str], *, external: bool = False) -> Any:
    """Measured positions, velocities and torques, or the external torques in place of these."""
    message = ros.joint_state(
        name=list(names), position=state.q.tolist(), velocity=np.nan_to_num(state.dq).tolist()
    )
    if state.torques is not None:
        message.effort = (state.tau_ext if external else state.tau).tolist()
    return message


def pose_message(ros: Ros, pose: Pose) -> Any:
    """A pose."""
    message = ros.pose()
    place, turn = message.position, message.orientation
    place.x, place.y, place.z = pose.xyz.tolist()
    turn.x, turn.y, turn.z, turn.w = pose.quat.tolist()
    return message


def wrench_message(ros: Ros, state: State) -> Any:
    """Force and torque acting on the robot at the flange, in base axes."""
    message = ros.wrench()
    f, t = message.force, message.torque
    f.x, f.y, f.z = state.wrench.force.tolist()
    t.x, t.y, t.z = state.wrench.torque.tolist()
    return message


def diagnostic(ros: Ros, value: Report, *, name: str, hardware: str) -> Any:
    """A diagnostic status."""
    return ros.diagnostic(
        level=ros.level(value.level),
        name=name,
        message=value.text,
        hardware_id=hardware,
        values=[ros.key_value(key=key, value=text) for key, text in value.values.items()],
    )
