"""Point-to-point motions, in joint space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError
from heptarm.values.checks import Array, array
from heptarm.values.frames import BASE, TOOL, check_name
from heptarm.values.motion.dynamics import Blended, JointSettings, keywords, settings
from heptarm.values.pose import PartialPose, Pose, Redundancy, check_target, deg, given_in, near_of

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True, slots=True, eq=False)
class Ptp(Blended):
    """Point-to-point motion to joint positions; all joints start and end together.

    Attributes:
        q: target, shape (7,) [rad]; NaN: this joint keeps its set-point.
    """

    q: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", array(self.q, 7, "q", nan=True))
        if np.isnan(self.q).all():
            raise LimitError(
                "q must have the position of one joint at least, got NaN for all seven",
                code=1,
                parameter="q",
                value=self.q.tolist(),
                hint="NaN keeps a joint; check how q was computed",
            )

    @property
    def keeps(self) -> bool:
        """Whether some joints keep their set-points, so that the target depends on where it starts."""
        return bool(np.isnan(self.q).any())


@dataclass(frozen=True, slots=True, eq=False)
class PtpHome(Blended):
    """Point-to-point motion to the home position of the cabinet's project."""


@dataclass(frozen=True, slots=True, eq=False)
class PtpPose(Blended):
    """Point-to-point motion to a pose of the motion frame.

    Attributes:
        target: pose in `frame`; of a partial one the rest is as where the motion begins.
        near: joint positions whose E1 (the angle of A3) and Status the target keeps, shape (7,) [rad]; None: the
            current ones.
        redundancy: E1 (the angle of A3), Status and Turn of the target; given instead of `near`.
        moving: the motion frame.
        frame: the frame of the target: "base", or a taught frame.
    """

    target: Pose | PartialPose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    frame: str = BASE

    def __post_init__(self) -> None:
        check_target(self.target)
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")
        check_name(self.frame, "frame")


@keywords(JointSettings)
def ptp(
    target: npt.ArrayLike | Pose | PartialPose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    frame: str | Pose = BASE,
    **limits: Unpack[JointSettings],
) -> Ptp | PtpPose:
    """Point-to-point motion in joint space.

    Args:
        target: joint positions, shape (7,) [rad], or a pose of the motion frame in `frame`. A NaN keeps this joint's
            set-point, as in `ptp([nan, nan, nan, nan, nan, nan, 0.3])`; a `PartialPose` keeps coordinates. `arm.move`
            refuses both where the set-point at the start is not known yet: behind a running motion, one to home or by
            an offset, or, for joints, one to a pose.
        near: for a pose: joint positions whose E1 (the angle of A3) and Status it keeps, shape (7,) [rad].
        redundancy: for a pose: E1 (the angle of A3), Status and Turn, instead of `near`.
        moving: for a pose: the motion frame: "tool", "flange" or the name of a frame.
        frame: of a pose: "base", the name of a taught frame, or the pose of any frame in the base.
        **limits: as follows.
        dynamics: a `Dynamics` with joint limits, to share between motions; the keywords below replace its values.
        speed: fraction of each joint's maximum, (0, 1], one number for all joints or shape (7,).
        acceleration: likewise.
        jerk: likewise.
        blend_rel: fraction of the path at its end that may be blended into the next motion, [0, 1].
        blend_m: the same as a distance of the motion frame [m], up to 2.
        blend_rad: the same as a rotation of the motion frame [rad], up to 6.3.

    Raises:
        ShapeError: a wrong shape.
        LimitError: a value outside its range, or seven NaN.
        CommandRejected: an argument that belongs to a pose is given with joint positions, both `near` and
            `redundancy`, or dynamics with limits along a path.
    """
    chosen = settings("ptp", JointSettings, limits)
    if isinstance(target, Pose | PartialPose):
        name, (pose,) = given_in(frame, target)
        return PtpPose(pose, near_of(near, redundancy), redundancy, moving, name, **chosen)
    check_name(moving, "moving")
    given = {
        "near": near is not None,
        "redundancy": redundancy is not None,
        "moving": moving != TOOL,
        "frame": isinstance(frame, Pose) or check_name(frame, "frame") != BASE,
    }
    if any(given.values()):
        names = ", ".join(name for name, is_given in given.items() if is_given)
        raise CommandRejected(
            f"{names} given with joint positions, which leave no choice",
            parameter=names.partition(",")[0],
            hint="leave it out, or give a pose as the target",
        )
    return Ptp(array(target, 7, "q", nan=True), **chosen)


@keywords(JointSettings)
def ptp_home(**limits: Unpack[JointSettings]) -> PtpHome:
    """Point-to-point motion to the home position of the cabinet's project.

    Unless an application of the cabinet has set another one, that is the stretched arm: all joints at 0.

    Args:
        **limits: as follows.
        dynamics: see `ptp`.
        speed: fraction of each joint's maximum, (0, 1], one number for all joints or shape (7,).
        acceleration: likewise.
        jerk: likewise.
        blend_rel: see `ptp`.
        blend_m: see `ptp`.
        blend_rad: see `ptp`.

    Raises:
        ShapeError: a wrong shape.
        LimitError: a value outside its range.
        CommandRejected: dynamics with limits along a path.
    """
    return PtpHome(**settings("ptp_home", JointSettings, limits))


#: The folded arm in which it is packed and carried [deg].
_TRANSPORT = (0, 25, 0, 90, 0, 0, 0)


@keywords(JointSettings)
def ptp_transport(**limits: Unpack[JointSettings]) -> Ptp:
    """Point-to-point motion to the folded position in which the arm is packed: A2 at 25 and A4 at 90 degrees, others 0.

    Args:
        **limits: as follows.
        dynamics: see `ptp`.
        speed: fraction of each joint's maximum, (0, 1], one number for all joints or shape (7,).
        acceleration: likewise.
        jerk: likewise.
        blend_rel: see `ptp`.
        blend_m: see `ptp`.
        blend_rad: see `ptp`.

    Raises:
        ShapeError: a wrong shape.
        LimitError: a value outside its range.
        CommandRejected: dynamics with limits along a path.
    """
    return Ptp(deg(*_TRANSPORT), **settings("ptp_transport", JointSettings, limits))
