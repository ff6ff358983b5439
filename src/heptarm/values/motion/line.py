"""Straight lines: to a pose, or by an offset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.checks import Array, array, shown
from heptarm.values.frames import BASE, TOOL, check_name
from heptarm.values.motion.dynamics import PathMotion, PathSettings, keywords, settings
from heptarm.values.motion.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import PartialPose, Pose, Redundancy, check_target, given_in, near_of

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True, slots=True, eq=False)
class Lin(PathMotion):
    """Straight line of the motion frame to a pose.

    Attributes:
        target: pose in `frame`; of a partial one the rest is as where the motion begins.
        near: joint positions whose E1 (the angle of A3) the target takes, shape (7,) [rad]; None: the current one.
        redundancy: E1 (the angle of A3) and Status of the target; given instead of `near`.
        moving: the motion frame.
        orientation: how the orientation changes along the path.
        frame: the frame of the target: "base", or a taught frame.
    """

    target: Pose | PartialPose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    orientation: Orientation = VARIABLE
    frame: str = BASE

    def __post_init__(self) -> None:
        check_target(self.target)
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")
        check_name(self.frame, "frame")


@dataclass(frozen=True, slots=True, eq=False)
class LinRel(PathMotion):
    """Straight line of the motion frame by an offset from its pose when the motion starts.

    Attributes:
        offset: translation and rotation.
        frame: the frame whose axes the offset refers to: "tool" (the motion frame), "base", or the name of a frame.
        moving: the motion frame.
        orientation: how the orientation changes along the path.
    """

    offset: Pose
    frame: str = TOOL
    moving: str = TOOL
    orientation: Orientation = VARIABLE

    def __post_init__(self) -> None:
        if not isinstance(self.offset, Pose):
            raise ShapeError(
                f"offset must be a Pose, got {shown(self.offset)}", parameter="offset", value=self.offset
            )
        check_name(self.frame, "frame")
        check_name(self.moving, "moving")


@keywords(PathSettings)
def lin(
    pose: Pose | PartialPose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    frame: str | Pose = BASE,
    **limits: Unpack[PathSettings],
) -> Lin:
    """Straight line of the motion frame to a pose.

    Args:
        pose: target of the motion frame, in `frame`; with a `PartialPose` the rest stays as where the line begins.
        near: joint positions whose E1 (the angle of A3) the target takes, shape (7,) [rad].
        redundancy: E1 (the angle of A3) and Status of the target, instead of `near`.
        moving: the motion frame: "tool" (the tool frame, without a tool the flange), "flange" or the name of a frame.
        orientation: "variable": from the start's to the target's; "constant": the start's; "joint": as the joints turn
            it in a PTP.
        reference: of the orientation, "base" or "path"; on a straight line both are the same.
        frame: the frame of the target: "base", the name of a taught frame, or the pose of any frame in the base.
        **limits: as follows.
        dynamics: a `Dynamics`, to share between motions; the keywords below replace its values.
        speed_mps: speed along the path [m/s], up to 10.
        acceleration_mps2: [m/s²], up to 100.
        jerk_mps3: [m/s³], up to 10 000.
        speed_radps: speed of the rotation [rad/s], up to 20.
        acceleration_radps2: [rad/s²], up to 200.
        jerk_radps3: [rad/s³], up to 20 000.
        joint_speed: fraction of each joint's maximum that may be used, (0, 1], one for all or shape (7,).
        joint_acceleration: likewise.
        joint_jerk: likewise.
        blend_rel: fraction of the path at its end that may be blended into the next motion, [0, 1].
        blend_m: the same as a distance [m], up to 2.
        blend_rad: the same as a rotation [rad], up to 6.3.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: an unknown word, or both `near` and `redundancy`.
    """
    name, (target,) = given_in(frame, pose)
    return Lin(
        target,
        near_of(near, redundancy),
        redundancy,
        moving,
        orientation_of(orientation, reference),
        name,
        **settings("lin", PathSettings, limits),
    )


@keywords(PathSettings)
def lin_rel(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    a: float = 0.0,
    b: float = 0.0,
    c: float = 0.0,
    *,
    frame: str | Pose = TOOL,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    **limits: Unpack[PathSettings],
) -> LinRel:
    """Straight line of the motion frame by an offset from its pose when the motion starts.

    Args:
        x: translation [m], as y and z.
        y: see x.
        z: see x.
        a: rotation Rz(a) Ry(b) Rx(c) [rad], as b and c.
        b: see a.
        c: see a.
        frame: the frame whose axes these are: "tool" (the motion frame), "base", the name of a frame, or the pose of
            any frame in the base.
        moving: the motion frame, see `lin`.
        orientation: see `lin`.
        reference: see `lin`.
        **limits: dynamics, speeds and blending, see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: an unknown word.
    """
    x, y, z, a, b, c = array([x, y, z, a, b, c], 6, "offset").tolist()
    offset = Pose.xyz_abc(x, y, z, a, b, c)
    if isinstance(frame, Pose):  # the motion frame turns about its own origin: only the axes count
        axes = Pose.of(np.zeros(3), frame.quat)
        offset, frame = axes @ offset @ axes.inverse(), BASE
    return LinRel(
        offset,
        frame,
        moving,
        orientation_of(orientation, reference),
        **settings("lin_rel", PathSettings, limits),
    )
