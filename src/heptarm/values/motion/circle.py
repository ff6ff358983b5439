"""Arcs of circles."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.arrays import Array, array, shown, within
from heptarm.values.frames import TOOL, check_name
from heptarm.values.motion.dynamics import PathMotion, PathSettings, keywords, settings
from heptarm.values.motion.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import Pose, Redundancy, check_pose, multiply, near_of, rotation

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Points closer to each other than this do not define a circle [m].
_TOO_CLOSE = 1e-5
#: A longer arc ends too close to its start for three points to define the circle [rad].
_LONGEST_ARC = 6.1
_PLANES = {"xy": (0.0, 0.0, 1.0), "yz": (1.0, 0.0, 0.0), "xz": (0.0, -1.0, 0.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Circ(PathMotion):
    """Circular arc of the motion frame through a point to a pose.

    Attributes:
        via: a point on the arc; its orientation does not count.
        end: target in the base frame.
        near: joint positions whose arm angle the target takes, shape (7,) [rad]; None: the current arm angle.
        redundancy: arm angle and Status of the target; given instead of `near`.
        moving: the motion frame.
        orientation: how the orientation changes along the path.

    Raises:
        CommandRejected: via and end are the same point.
    """

    #: The longest arc inside the workspace of the largest arm.
    longest_path: ClassVar[float] = 6.0

    via: Pose
    end: Pose
    near: Array | None = None
    redundancy: Redundancy | None = None
    moving: str = TOOL
    orientation: Orientation = VARIABLE

    def __post_init__(self) -> None:
        check_pose(self.via, "via")
        check_pose(self.end, "end")
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")
        if self.via.distance_to(self.end) < _TOO_CLOSE:
            raise CommandRejected(
                "via and end are the same point; a circle needs three different points",
                parameter="via",
                hint="give a point between start and end; arc(...) computes one",
            )


@keywords(PathSettings)
def circ(
    via: Pose,
    end: Pose,
    *,
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    **limits: Unpack[PathSettings],
) -> Circ:
    """Circular arc of the motion frame from its current pose through a point to a pose.

    Args:
        via: a point on the arc between start and end; its orientation does not count.
        end: target of the motion frame in the base frame.
        near: see `lin`.
        redundancy: see `lin`.
        moving: see `lin`.
        orientation: "variable": from the start's to the end's; "constant": the start's; "joint": as the joints turn it
            in a PTP.
        reference: "base", or "path": the orientation refers to the tangent of the arc, so that "constant" turns the
            motion frame with it.
        **limits: dynamics, speeds and blending, see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: via and end coincide, an unknown word, or both `near` and `redundancy`.
    """
    return Circ(
        via,
        end,
        near_of(near, redundancy),
        redundancy,
        moving,
        orientation_of(orientation, reference),
        **settings("circ", PathSettings, limits),
    )


@keywords(PathSettings)
def arc(
    start: Pose,
    angle: float,
    *,
    centre: npt.ArrayLike,
    plane: str | npt.ArrayLike = "xy",
    near: npt.ArrayLike | None = None,
    redundancy: Redundancy | None = None,
    moving: str = TOOL,
    orientation: str = "variable",
    reference: str = "base",
    **limits: Unpack[PathSettings],
) -> Circ:
    """Circular arc from a pose about a centre by an angle.

    Args:
        start: pose of the motion frame when the arc starts; its distance from the axis is the radius.
        angle: [rad], up to 6.1 either way, positive by the right-hand rule about the plane's normal. A full circle is
            two arcs.
        centre: a point of the axis in the base frame, shape (3,) [m].
        plane: "xy", "yz" or "xz" of the base (normals z, x, and -y), or a normal, shape (3,).
        near: see `circ`.
        redundancy: see `circ`.
        moving: see `circ`.
        orientation: see `circ`. With reference="path" the end's orientation is the start's turned by the angle,
            otherwise it is the start's.
        reference: see `circ`.
        **limits: dynamics, speeds and blending, see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: no such plane, the start lies on the axis, or the angle is 0.
    """
    check_pose(start, "start")
    angle = within(angle, "angle", -_LONGEST_ARC, _LONGEST_ARC, unit="rad")
    middle, axis = array(centre, 3, "centre"), normal_of(plane)
    lever = start.xyz - middle
    radius = float(np.linalg.norm(lever - (lever @ axis) * axis))
    if radius < _TOO_CLOSE or abs(angle) * radius < _TOO_CLOSE:
        raise CommandRejected(
            f"an arc of {angle:.6g} rad with a radius of {radius:.6g} m has no length",
            parameter="angle" if radius >= _TOO_CLOSE else "centre",
            hint="move the centre away from the start, or give a larger angle",
        )
    turns = orientation_of(orientation, reference).reference == "path"
    return circ(
        _turned(start, middle, axis, angle / 2, turns=turns),
        _turned(start, middle, axis, angle, turns=turns),
        near=near,
        redundancy=redundancy,
        moving=moving,
        orientation=orientation,
        reference=reference,
        **limits,
    )


def normal_of(plane: str | npt.ArrayLike) -> Array:
    """Unit normal of a plane: "xy", "yz" or "xz" of the base, or three numbers.

    Raises:
        CommandRejected: no such plane.
        ShapeError: three numbers without a direction.
    """
    if isinstance(plane, str):
        if plane not in _PLANES:
            raise CommandRejected(
                f"plane must be one of {', '.join(map(repr, _PLANES))} or a normal of three numbers, got "
                f"{shown(plane)}",
                parameter="plane",
                value=plane,
            )
        return np.array(_PLANES[plane])
    normal = array(plane, 3, "plane")
    length = float(np.linalg.norm(normal))
    if length < 1e-9:
        raise ShapeError(
            f"plane must be a normal with a direction, got {shown(plane)}",
            parameter="plane",
            value=plane,
            hint='for example "xy"',
        )
    return normal / length


def _turned(pose: Pose, centre: Array, axis: Array, angle: float, *, turns: bool) -> Pose:
    turn = np.array([*(axis * sin(angle / 2)), cos(angle / 2)])
    quat = multiply(turn, pose.quat) if turns else pose.quat
    return Pose(centre + rotation(turn) @ (pose.xyz - centre), quat)
