"""Splines: several segments or points, passed without a stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import TYPE_CHECKING, ClassVar, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array, Value, array, finite_entries, shown, within
from heptarm.values.frames import BASE, TOOL, check_name
from heptarm.values.motion.circle import Circ, normal_of
from heptarm.values.motion.dynamics import (
    DEFAULT,
    EXACT,
    LONGEST_LINE,
    DynamicMotion,
    Dynamics,
    JointSplineSettings,
    SegmentSettings,
    SplineSettings,
    keywords,
    settings,
)
from heptarm.values.motion.line import Lin
from heptarm.values.motion.orientation import VARIABLE, Orientation, orientation_of
from heptarm.values.motion.ptp import Ptp, PtpPose
from heptarm.values.pose import PartialPose, Pose, check_pose, given_in, placed_target
from heptarm.values.robot import RobotModel
from heptarm.values.text import described

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Most segments that the protocol carries.
_MOST = 1000
#: Shortest half axis of an ellipse [m].
_SMALLEST_RADIUS = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Spl(Value):
    """Curved segment of a spline, shaped by its neighbours.

    Attributes:
        target: pose at its end, in the frame of the spline.
        orientation: how the orientation changes along the path.
        dynamics: limits along this segment; those not given are the spline's.
    """

    longest_path: ClassVar[float] = LONGEST_LINE

    target: Pose
    orientation: Orientation = VARIABLE
    dynamics: Dynamics = DEFAULT

    def __post_init__(self) -> None:
        check_pose(self.target)

    def __str__(self) -> str:
        """What is not the default, a line each."""
        return described(self, type(self).__name__)


Segment: TypeAlias = Spl | Lin | Circ


@dataclass(frozen=True, slots=True, eq=False)
class Spline(DynamicMotion):
    """Cartesian spline; its dynamics are for segments without limits of their own.

    Attributes:
        segments: curves, lines and arcs, 1 to 1000.
        moving: the motion frame.
        frame: the frame of all poses of the segments: "base", or a taught frame.
    """

    segments: tuple[Segment, ...]
    moving: str = TOOL
    frame: str = BASE

    def __post_init__(self) -> None:
        check_name(self.moving, "moving")
        check_name(self.frame, "frame")

    def longest_duration(self, robot: RobotModel) -> float:
        """Slowest plausible estimate of its duration [s]."""
        limits = [segment.dynamics.filled_from(self.dynamics) for segment in self.segments]
        paths = (
            each.path_time(segment.longest_path) for each, segment in zip(limits, self.segments, strict=True)
        )
        return self.dynamics.turn_time(robot) * len(self.segments) + sum(paths)


@dataclass(frozen=True, slots=True, eq=False)
class JointSpline(DynamicMotion):
    """Spline in joint space; its dynamics are for points without limits of their own.

    Attributes:
        points: joint positions to pass through, 1 to 1000, each with the limits of the path to it.
    """

    points: tuple[Ptp, ...]

    def limited_to(self, speed: float) -> JointSpline:
        """The same motion, no joint faster than a fraction of its maximum in (0, 1], at no point."""
        points = tuple(
            replace(point, dynamics=point.dynamics.filled_from(self.dynamics).limited_to(speed))
            for point in self.points
        )
        return replace(self, points=points, dynamics=self.dynamics.limited_to(speed))

    def longest_duration(self, robot: RobotModel) -> float:
        """Slowest plausible estimate of its duration [s]."""
        return sum(point.dynamics.turn_time(robot) for point in self.points)


@keywords(SegmentSettings)
def spl(pose: Pose, *, orientation: str = "variable", **limits: Unpack[SegmentSettings]) -> Spl:
    """Curved segment of a spline.

    Args:
        pose: its end in the frame of the spline; the curve passes through it.
        orientation: "variable": it has the pose's orientation there; "constant": it keeps the one before; "ignore": the
            orientations before and after decide.
        **limits: dynamics and speeds along and of the rotation on this segment, see `lin`.

    Raises:
        ShapeError: no pose.
        LimitError: a value outside its range.
        CommandRejected: an unknown word, or dynamics with limits of the joints.
    """
    return Spl(
        pose,
        orientation_of(orientation, "base", segment=True),
        **settings("spl", SegmentSettings, limits),
    )


@keywords(SplineSettings)
def spline(
    segments: Sequence[Segment | Pose],
    *,
    moving: str = TOOL,
    frame: str | Pose = BASE,
    **limits: Unpack[SplineSettings],
) -> Spline:
    """Smooth curve of the motion frame through poses, with lines and arcs where you give them.

    The arm does not stop at the poses, unless two lines or arcs meet in a corner.

    Args:
        segments: poses, or spl(...), lin(...) and circ(...) for segments with limits of their own; the spline starts
            where the arm is.
        moving: the motion frame, see `lin`.
        frame: the frame of all poses of the segments, see `lin`.
        **limits: dynamics and speeds, see `lin`; for segments without limits of their own.

    Raises:
        ShapeError: something that is no segment, none, or more than 1000.
        LimitError: a value outside its range.
        CommandRejected: a segment has something that a segment cannot have, such as blending or joint limits.
    """
    made = Spline(
        tuple(_segment(segment, index) for index, segment in enumerate(_listed(segments, "segments"))),
        moving,
        given_in(frame)[0],
        **settings("spline", SplineSettings, limits),
    )
    return placed(made, frame) if isinstance(frame, Pose) else made


_Aimed = TypeVar("_Aimed", bound=PtpPose | Lin | Circ | Spline | Spl)


def placed(motion: _Aimed, frame: Pose) -> _Aimed:
    """The same motion or segment with its poses in the base.

    Args:
        motion: with poses in a frame.
        frame: pose of that frame in the base.
    """
    if isinstance(motion, Spline):
        return replace(
            motion, segments=tuple(placed(segment, frame) for segment in motion.segments), frame=BASE
        )
    if isinstance(motion, Circ):
        return replace(motion, via=frame @ motion.via, end=frame @ motion.end, frame=BASE)
    if isinstance(motion, Spl):
        return replace(motion, target=frame @ motion.target)
    return replace(motion, target=placed_target(frame, motion.target), frame=BASE)


def _listed(values: Sequence[object], name: str) -> Sequence[object]:
    if isinstance(values, str) or not hasattr(values, "__len__") or not 1 <= len(values) <= _MOST:
        got = f"{len(values)} entries" if hasattr(values, "__len__") else type(values).__name__
        raise ShapeError(
            f"{name} must be a list of 1 to {_MOST} entries, got {got}",
            code=3,
            parameter=name,
            hint="for example [pose1, pose2, circ(via, pose3)]",
        )
    return values


def _segment(segment: object, index: int) -> Segment:
    name = f"segments[{index}]"
    if isinstance(segment, Pose):
        return Spl(segment)
    if isinstance(segment, Spl):
        return segment
    if not isinstance(segment, Lin | Circ):
        raise ShapeError(
            f"{name} must be a segment of a spline, got {shown(segment)}",
            parameter=name,
            value=segment,
            hint="give a pose, spl(...), lin(...) or circ(...)",
        )
    for what, given in (
        ("near", segment.near is not None),
        ("redundancy", segment.redundancy is not None),
        ("moving", segment.moving != TOOL),
        ("frame", segment.frame != BASE),
        ("a partial target", isinstance(segment, Lin) and isinstance(segment.target, PartialPose)),
        ("blending", segment.blending != EXACT),
        ("joint limits", any(limit.startswith("joint_") for limit in segment.dynamics.given())),
        ("triggers", bool(segment.triggers)),
    ):
        if given:
            raise CommandRejected(
                f"{name} has {what} of its own, which a segment of a spline cannot have",
                parameter=name,
                hint="give it to the spline, or leave it out",
            )
    return segment


@keywords(JointSplineSettings)
def spline_joints(
    points: Sequence[npt.ArrayLike | Ptp | PtpPose], **limits: Unpack[JointSplineSettings]
) -> JointSpline:
    """Smooth curve in joint space through joint positions.

    Args:
        points: joint positions, shape (7,) [rad], or ptp(...) of joint positions for a point with limits of its own.
        **limits: dynamics, speed, acceleration and jerk, see `ptp`.

    Raises:
        ShapeError: a wrong shape, no points, or more than 1000.
        LimitError: a value outside its range.
        CommandRejected: a point with blending or triggers, or dynamics with limits along a path.
    """
    made = []
    for index, entry in enumerate(_listed(points, "points")):
        point = entry if isinstance(entry, Ptp) else Ptp(array(entry, 7, f"points[{index}]"))  # type: ignore[arg-type]
        finite_entries(point.q, f"points[{index}]")
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
                hint="give them to the spline, whose path starts at its first point",
            )
        made.append(point)
    return JointSpline(tuple(made), **settings("spline_joints", JointSplineSettings, limits))


@keywords(SplineSettings)
def ellipse(
    start: Pose,
    other: float,
    *,
    centre: npt.ArrayLike,
    plane: str | npt.ArrayLike = "xy",
    angle: float = 2 * pi,
    points: int = 36,
    moving: str = TOOL,
    frame: str | Pose = BASE,
    **limits: Unpack[SplineSettings],
) -> Spline:
    """Ellipse as a spline with constant orientation.

    Args:
        start: pose of the motion frame at its start, in `frame`; its distance from the axis through the centre is one
            half axis.
        other: the other half axis [m].
        centre: in `frame`, shape (3,) [m].
        plane: "xy", "yz" or "xz" of `frame` (normals z, x, and -y), or a normal, shape (3,).
        angle: how far to turn [rad], positive by the right-hand rule about the plane's normal, up to ten turns.
        points: per turn, 12 to 360; more make it more accurate.
        moving: see `lin`.
        frame: the frame of start, centre and plane, see `lin`.
        **limits: dynamics and speeds, see `lin`.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: no such plane, or the start lies on the axis.
    """
    check_pose(start, "start")
    other = within(other, "other", _SMALLEST_RADIUS, 2.0, unit="m")
    angle = within(angle, "angle", -20 * pi, 20 * pi, unit="rad")
    if not isinstance(points, int) or not 12 <= points <= 360:
        raise LimitError(
            f"points must be in [12, 360], got {shown(points)}",
            code=2,
            parameter="points",
            value=points,
            allowed="[12, 360]",
        )
    middle, axis = array(centre, 3, "centre"), normal_of(plane)
    lever = start.xyz - middle
    height = (lever @ axis) * axis
    first = lever - height
    radius = float(np.linalg.norm(first))
    count = round(abs(angle) / (2 * pi) * points)
    if radius < _SMALLEST_RADIUS or count < 1:
        raise CommandRejected(
            f"an ellipse with a half axis of {radius:.6g} m, over {angle:.6g} rad, has no length",
            parameter="centre" if radius < _SMALLEST_RADIUS else "angle",
            hint="move the centre away from the start, or give a larger angle",
        )
    second = np.cross(axis, first) * (other / radius)
    turns = angle * np.arange(1, count + 1) / count
    return spline(
        [Pose(_on(middle + height, first, second, turn), start.quat) for turn in turns.tolist()],
        moving=moving,
        frame=frame,
        **limits,
    )


def _on(middle: Array, first: Array, second: Array, turn: float) -> Array:
    place: Array = middle + cos(turn) * first + sin(turn) * second
    return place
