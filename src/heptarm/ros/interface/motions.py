"""Converts message fields, which are named alike in both ROS, to motions, poses and joints in the arm's order."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isnan, nan
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.ros.interface.events import with_triggers
from heptarm.ros.node.driver import Driver
from heptarm.values.checks import Array, finite_entries
from heptarm.values.frames import FLANGE, TOOL
from heptarm.values.motion.circle import circ
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.line import LinRel, lin, lin_rel
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp, ptp_home
from heptarm.values.motion.spline import Segment, spl, spline, spline_joints
from heptarm.values.pose import PartialPose, Pose, Redundancy


def positions(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Put joint positions into the arm's order, shape (7,) [rad]; missing joints keep their positions.

    Args:
        driver: of the arm.
        names: of the joints, in any order; empty: all, in the arm's order.
        values: positions [rad].

    Raises:
        ShapeError: an unknown name, a name twice, or not as many numbers as names.
        LimitError: a number is not finite.
    """
    return finite_entries(_ordered(driver, names, values, driver.arm.state.q_cmd), "position")


def partial_joints(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Put values of joints into the arm's order, shape (7,); those of missing joints are NaN."""
    return _ordered(driver, names, values, np.full(7, np.nan))


def velocities(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Put joint velocities into the arm's order, shape (7,) [rad/s]; those of missing joints are 0."""
    return _ordered(driver, names, values, np.zeros(7))


def _ordered(driver: Driver, names: Sequence[str], values: Sequence[float], others: Array) -> Array:
    joints = driver.configuration.joints
    order = list(driver.configuration.own(names) or joints)
    if len(order) != len(values) or len(set(order)) != len(order):
        raise ShapeError(
            f"each of the joints {order} must have one number and appear once, got {len(values)} numbers"
        )
    result = others.copy()
    for name, value in zip(order, values):
        if name not in joints:
            raise ShapeError(f"unknown joint {name!r}", hint=f"the joints are {', '.join(joints)}")
        result[joints.index(name)] = value
    return result


def joint_target(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Convert joint positions of libiiwa, shape (7,) [rad]: NaN keeps the position of a joint.

    Args:
        driver: of the arm.
        names: of the joints, in any order; empty: all, in the arm's order.
        values: positions [rad].

    Raises:
        ShapeError: an unknown name, a name twice, or not as many numbers as names.
    """
    here = driver.arm.state.q_cmd
    target = _ordered(driver, names, values, here)
    return np.where(np.isnan(target), here, target)


def pose_target(driver: Driver, xyz: Sequence[float], quat: Sequence[float]) -> Pose:
    """Convert a pose of libiiwa: NaN keeps a coordinate; all NaN or all 0 keeps the orientation.

    Args:
        driver: of the arm.
        xyz: position of the flange in the base, shape (3,) [m].
        quat: orientation x, y, z, w.

    Raises:
        ShapeError: some numbers of the quaternion are NaN and others are not, or it is not a rotation.
    """
    here = driver.arm.state.pose_cmd
    place = np.where(np.isnan(xyz), here.xyz, xyz)
    turn = np.asarray(quat, dtype=np.float64)
    if np.isnan(turn).all() or not turn.any():
        return Pose.of(place, here.quat)
    if np.isnan(turn).any():
        raise ShapeError(
            f"orientation must be four numbers, got {turn.tolist()}", hint="all NaN keeps the orientation"
        )
    return Pose.of(place, turn)


#: Kinds of motions in heptarm_msgs/Motion; heptarm_msgs/MovePose has the first four.
PTP, LIN, CIRC, LIN_REL, SPLINE, JOINT_SPLINE, HOLD, HOME, GUIDE = range(9)
#: Kinds of spline segments in heptarm_msgs/Segment.
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
    """Convert a geometry_msgs/Pose; a zero quaternion is the identity.

    Raises:
        ShapeError: not a pose.
    """
    place, turn = message.position, message.orientation
    quat = (turn.x, turn.y, turn.z, turn.w)
    return Pose.of((place.x, place.y, place.z), quat if any(quat) else (0.0, 0.0, 0.0, 1.0))


def stamped_pose(message: Any, driver: Driver) -> Pose:
    """Convert a geometry_msgs/PoseStamped to a pose in the base.

    Args:
        message: the message; in the base, in a taught frame of the project, or in one of /tf.
        driver: of the arm.

    Raises:
        NotReady: its frame is not known on /tf at its time.
        ShapeError: it is in another frame, or its quaternion is not a rotation.
    """
    place, turn = message.pose.position, message.pose.orientation
    pose = Pose.of([place.x, place.y, place.z], [turn.x, turn.y, turn.z, turn.w])
    frame = frame_in_base(message.header, driver)
    return pose if frame is None else frame @ pose


def target_of(message: Any, driver: Driver) -> Pose | PartialPose:
    """Convert a geometry_msgs/PoseStamped to the target of a PTP or a LIN.

    A NaN keeps a coordinate of the position where the motion begins, four NaN keep the orientation.

    Args:
        message: the message; in the base, in a taught frame of the project, or in one of /tf.
        driver: of the arm.

    Raises:
        NotReady: its frame is not known on /tf at its time.
        ShapeError: it is in another frame, or its quaternion is not a rotation.
    """
    place, turn = message.pose.position, message.pose.orientation
    xyz, quat = (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
    is_turn_kept = all(map(isnan, quat))
    if not is_turn_kept and not any(map(isnan, xyz)):
        return stamped_pose(message, driver)
    target = PartialPose(*xyz, *((nan,) * 3 if is_turn_kept else Pose.of((0, 0, 0), quat).abc.tolist()))
    frame = frame_in_base(message.header, driver)
    return target if frame is None else target.placed(frame)


def frame_in_base(header: Any, driver: Driver) -> Pose | None:
    """Pose in the base of the frame that a header names; None: it is the base itself.

    Raises:
        NotReady: not known on /tf at the time of the header.
        ShapeError: neither the base nor a taught frame, and /tf is not listened to.
    """
    name = header.frame_id.lstrip("/")
    base = driver.configuration.frame("base")
    if name in ("", base):
        return None
    taught = {name.lstrip("/"): pose for name, pose in driver.arm.frames.items()}
    if name not in taught and driver.transforms is not None:
        flange, tool = (one.lstrip("/") for one in driver.configuration.links)
        own = {flange: driver.arm.pose(FLANGE), tool: driver.arm.state.pose}
        return driver.transforms.find(name, base=base.lstrip("/"), stamp=header.stamp, own=own)
    if name not in taught:
        raise ShapeError(
            f"frame of the pose must be one of {', '.join((base, *driver.arm.frames))}, got {name!r}",
            parameter="frame_id",
            value=name,
            hint="set the parameter tf_frames to look it up on /tf",
        )
    return taught[name]


def joint_points(driver: Driver, names: Sequence[str], values: Sequence[float]) -> list[Array]:
    """Split consecutive joint positions, each of shape (7,) [rad]; missing joints keep their positions.

    Raises:
        ShapeError: the count of numbers is not a multiple of the count of joints.
    """
    width = len(names) or 7
    if not values or len(values) % width:
        raise ShapeError(
            f"position must have {width} numbers for each point, got {len(values)}", parameter="position"
        )
    rows = range(0, len(values), width)
    return [positions(driver, names, list(values)[start : start + width]) for start in rows]


def program_of(driver: Driver, messages: Sequence[Any]) -> tuple[Motion, ...]:
    """Convert several heptarm_msgs/Motion.

    Raises:
        HeptarmError: one of them is invalid; the text names it.
    """
    if not messages:
        raise ShapeError("a program must have motions, got no motions", parameter="motions")
    return tuple(
        with_triggers(motion_of(driver, message, f"motions[{index}]"), message.triggers)
        for index, message in enumerate(messages)
    )


def motion_of(driver: Driver, message: Any, name: str = "motion") -> Motion:
    """Convert a heptarm_msgs/Motion.

    Args:
        driver: of the arm.
        message: the message.
        name: its name in errors.

    Raises:
        CommandRejected: unknown kind, or a number out of range.
    """
    kind = message.kind
    joints: dict[str, Any] = {
        key: _joints(getattr(message, key)) for key in _JOINTS if len(getattr(message, key))
    }
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
        segments = [segment_of(segment) for segment in message.segments]
        return spline(segments, moving=moving, **_given(message, _PATH), **joints)
    near: dict[str, Any] = {"near": list(message.near)} if len(message.near) else {}
    if len(message.redundancy):
        near["redundancy"] = _redundancy(message.redundancy)
    if kind == PTP:
        return ptp(target_of(message.pose, driver), moving=moving, **near, **plain, **blending)
    how: dict[str, Any] = {**_given(message, _PATH), **joints, **blending, "moving": moving}
    if message.orientation:
        how["orientation"] = message.orientation
    if kind == LIN:
        return lin(target_of(message.pose, driver), **near, **how)
    if kind == CIRC:
        via, frame = pose_of(message.via), frame_in_base(message.pose.header, driver)
        return circ(via if frame is None else frame @ via, stamped_pose(message.pose, driver), **near, **how)
    if kind == LIN_REL:
        return offset(message.pose, how)
    raise CommandRejected(f"kind of {name} must be 0 to {GUIDE}, got {kind}", parameter="kind", value=kind)


def offset(message: Any, how: dict[str, Any] | None = None) -> LinRel:
    """Make a line by an offset: a geometry_msgs/PoseStamped whose frame gives the axes, "tool", "base" or a frame.

    Args:
        message: the offset.
        how: further arguments of `heptarm.lin_rel`.
    """
    shift = pose_of(message.pose)
    x, y, z = shift.xyz.tolist()
    return lin_rel(x, y, z, *shift.abc.tolist(), frame=message.header.frame_id or TOOL, **(how or {}))


def segment_of(message: Any) -> Segment:
    """Convert a heptarm_msgs/Segment.

    Raises:
        CommandRejected: unknown kind, or a number out of range.
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
        f"kind of a segment must be 0 (SPL), 1 (LIN) or 2 (CIRC), got {message.kind}",
        parameter="kind",
        value=message.kind,
    )


def guiding(message: Any) -> Motion:
    """Make a hand guiding motion of a heptarm_msgs/Motion, or of a goal of Guide or Teach."""
    limits = {
        name: list(getattr(message, name)) for name in ("q_min", "q_max") if len(getattr(message, name))
    }
    options = {name: getattr(message, name) for name in ("at_limit", "outside") if getattr(message, name)}
    how: dict[str, Any] = limits | options
    return hand_guide(**how, **_given(message, ("joint_velocity", "cartesian_velocity")))


def _redundancy(values: Sequence[float]) -> Redundancy:
    if len(values) > 3:
        raise ShapeError(
            f"redundancy must have E1, Status and Turn, got {len(values)} numbers", parameter="redundancy"
        )
    e1, *bits = finite_entries(np.array(values, dtype=np.float64), "redundancy").tolist()
    return Redundancy(e1, *map(round, bits))


def _joints(values: Sequence[float]) -> float | list[float]:
    given = [float(value) for value in values]
    return given[0] if len(given) == 1 else given


def _given(message: Any, names: Sequence[str]) -> dict[str, Any]:
    """Collect the fields that are not 0."""
    return {name: getattr(message, name) for name in names if getattr(message, name)}
