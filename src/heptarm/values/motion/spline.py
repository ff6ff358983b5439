"""Splines: several segments or points, gone through without a halt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.arguments import AXES, EXACT, FREE, TOOL, check_name, check_pose, joints_of, path_of
from heptarm.values.arrays import Array, Value, array, within
from heptarm.values.circ import Circ, normal_of
from heptarm.values.limits import CartesianDynamics, JointDynamics
from heptarm.values.lines import Lin
from heptarm.values.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.pose import Pose
from heptarm.values.ptp import Ptp
from heptarm.values.trigger import Triggered

#: As many segments as the protocol carries.
_MOST = 1000
_LEAST_RADIUS = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Spl(Value):
    """Curved segment of a spline, shaped by its neighbours.

    Attributes:
        pose: where it ends, in the base frame.
        path: limits on this segment; what is open is the spline's.
        orientation: how the orientation is led to it.
    """

    pose: Pose
    path: CartesianDynamics = FREE
    orientation: Orientation = VARIABLE

    def __post_init__(self) -> None:
        check_pose(self.pose)


Segment: TypeAlias = Spl | Lin | Circ


@dataclass(frozen=True, slots=True, eq=False)
class Spline(Triggered):
    """Spline in space.

    Attributes:
        segments: curved, straight and round ones, 1 to 1000.
        moving: the moved frame.
        path: limits along it, where a segment says nothing.
        joints: fractions of the axes' maxima, as well.
    """

    segments: tuple[Segment, ...]
    moving: str = TOOL
    path: CartesianDynamics = FREE
    joints: JointDynamics = AXES

    def __post_init__(self) -> None:
        check_name(self.moving, "moving")

    def under(self, ceiling: float) -> Spline:
        """The same motion, no axis faster than that fraction of its maximum."""
        return replace(self, joints=self.joints.under(ceiling))


@dataclass(frozen=True, slots=True, eq=False)
class JointSpline(Triggered):
    """Spline in joint space.

    Attributes:
        points: joint positions to pass through and how fast to come there, 1 to 1000.
        joints: fractions of the axes' maxima, where a point says nothing.
    """

    points: tuple[Ptp, ...]
    joints: JointDynamics = AXES

    def under(self, ceiling: float) -> JointSpline:
        """The same motion, no axis faster than that fraction of its maximum."""
        points = tuple(
            replace(point, joints=_filled(point.joints, self.joints).under(ceiling)) for point in self.points
        )
        return replace(self, points=points, joints=self.joints.under(ceiling))


def _filled(own: JointDynamics, whole: JointDynamics) -> JointDynamics:
    """What a point says, and where it says nothing what the spline says."""
    names = ("velocity", "acceleration", "jerk")
    values = ((getattr(own, name), getattr(whole, name)) for name in names)
    return JointDynamics(*(np.where(np.isnan(mine), other, mine) for mine, other in values))


def spl(
    pose: Pose,
    *,
    orientation: str = "variable",
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
) -> Spl:
    """Curved segment of a spline.

    Args:
        pose: where it ends, in the base frame; the curve passes through it.
        orientation: "variable": it has the pose's orientation there; "constant": it keeps the one before;
            "ignore": the orientations before and after decide.
        speed_mps: on this segment, see `lin`; the other limits as well.
        acceleration_mps2: see `lin`.
        jerk_mps3: see `lin`.
        speed_radps: see `lin`.
        acceleration_radps2: see `lin`.
        jerk_radps3: see `lin`.

    Raises:
        ShapeError: no pose.
        LimitError: a value outside its range.
        CommandRejected: another word.
    """
    return Spl(
        pose,
        path_of(speed_mps, acceleration_mps2, jerk_mps3, speed_radps, acceleration_radps2, jerk_radps3),
        orientation_of(orientation, "base", alone=False),
    )


def spline(
    segments: Sequence[Segment | Pose],
    *,
    moving: str = TOOL,
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    speed_radps: float | None = None,
    acceleration_radps2: float | None = None,
    jerk_radps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
) -> Spline:
    """Smooth curve of the moved frame through poses, with straight and round segments where they are wanted.

    The arm does not stop at the poses, unless two straight or round segments meet in a corner.

    Args:
        segments: poses, or spl(...), lin(...) and circ(...) for segments with limits of their own; the spline
            begins where the arm is.
        moving: the moved frame, see `lin`.
        speed_mps: see `lin`; for segments that say nothing, as all other limits.
        acceleration_mps2: see `lin`.
        jerk_mps3: see `lin`.
        speed_radps: see `lin`.
        acceleration_radps2: see `lin`.
        jerk_radps3: see `lin`.
        joint_speed: see `lin`.
        joint_acceleration: see `lin`.
        joint_jerk: see `lin`.

    Raises:
        ShapeError: something that is no segment, none, or more than 1000.
        LimitError: a value outside its range.
        CommandRejected: a segment has what a segment cannot have, as blending or joint limits of its own.
    """
    return Spline(
        tuple(_segment(one, index) for index, one in enumerate(_listed(segments, "segments"))),
        moving,
        path_of(speed_mps, acceleration_mps2, jerk_mps3, speed_radps, acceleration_radps2, jerk_radps3),
        joints_of(joint_speed, joint_acceleration, joint_jerk),
    )


def _listed(values: Sequence[object], name: str) -> Sequence[object]:
    if isinstance(values, str) or not hasattr(values, "__len__") or not 1 <= len(values) <= _MOST:
        raise ShapeError(
            f"{name} is {type(values).__name__}; a list of 1 to {_MOST} is wanted",
            code=3,
            parameter=name,
            hint="for example [pose1, pose2, circ(via, pose3)]",
        )
    return values


def _segment(one: object, index: int) -> Segment:
    name = f"segments[{index}]"
    if isinstance(one, Pose):
        return Spl(one)
    if isinstance(one, Spl):
        return one
    if not isinstance(one, Lin | Circ):
        raise ShapeError(
            f"{name} is {one!r}, which is no segment of a spline",
            parameter=name,
            hint="give a pose, spl(...), lin(...) or circ(...)",
        )
    for what, given in (
        ("near", one.near is not None),
        ("redundancy", one.redundancy is not None),
        ("moving", one.moving != TOOL),
        ("blending", one.blending != EXACT),
        ("joint limits", one.joints != AXES),
        ("triggers", bool(one.triggers)),
    ):
        if given:
            raise CommandRejected(
                f"{name} has {what} of its own, which a segment of a spline cannot have",
                parameter=name,
                hint="give it to the spline, or leave it out",
            )
    return one


def spline_joints(
    points: Sequence[npt.ArrayLike | Ptp],
    *,
    speed: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
    jerk: npt.ArrayLike | None = None,
) -> JointSpline:
    """Smooth curve in joint space through joint positions.

    Args:
        points: joint positions, shape (7,) [rad], or ptp(...) for a point with speeds of its own.
        speed: fraction of each axis' maximum, (0, 1], one for all or shape (7,).
        acceleration: likewise.
        jerk: likewise.

    Raises:
        ShapeError: a wrong shape, no points, or more than 1000.
        LimitError: a value outside its range.
        CommandRejected: a point with blending or triggers.
    """
    made = []
    for index, one in enumerate(_listed(points, "points")):
        point = one if isinstance(one, Ptp) else Ptp(array(one, 7, f"points[{index}]"))  # type: ignore[arg-type]
        if point.blending != EXACT:
            raise CommandRejected(
                f"points[{index}] has blending of its own, which a point of a spline cannot have",
                parameter=f"points[{index}]",
                hint="leave it out: a spline does not stop at its points",
            )
        if point.triggers:
            raise CommandRejected(
                f"points[{index}] has triggers of its own, which a point of a spline cannot have",
                parameter=f"points[{index}]",
                hint="give them to the spline; its path counts from its own start",
            )
        made.append(point)
    return JointSpline(tuple(made), joints_of(speed, acceleration, jerk))


def ellipse(
    start: Pose,
    other: float,
    *,
    centre: npt.ArrayLike,
    plane: str | npt.ArrayLike = "xy",
    angle: float = 2 * pi,
    points: int = 36,
    moving: str = TOOL,
    speed_mps: float | None = None,
    acceleration_mps2: float | None = None,
    jerk_mps3: float | None = None,
    joint_speed: npt.ArrayLike | None = None,
    joint_acceleration: npt.ArrayLike | None = None,
    joint_jerk: npt.ArrayLike | None = None,
) -> Spline:
    """An ellipse as a spline, the orientation constant.

    Args:
        start: where the moved frame will be when it begins; its distance from the axis through the centre is
            one half axis.
        other: the other half axis [m].
        centre: in the base frame, shape (3,) [m].
        plane: "xy", "yz" or "xz" of the base (normals z, x, and y backwards), or a normal, shape (3,).
        angle: how far to go [rad], positive by the right hand about the plane's normal, up to ten rounds.
        points: of a full round, 12 to 360; more make it truer.
        moving: see `lin`.
        speed_mps: see `lin`.
        acceleration_mps2: see `lin`.
        jerk_mps3: see `lin`.
        joint_speed: see `lin`.
        joint_acceleration: see `lin`.
        joint_jerk: see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: no such plane, or the start lies on the axis.
    """
    check_pose(start, "start")
    other = within(other, "other", _LEAST_RADIUS, 2.0, unit="m")
    angle = within(angle, "angle", -20 * pi, 20 * pi, unit="rad")
    if not isinstance(points, int) or not 12 <= points <= 360:
        raise LimitError(
            f"points is {points!r}; allowed is 12 to 360", code=2, parameter="points", value=points, allowed="[12, 360]"
        )
    middle, axis = array(centre, 3, "centre"), normal_of(plane)
    lever = start.xyz - middle
    height = (lever @ axis) * axis
    first = lever - height
    radius = float(np.linalg.norm(first))
    count = round(abs(angle) / (2 * pi) * points)
    if radius < _LEAST_RADIUS or count < 1:
        raise CommandRejected(
            f"an ellipse with a half axis of {radius:.6g} m, gone round by {angle:.6g} rad, has no length",
            parameter="centre" if radius < _LEAST_RADIUS else "angle",
            hint="move the centre away from the start, or give a greater angle",
        )
    second = np.cross(axis, first) * (other / radius)
    turns = angle * np.arange(1, count + 1) / count
    return spline(
        [Pose(_on(middle + height, first, second, turn), start.quat) for turn in turns.tolist()],
        moving=moving,
        speed_mps=speed_mps,
        acceleration_mps2=acceleration_mps2,
        jerk_mps3=jerk_mps3,
        joint_speed=joint_speed,
        joint_acceleration=joint_acceleration,
        joint_jerk=joint_jerk,
    )


def _on(middle: Array, first: Array, second: Array, turn: float) -> Array:
    place: Array = middle + cos(turn) * first + sin(turn) * second
    return place
