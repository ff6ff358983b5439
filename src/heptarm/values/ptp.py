"""Point to point motions, in joint space."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.values.arguments import (
    AXES,
    EXACT,
    TOOL,
    blending_of,
    check_name,
    check_pose,
    joints_of,
    near_of,
    seven,
)
from heptarm.values.arrays import Array, array
from heptarm.values.limits import Blending, JointDynamics
from heptarm.values.pose import Pose
from heptarm.values.redundancy import Redundancy
from heptarm.values.trigger import Triggered


@dataclass(frozen=True, slots=True, eq=False)
class Ptp(Triggered):
    """Point to point to joint positions; every axis starts and ends with the others.

    Attributes:
        q: target, shape (7,) [rad].
        joints: fractions of the axes' maxima.
        blending: into the following motion.
    """

    q: Array
    joints: JointDynamics = AXES
    blending: Blending = EXACT

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", array(self.q, 7, "q"))

    def under(self, ceiling: float) -> Ptp:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


@dataclass(frozen=True, slots=True, eq=False)
class PtpHome(Triggered):
    """Point to point to the home position that the cabinet's project has.

    Attributes:
        joints: fractions of the axes' maxima.
        blending: into the following motion.
    """

    joints: JointDynamics = AXES
    blending: Blending = EXACT

    def under(self, ceiling: float) -> PtpHome:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


@dataclass(frozen=True, slots=True, eq=False)
class PtpPose(Triggered):
    """Point to point to a pose of the moved frame.

    Attributes:
        pose: target in the base frame.
        near: joint positions whose arm angle and Status the target keeps, shape (7,) [rad]; None: the
            present ones.
        redundancy: the arm position meant; given instead of `near`.
        moving: the moved frame.
        joints: fractions of the axes' maxima.
        blending: into the following motion.
    """

    pose: Pose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    joints: JointDynamics = AXES
    blending: Blending = EXACT

    def __post_init__(self) -> None:
        check_pose(self.pose)
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")

    def under(self, ceiling: float) -> PtpPose:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


def ptp(
    target: npt.ArrayLike | Pose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    speed: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
    jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> Ptp | PtpPose:
    """Point to point motion in joint space.

    Args:
        target: joint positions, shape (7,) [rad], or a pose of the moved frame in the base frame.
        near: for a pose: joint positions whose arm angle and Status it keeps, shape (7,) [rad].
        redundancy: for a pose: E1, Status and Turn, instead of `near`.
        moving: for a pose: the moved frame: "tool", "flange" or a frame's name.
        speed: fraction of each axis' maximum, (0, 1], one for all or shape (7,).
        acceleration: likewise.
        jerk: likewise.
        blend_rel: fraction of the path at its end that may be blended into the next motion, [0, 1].
        blend_m: the same as a distance of the moved frame [m].
        blend_rad: the same as a rotation of the moved frame [rad].

    Raises:
        ShapeError: a wrong shape.
        LimitError: a value outside its range.
        CommandRejected: an argument that belongs to a pose is given with joint positions, or both ways of
            choosing the arm position.
    """
    joints = joints_of(speed, acceleration, jerk)
    blending = blending_of(blend_rel, blend_m, blend_rad)
    if isinstance(target, Pose):
        return PtpPose(target, seven(near, "near"), redundancy, moving, joints, blending)
    if near is not None or redundancy is not None or moving != TOOL:
        raise CommandRejected(
            "near, redundancy and moving belong to a pose; joint positions leave no choice",
            parameter="near",
            hint="leave them out",
        )
    return Ptp(array(target, 7, "q"), joints, blending)


def ptp_home(
    *,
    speed: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
    jerk: npt.ArrayLike | None = None,
    blend_rel: float = 0.0,
    blend_m: float = 0.0,
    blend_rad: float = 0.0,
) -> PtpHome:
    """Point to point motion to the home position that the cabinet's project has.

    Unless an application of the cabinet has set another one, that is the stretched arm: all joints at 0.

    Args:
        speed: fraction of each axis' maximum, (0, 1], one for all or shape (7,).
        acceleration: likewise.
        jerk: likewise.
        blend_rel: see `ptp`.
        blend_m: see `ptp`.
        blend_rad: see `ptp`.

    Raises:
        ShapeError: a wrong shape.
        LimitError: a value outside its range.
    """
    return PtpHome(joints_of(speed, acceleration, jerk), blending_of(blend_rel, blend_m, blend_rad))
