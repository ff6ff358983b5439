"""Motions as the items of a program, checked against the limits of the connected robot.

A motion and its message have the same name and, mostly, the same fields. `_fields` adds what differs, one function per
motion type; a new motion type whose fields are those of its message needs none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import singledispatch
from math import isinf, nan
from typing import Any

import numpy as np

from heptarm.arm.translate.fields import NAMES, frame_message, hints, message_of
from heptarm.errors import CommandRejected, inside
from heptarm.model.inverse_kinematics import redundancy
from heptarm.values.checks import Array, shown, within
from heptarm.values.frames import BASE
from heptarm.values.motion.circle import Circ
from heptarm.values.motion.dynamics import DynamicMotion, Dynamics
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.line import Lin, LinRel
from heptarm.values.motion.motion import Hold, Motion
from heptarm.values.motion.planned_path import Path
from heptarm.values.motion.ptp import Ptp, PtpPose
from heptarm.values.motion.spline import JointSpline, Segment, Spl, Spline, placed
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.wire import messages as wire


def item(motion: Motion, robot: RobotModel, *, speed: float = 1.0, **terms: Any) -> wire.Item:
    """The item of a motion.

    Args:
        motion: the motion.
        robot: the connected robot.
        speed: no joint is faster than this fraction of its maximum, (0, 1].
        **terms: the other fields of the item, such as mode, until, reaction and triggers.

    Raises:
        LimitError: a target is outside the robot's limits; the text names joint, value and range.
    """
    sent = motion.spline if isinstance(motion, Path) else motion
    message = _message(type(sent).__name__, sent.limited_to(speed), robot)
    terms.setdefault("until", wire.Condition())
    return wire.Item(motion=message, frame=frame_message(getattr(motion, "moving", "")), **terms)


def in_base(motion: Motion, frames: Mapping[str, Pose]) -> Motion:
    """The motion with its poses in the base; messages have no others.

    Args:
        motion: any; an offset keeps its axes, which the cabinet knows.
        frames: taught frames in the base, by name.

    Raises:
        CommandRejected: its frame is no fixed one.
    """
    if not isinstance(motion, PtpPose | Lin | Circ | Spline) or motion.frame == BASE:
        return motion
    name = motion.frame
    if name not in frames:
        listed = ", ".join((BASE, *frames))
        raise CommandRejected(
            f"frame of a target must be one of {listed}, got {shown(name)}",
            code=42,
            parameter="frame",
            value=name,
            allowed=listed,
            hint="the process data heptarm.frames names the taught frames that clients know; for a frame on the arm "
            "use lin_rel(...), or give its present pose: frame=arm.pose(...)",
        )
    return placed(motion, frames[name])


#: Attributes of motions and segments that are poses.
_POSES = ("target", "offset", "via", "end")
#: No arm with its tool reaches as far; nearer poses are left to the cabinet's planner [m].
_FARTHEST = 4.0


def _check_distance(xyz: Array, name: str) -> None:
    """Refuse a position that no arm reaches, and ask whether it was meant in millimetres."""
    for axis, value in zip("xyz", xyz.tolist()):
        within(value, f"{name}.{axis}", -_FARTHEST, _FARTHEST, unit="m")


def _message(name: str, motion: Motion | Segment, robot: RobotModel) -> Any:
    kind = NAMES[name]
    if isinstance(motion, PtpPose | Lin | Circ | Spline):
        motion = in_base(motion, {})  # a message's poses are in the base
    for field in _POSES:
        if (pose := getattr(motion, field, None)) is not None:
            _check_distance(pose.xyz, field)
    given = _fields(motion, robot)
    if isinstance(motion, DynamicMotion | Spl):
        given |= dynamics_fields(kind, motion.dynamics)
    if "redundancy" in hints(kind):
        given |= {"redundancy": _redundancy(motion, robot)}
    return message_of(kind, motion, **given)


def dynamics_fields(kind: type, dynamics: Dynamics) -> dict[str, object]:
    """The fields of a message that carry dynamics: along the path, of the joints, or one field of each kind."""
    messages = (
        wire.CartesianDynamics(
            velocity=dynamics.speed_mps,
            acceleration=dynamics.acceleration_mps2,
            jerk=dynamics.jerk_mps3,
            orientation_velocity=dynamics.speed_radps,
            orientation_acceleration=dynamics.acceleration_radps2,
            orientation_jerk=dynamics.jerk_radps3,
        ),
        wire.JointDynamics(
            velocity=tuple(dynamics.joint_speed.tolist()),
            acceleration=tuple(dynamics.joint_acceleration.tolist()),
            jerk=tuple(dynamics.joint_jerk.tolist()),
        ),
    )
    types = {type(message).__name__: message for message in messages}
    return {name: types[hint] for name, hint in hints(kind).items() if hint in types}


def _redundancy(motion: Any, robot: RobotModel) -> wire.Redundancy:
    """The redundancy of a motion's target: as given, as at the joint positions `near` it, or the current one."""
    if motion.near is not None:
        robot.check(motion.near, "near")
        return replace(message_of(wire.Redundancy, redundancy(robot, motion.near.tolist())), turn=-1)
    if motion.redundancy is not None:
        return message_of(wire.Redundancy, motion.redundancy)
    return wire.Redundancy(e1=nan, status=-1, turn=-1)


# ------------------------------------------------------------- what a motion's message has under other names


@singledispatch
def _fields(motion: object, robot: RobotModel) -> dict[str, Any]:
    """The fields of a motion's message that do not follow from the names of its attributes."""
    return {}


@_fields.register
def _(motion: Ptp, robot: RobotModel) -> dict[str, Any]:
    robot.check(motion.q)
    return {}


@_fields.register
def _(motion: LinRel, robot: RobotModel) -> dict[str, Any]:
    return {"reference": frame_message(motion.frame)}


@_fields.register
def _(motion: Spline, robot: RobotModel) -> dict[str, Any]:
    segments = []
    for index, segment in enumerate(motion.segments):
        with inside(f"segments[{index}]"):
            segments.append(_message(f"{type(segment).__name__}Segment", segment, robot))
    return {"segments": tuple(segments)}


@_fields.register
def _(motion: JointSpline, robot: RobotModel) -> dict[str, Any]:
    for index, point in enumerate(motion.points):
        with inside(f"points[{index}]"):
            robot.check(point.q)
    points = (
        message_of(wire.JointPoint, point, **dynamics_fields(wire.JointPoint, point.dynamics))
        for point in motion.points
    )
    return {"points": tuple(points)}


@_fields.register
def _(motion: Hold, robot: RobotModel) -> dict[str, Any]:
    return {"duration": nan if isinf(motion.duration) else motion.duration}


@_fields.register
def _(motion: HandGuide, robot: RobotModel) -> dict[str, Any]:
    for name in ("q_min", "q_max"):
        limits = getattr(motion, name)
        robot.check(np.where(np.isnan(limits), 0.5 * (robot.q_min + robot.q_max), limits), name)
    return {"freezes_all": motion.at_limit == "all", "pulls_back": motion.outside == "pull"}
