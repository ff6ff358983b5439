"""Motions from the fields of messages, which both ROS call the same; free of ROS.

What is 0 or empty in a message is not given, and keeps the cabinet's default.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

from heptarm.bridge.driver import Driver
from heptarm.bridge.events import with_triggers
from heptarm.bridge.order import positions
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.arrays import Array
from heptarm.values.circ import circ
from heptarm.values.guiding import hand_guide
from heptarm.values.lines import LinRel, lin, lin_rel
from heptarm.values.motion import TOOL, Motion, hold, ptp, ptp_home
from heptarm.values.pose import Pose
from heptarm.values.redundancy import Redundancy
from heptarm.values.spline import Segment, spl, spline, spline_joints

#: Kinds of motions, as heptarm_msgs/Motion numbers them; heptarm_msgs/MovePose has the first four.
PTP, LIN, CIRC, LIN_REL, SPLINE, JOINT_SPLINE, HOLD, HOME, GUIDE = range(9)
#: Kinds of a spline's segments, as heptarm_msgs/Segment numbers them.
_SPL, _LIN, _CIRC = range(3)
_PATH = (
    "speed_mps",
    "acceleration_mps2",
    "jerk_mps3",
    "speed_radps",
    "acceleration_radps2",
    "jerk_radps3",
)
_BLENDING = ("blend_rel", "blend_m", "blend_rad")
_JOINTS = ("joint_speed", "joint_acceleration", "joint_jerk")


def pose_of(message: Any) -> Pose:
    """The value of a geometry_msgs/Pose; a quaternion of nothing but 0 is no rotation.

    Raises:
        ShapeError: numbers that are no pose.
    """
    place, turn = message.position, message.orientation
    quat = (turn.x, turn.y, turn.z, turn.w)
    return Pose.of((place.x, place.y, place.z), quat if any(quat) else (0.0, 0.0, 0.0, 1.0))


def stamped_pose(message: Any, base: str) -> Pose:
    """The value of a geometry_msgs/PoseStamped in the base.

    Args:
        message: the message.
        base: name of the base's frame.

    Raises:
        ShapeError: it is given in another frame, or its quaternion is none.
    """
    frame = message.header.frame_id.lstrip("/")
    if frame not in ("", base):
        raise ShapeError(f"the pose is given in {frame!r}", hint=f"give it in {base!r}")
    place, turn = message.pose.position, message.pose.orientation
    return Pose.of([place.x, place.y, place.z], [turn.x, turn.y, turn.z, turn.w])


def joint_points(driver: Driver, names: Sequence[str], values: Sequence[float]) -> list[Array]:
    """Joint positions one after the other, each of shape (7,) [rad]; joints left out stay where they are.

    Raises:
        ShapeError: not as many numbers as a multiple of the names.
    """
    width = len(names) or 7
    if not values or len(values) % width:
        raise ShapeError(
            f"position has {len(values)} numbers; {width} for each point are wanted", parameter="position"
        )
    rows = range(0, len(values), width)
    return [positions(driver, names, list(values)[start : start + width]) for start in rows]


def program_of(driver: Driver, messages: Sequence[Any]) -> tuple[Motion, ...]:
    """The motions of several heptarm_msgs/Motion.

    Raises:
        HeptarmError: one of them is none; the text says which.
    """
    if not messages:
        raise ShapeError("the program has no motions", parameter="motions")
    return tuple(
        with_triggers(motion_of(driver, one, f"motions[{index}]"), one.triggers)
        for index, one in enumerate(messages)
    )


def motion_of(driver: Driver, message: Any, name: str = "motion") -> Motion:
    """The value of a heptarm_msgs/Motion.

    Args:
        driver: whose arm it is.
        message: the message.
        name: what to call it in errors.

    Raises:
        CommandRejected: it is none, or a number is outside its range.
    """
    kind = message.kind
    joints: dict[str, Any] = {key: _joints(getattr(message, key)) for key in _JOINTS if len(getattr(message, key))}
    plain = {key.removeprefix("joint_"): value for key, value in joints.items()}
    blending = _given(message, _BLENDING)
    if kind == HOLD:
        return hold(message.duration or inf)
    if kind == HOME:
        return ptp_home(**plain, **blending)
    if kind == GUIDE:
        return guiding(message)
    if kind == JOINT_SPLINE:
        return spline_joints(joint_points(driver, message.joint_names, message.position), **plain)
    if kind == PTP and len(message.position):
        return ptp(positions(driver, message.joint_names, message.position), **plain, **blending)
    moving = message.moving or TOOL
    if kind == SPLINE:
        segments = [segment_of(one) for one in message.segments]
        return spline(segments, moving=moving, **_given(message, _PATH), **joints)
    near: dict[str, Any] = {"near": list(message.near)} if len(message.near) else {}
    if len(message.redundancy):
        near["redundancy"] = _redundancy(message.redundancy)
    if kind == PTP:
        target = _pose(driver, message.pose)
        return ptp(target, moving=moving, **near, **plain, **blending)
    how: dict[str, Any] = {**_given(message, _PATH), **joints, **blending, "moving": moving}
    if message.orientation:
        how["orientation"] = message.orientation
    if kind == LIN:
        return lin(_pose(driver, message.pose), **near, **how)
    if kind == CIRC:
        return circ(pose_of(message.via), _pose(driver, message.pose), **near, **how)
    if kind == LIN_REL:
        return offset(message.pose, how)
    raise CommandRejected(f"{name} is of kind {kind}; 0 to {GUIDE} are known", parameter="kind", value=kind)


def offset(message: Any, how: dict[str, Any] | None = None) -> LinRel:
    """A line by an offset, a geometry_msgs/PoseStamped whose frame says whose axes: "tool", "base", or a frame.

    Args:
        message: the offset.
        how: further arguments of `heptarm.lin_rel`.
    """
    shift = pose_of(message.pose)
    x, y, z = shift.xyz.tolist()
    return lin_rel(x, y, z, *shift.abc.tolist(), frame=message.header.frame_id or TOOL, **(how or {}))


def segment_of(message: Any) -> Segment:
    """The value of a heptarm_msgs/Segment.

    Raises:
        CommandRejected: it is none.
    """
    how: dict[str, Any] = _given(message, _PATH[:3])
    if message.orientation:
        how["orientation"] = message.orientation
    pose = pose_of(message.pose)
    if message.kind == _SPL:
        return spl(pose, **how)
    if message.kind == _LIN:
        return lin(pose, **how)
    if message.kind == _CIRC:
        return circ(pose_of(message.via), pose, **how)
    raise CommandRejected(
        f"a segment is of kind {message.kind}; 0 (SPL), 1 (LIN) or 2 (CIRC) is wanted",
        parameter="kind",
        value=message.kind,
    )


def _pose(driver: Driver, message: Any) -> Pose:
    return stamped_pose(message, driver.configuration.frame("base"))


def guiding(message: Any) -> Motion:
    """Guiding by hand, of a message with the limits of it: heptarm_msgs/Motion, a goal of Guide or Teach."""
    limits = {name: list(getattr(message, name)) for name in ("q_min", "q_max") if len(getattr(message, name))}
    words = {name: getattr(message, name) for name in ("at_limit", "outside") if getattr(message, name)}
    how: dict[str, Any] = limits | words
    return hand_guide(**how, **_given(message, ("joint_velocity", "cartesian_velocity")))


def _redundancy(values: Sequence[float]) -> Redundancy:
    if len(values) > 3:
        raise ShapeError(
            f"redundancy has {len(values)} numbers; E1, Status and Turn are wanted", parameter="redundancy"
        )
    return Redundancy(float(values[0]), *(round(value) for value in values[1:]))


def _joints(values: Sequence[float]) -> float | list[float]:
    given = [float(value) for value in values]
    return given[0] if len(given) == 1 else given


def _given(message: Any, names: Sequence[str]) -> dict[str, Any]:
    """Those that are not 0."""
    return {name: getattr(message, name) for name in names if getattr(message, name)}
