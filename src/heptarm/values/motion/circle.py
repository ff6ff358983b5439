"""Arcs of circles."""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, cos, pi, sin
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, shown, within
from heptarm.values.frames import BASE, TOOL, check_name
from heptarm.values.motion.dynamics import PathMotion, PathSettings, keywords, settings
from heptarm.values.motion.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import Pose, Redundancy, check_pose, given_in, multiply, near_of, rotation

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Points closer to each other than this do not define a circle [m].
_TOO_CLOSE = 1e-5
#: Nor do points whose directions from the first one differ by less than this [rad], and which lie on a line.
_FLAT = 1e-4
#: A longer arc ends too close to its start for three points to define the circle [rad].
_LONGEST_ARC = 6.1
_PLANES = {"xy": (0.0, 0.0, 1.0), "yz": (1.0, 0.0, 0.0), "xz": (0.0, -1.0, 0.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Circle(Value):
    """The arc of a circle through three points; made by `circle_through`.

    Attributes:
        centre: in the frame of the points, shape (3,) [m].
        normal: unit normal of its plane; the arc turns about it by the right-hand rule, shape (3,).
        radius: [m].
        angle: from the start to the end, in (0, 2 pi) [rad].
    """

    centre: Array
    normal: Array
    radius: float
    angle: float

    @property
    def length(self) -> float:
        """Length of the arc [m]."""
        return self.radius * self.angle


def circle_through(start: Pose, via: Pose, end: Pose) -> Circle:
    """The arc that `circ(via, end)` follows from a start; or the reason why there is none.

    `arm.move` and the cabinet check every arc whose start they know in the same way before anything moves. Whether the
    arm reaches all of it is another question, which `arm.plan` answers.

    Args:
        start: where the arc starts; its orientation does not count, nor those of the others.
        via: a point on the arc.
        end: where it ends, in the same frame.

    Raises:
        ShapeError: no pose.
        CommandRejected: two points are closer to each other than 1e-5 m; or via lies on the line through start and end,
            seen from the start to 1e-4 rad.
    """
    for pose, name in ((start, "start"), (via, "via"), (end, "end")):
        check_pose(pose, name)
    return arc_of(start.xyz, via.xyz, end.xyz)


def arc_of(start: Array, via: Array, end: Array) -> Circle:
    """The arc through three points, shape (3,) [m] each; raises CommandRejected as `circle_through` does."""
    to_via, to_end = via - start, end - start
    _check_apart("via and end", via, end, "via")
    long = _check_apart("start and via", start, via, "via")
    across = _check_apart("start and end", start, end, "end")
    normal = np.cross(to_via, to_end)
    area = float(np.linalg.norm(normal))
    if not area >= _FLAT * long * across:
        raise CommandRejected(
            f"start, via and end lie on a line: seen from the start, via must be at least {_FLAT:g} rad beside the "
            f"direction to the end, got {asin(min(1.0, area / (long * across))):.3g} rad",
            code=2,
            parameter="via",
            value=area / (long * across),
            allowed=f"[{_FLAT:g}, pi/2] rad",
            hint="move via off the line, or use lin(end)",
        )
    # centre of the circumcircle, relative to the start
    lever = (np.cross(normal, to_via) * across**2 + np.cross(to_end, normal) * long**2) / (2 * area * area)
    axis = normal / area
    last = to_end - lever
    angle = atan2(float(last @ np.cross(axis, -lever)), float(-(last @ lever))) % (2 * pi)
    return Circle(frozen(start + lever), frozen(axis), float(np.linalg.norm(lever)), angle)


def _check_apart(what: str, one: Array, other: Array, parameter: str) -> float:
    """The distance of two points of a circle [m]; raises CommandRejected if it is too small."""
    distance = float(np.linalg.norm(other - one))
    if not distance >= _TOO_CLOSE:
        raise CommandRejected(
            f"the points of a circle must be at least {_TOO_CLOSE:g} m apart, got {what} {distance:.3g} m apart",
            code=2,
            parameter=parameter,
            value=distance,
            allowed=f"[{_TOO_CLOSE:g}, inf) m",
            hint="give a point between start and end; arc(...) computes one"
            if parameter == "via"
            else "a full circle is two arcs: give the opposite point as the first end",
        )
    return distance


@dataclass(frozen=True, slots=True, eq=False)
class Circ(PathMotion):
    """Circular arc of the motion frame through a point to a pose.

    Attributes:
        via: a point on the arc; its orientation does not count.
        end: target, in `frame`, as `via` is.
        near: joint positions whose E1 (the angle of A3) the target takes, shape (7,) [rad]; None: the current one.
        redundancy: E1 (the angle of A3) and Status of the target; given instead of `near`.
        moving: the motion frame.
        orientation: how the orientation changes along the path.
        frame: the frame of via and end: "base", or a taught frame.

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
    frame: str = BASE

    def __post_init__(self) -> None:
        check_pose(self.via, "via")
        check_pose(self.end, "end")
        object.__setattr__(self, "near", near_of(self.near, self.redundancy))
        check_name(self.moving, "moving")
        check_name(self.frame, "frame")
        _check_apart("via and end", self.via.xyz, self.end.xyz, "via")


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
    frame: str | Pose = BASE,
    **limits: Unpack[PathSettings],
) -> Circ:
    """Circular arc of the motion frame from its current pose through a point to a pose.

    `circle_through` returns its radius and angle, or refuses the points. `arm.move` refuses points without an arc
    where it knows the start: at rest, or behind a motion to a given pose or joints.

    Args:
        via: a point on the arc between start and end, in `frame`; its orientation does not count.
        end: target of the motion frame, in `frame`.
        near: see `lin`.
        redundancy: see `lin`.
        moving: see `lin`.
        orientation: "variable": from the start's to the end's; "constant": the start's; "joint": as the joints turn it
            in a PTP.
        reference: "base", or "path": the orientation refers to the tangent of the arc, so that "constant" turns the
            motion frame with it.
        frame: the frame of via and end, see `lin`.
        **limits: dynamics, speeds and blending, see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: via and end coincide, an unknown word, or both `near` and `redundancy`.
    """
    name, (middle, target) = given_in(frame, via, end)
    return Circ(
        middle,
        target,
        near_of(near, redundancy),
        redundancy,
        moving,
        orientation_of(orientation, reference),
        name,
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
    frame: str | Pose = BASE,
    **limits: Unpack[PathSettings],
) -> Circ:
    """Circular arc from a pose about a centre by an angle.

    Args:
        start: pose of the motion frame when the arc starts, in `frame`; its distance from the axis is the radius.
        angle: [rad], up to 6.1 either way, positive by the right-hand rule about the plane's normal. A full circle is
            two arcs.
        centre: a point of the axis in `frame`, shape (3,) [m].
        plane: "xy", "yz" or "xz" of `frame` (normals z, x, and -y), or a normal, shape (3,).
        near: see `circ`.
        redundancy: see `circ`.
        moving: see `circ`.
        orientation: see `circ`. With reference="path" the end's orientation is the start's turned by the angle,
            otherwise it is the start's.
        reference: see `circ`.
        frame: the frame of start, centre and plane, see `lin`.
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
        frame=frame,
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
