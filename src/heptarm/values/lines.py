"""Straight lines: to a pose, or by an offset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.arguments import (
    AXES,
    EXACT,
    FREE,
    TOOL,
    blending_of,
    check_name,
    check_pose,
    joints_of,
    near_of,
    path_of,
    seven,
)
from heptarm.values.arrays import Array, array
from heptarm.values.limits import Blending, CartesianDynamics, JointDynamics
from heptarm.values.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import Pose
from heptarm.values.redundancy import Redundancy
from heptarm.values.trigger import Triggered


@dataclass(frozen=True, slots=True, eq=False)
class Lin(Triggered):
    """Straight line of the moved frame to a pose, the orientation turning along.

    Attributes:
        pose: target in the base frame.
        near: joint positions whose arm angle the target takes, shape (7,) [rad]; None: the present one's.
        redundancy: the arm position meant; given instead of `near`.
        moving: the moved frame.
        path: limits along the path.
        joints: fractions of the axes' maxima, as well.
        blending: into the following motion.
        orientation: how the orientation is led.
    """

    pose: Pose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    path: CartesianDynamics = FREE
    joints: JointDynamics = AXES
    blending: Blending = EXACT
    orientation: Orientation = VARIABLE

    def __post_init__(self) -> None:
        check_pose(self.pose)
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")

    def under(self, ceiling: float) -> Lin:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


@dataclass(frozen=True, slots=True, eq=False)
class LinRel(Triggered):
    """Straight line of the moved frame by an offset from where it is when the motion starts.

    Attributes:
        offset: translation and rotation.
        frame: whose axes the offset is given in: "tool" (the moved frame), "base", or a frame's name.
        moving: the moved frame.
        path: limits along the path.
        joints: fractions of the axes' maxima, as well.
        blending: into the following motion.
        orientation: how the orientation is led.
    """

    offset: Pose
    frame: str = TOOL
    moving: str = TOOL
    path: CartesianDynamics = FREE
    joints: JointDynamics = AXES
    blending: Blending = EXACT
    orientation: Orientation = VARIABLE

    def __post_init__(self) -> None:
        if not isinstance(self.offset, Pose):
            raise ShapeError(
                f"offset is {self.offset!r}; a Pose is wanted", parameter="offset", value=self.offset
            )
        check_name(self.frame, "frame")
        check_name(self.moving, "moving")

    def under(self, ceiling: float) -> LinRel:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


def lin(
    pose: Pose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> Lin:
    """Straight line of the moved frame to a pose.

    Args:
        pose: target of the moved frame in the base frame.
        near: joint positions whose arm angle the target takes, shape (7,) [rad].
        redundancy: E1 and Status of the target, instead of `near`.
        moving: the moved frame: "tool" (the attached tool's, without a tool the flange), "flange" or a
            frame's name.
        orientation: "variable": from the start's to the target's; "constant": the start's; "joint": as the
            joints would turn it in a PTP.
        reference: "base" or "path", of which a straight line makes the same.
        speed_mps: speed along the path [m/s], up to 10.
        acceleration_mps2: [m/s²], up to 100.
        jerk_mps3: [m/s³], up to 10 000.
        speed_radps: speed of the rotation [rad/s], up to 20.
        acceleration_radps2: [rad/s²], up to 200.
        jerk_radps3: [rad/s³], up to 20 000.
        joint_speed: fraction of each axis' maximum that may be used, (0, 1], one for all or shape (7,).
        joint_acceleration: likewise.
        joint_jerk: likewise.
        blend_rel: fraction of the path at its end that may be blended into the next motion, [0, 1].
        blend_m: the same as a distance [m].
        blend_rad: the same as a rotation [rad].

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: both `near` and `redundancy`.
    """
    return Lin(
        pose,
        seven(near, "near"),
        redundancy,
        moving,
        path_of(speed_mps, acceleration_mps2, jerk_mps3, speed_radps, acceleration_radps2, jerk_radps3),
        joints_of(joint_speed, joint_acceleration, joint_jerk),
        blending_of(blend_rel, blend_m, blend_rad),
        orientation_of(orientation, reference),
    )


def lin_rel(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    a: float = 0.0,
    b: float = 0.0,
    c: float = 0.0,
    *,
    frame: str = TOOL,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> LinRel:
    """Straight line of the moved frame by an offset from where it is when the motion starts.

    Args:
        x: translation [m], as y and z.
        y: see x.
        z: see x.
        a: rotation Rz(a) Ry(b) Rx(c) [rad], as b and c.
        b: see a.
        c: see a.
        frame: whose axes these are: "tool" (the moved frame's own), "base", or a frame's name.
        moving: the moved frame, as for `lin`; the speeds and blending as well.
        orientation: see `lin`.
        reference: see `lin`.
        speed_mps: see `lin`.
        acceleration_mps2: see `lin`.
        jerk_mps3: see `lin`.
        speed_radps: see `lin`.
        acceleration_radps2: see `lin`.
        jerk_radps3: see `lin`.
        joint_speed: see `lin`.
        joint_acceleration: see `lin`.
        joint_jerk: see `lin`.
        blend_rel: see `lin`.
        blend_m: see `lin`.
        blend_rad: see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
    """
    x, y, z, a, b, c = array([x, y, z, a, b, c], 6, "offset").tolist()
    return LinRel(
        Pose.xyz_abc(x, y, z, a, b, c),
        frame,
        moving,
        path_of(speed_mps, acceleration_mps2, jerk_mps3, speed_radps, acceleration_radps2, jerk_radps3),
        joints_of(joint_speed, joint_acceleration, joint_jerk),
        blending_of(blend_rel, blend_m, blend_rad),
        orientation_of(orientation, reference),
    )
