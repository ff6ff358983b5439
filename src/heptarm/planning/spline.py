"""Plans splines: smooth curves of segments in space, or through points in joint space."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import acos

import numpy as np

from heptarm.model.kinematics import Vec, forward
from heptarm.planning import seam
from heptarm.planning.composite_path import UNBOUND, CompositePath, Segment, SubPath
from heptarm.planning.geometry import Arc, Quat, Slerp, Straight
from heptarm.planning.motion import (
    CARTESIAN_DEFAULT,
    ORIENTATION_DEFAULT,
    PlanError,
    check_numbers,
    fractions,
    inherited,
    kind_of,
    or_default,
    orientation_of,
)
from heptarm.planning.path import CartesianPath
from heptarm.planning.plan import Plan, timed
from heptarm.planning.targets import (
    JointMotion,
    SplineSegment,
    goes_on,
    joint_target,
    pose_of,
    segment_limits,
)
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, is_half_turn, towards
from heptarm.values.robot import RobotModel


class Quintic:
    """Polynomial piece between two points.

    Args:
        length: growth of the curve's parameter along it.
        start: position, slope and curvature at its start, each shape (m,).
        end: likewise.

    Attributes:
        coefficients: of each coordinate, the highest power first.
    """

    __slots__ = ("coefficients",)

    def __init__(
        self, length: float, start: tuple[Array, Array, Array], end: tuple[Array, Array, Array]
    ) -> None:
        (p, v, a), (q, w, b) = start, end
        v, w, a, b, step = v * length, w * length, a * length**2, b * length**2, q - p
        rows = (
            6 * step - 3 * (v + w) - 0.5 * (a - b),
            -15 * step + 8 * v + 7 * w + 1.5 * a - b,
            10 * step - 6 * v - 4 * w - 1.5 * a + 0.5 * b,
            0.5 * a,
            v,
            p,
        )
        self.coefficients: list[tuple[float, ...]] = [tuple(column) for column in np.array(rows).T.tolist()]

    def at(self, t: float) -> tuple[float, ...]:
        """Position at a fraction t of the piece."""
        return tuple(
            ((((a * t + b) * t + c) * t + d) * t + e) * t + f for a, b, c, d, e, f in self.coefficients
        )


def slopes(points: Array, lengths: Array, first: Array | None, last: Array | None) -> tuple[Array, Array]:
    """Slopes and curvatures of the cubic spline through n points, shapes (n, m).

    Args:
        points: shape (n, m).
        lengths: of the parameter between them, shape (n - 1,).
        first: slope at the start, shape (m,); None: no curvature there.
        last: slope at the end; None: no curvature there.
    """
    n, steps = len(points), np.diff(points, axis=0) / lengths[:, None]
    matrix, right = np.zeros((n, n)), np.zeros_like(points)
    for i in range(1, n - 1):
        a, b = 1 / lengths[i - 1], 1 / lengths[i]
        matrix[i, i - 1 : i + 2] = a, 2 * (a + b), b
        right[i] = 3 * (steps[i - 1] * a + steps[i] * b)
    for row, other, fixed, step in ((0, 1, first, steps[0]), (n - 1, n - 2, last, steps[-1])):
        matrix[row, row] = 1.0
        right[row] = 1.5 * step if fixed is None else fixed
        matrix[row, other] = 0.5 if fixed is None else 0.0
    slope: Array = np.linalg.solve(matrix, right).astype(np.float64)
    curvature = np.empty_like(points)
    curvature[:-1] = (6 * steps - 4 * slope[:-1] - 2 * slope[1:]) / lengths[:, None]
    curvature[-1] = (4 * slope[-1] + 2 * slope[-2] - 6 * steps[-1]) / lengths[-1]
    return slope, curvature


class Piecewise:
    """Polynomial pieces one after the other.

    Args:
        lengths: growth of the parameter along each.
        pieces: as many.
    """

    def __init__(self, lengths: Array, pieces: list[Quintic]) -> None:
        ends = np.cumsum(lengths)
        self._pieces = pieces
        self._coefficients = np.array([piece.coefficients for piece in pieces])
        self._marks: list[float] = [0.0, *(ends / ends[-1]).tolist()]

    def at(self, s: float) -> tuple[float, ...]:
        """Position at a fraction s of the whole."""
        index = min(bisect_right(self._marks, s), len(self._pieces)) - 1
        low, high = self._marks[index], self._marks[index + 1]
        return self._pieces[index].at((s - low) / (high - low))

    def samples(self, s: Array) -> Array:
        """Positions at n fractions of the whole, shape (n, m)."""
        marks = np.array(self._marks)
        index = np.clip(np.searchsorted(marks, s, side="right") - 1, 0, len(self._pieces) - 1)
        t = (s - marks[index]) / (marks[index + 1] - marks[index])
        found: Array = np.einsum("nk,nmk->nm", np.vander(t, 6), self._coefficients[index])
        return found

    def even(self, count: int) -> Array:
        """Positions at so many places of each piece, and at the end."""
        places = np.vander(np.linspace(0.0, 1.0, count, endpoint=False), 6)
        inner = np.einsum("nk,pmk->pnm", places, self._coefficients)
        return np.vstack([inner.reshape(-1, inner.shape[2]), self.at(1.0)])


def through(points: Array, lengths: Array) -> Piecewise:
    """The smooth curve through points, shape (n, m), with the growth of the parameter between them, shape (n - 1,)."""
    slope, curvature = slopes(points, lengths, None, None)
    ends = list(zip(points, slope, curvature, strict=True))
    return Piecewise(
        lengths, [Quintic(h, a, b) for h, a, b in zip(lengths.tolist(), ends, ends[1:], strict=False)]
    )


class JointCurve:
    """Smooth curve through joint positions."""

    __slots__ = ("_curve",)

    line = None
    keeps_a3 = False

    def __init__(self, points: Array, lengths: Array) -> None:
        self._curve = through(points, lengths)

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not used."""
        return np.array(self._curve.at(s))

    def samples(self, s: Array) -> Array:
        """See `JointPath`."""
        return self._curve.samples(s)


class Orientations:
    """Smooth rotation through orientations; constant between two that are the same.

    Args:
        places: fractions of the whole at which they are, shape (n,), ascending.
        quats: shape (n, 4).
        others: half turns that go in the other direction, by the number of their start; see `towards`.

    Attributes:
        half_turns: number of the start, and fraction at the end, of each half turn.
    """

    def __init__(self, places: Array, quats: Array, *, others: frozenset[int] = frozenset()) -> None:
        self._given = places, quats, others
        signed = quats.copy()
        for i in range(1, len(signed)):
            signed[i] = towards(signed[i - 1], signed[i], is_other=i - 1 in others)
        self.half_turns = [
            (i, float(places[i + 1]))
            for i, (one, two) in enumerate(pairwise(signed))
            if is_half_turn(one, two)
        ]
        self._places: list[float] = places.tolist()
        lengths = np.diff(places)
        steps = np.diff(signed, axis=0) / lengths[:, None]
        still = np.linalg.norm(steps, axis=1) < 1e-9
        none = np.zeros(4)
        slope = [none] * len(signed)
        for i in range(1, len(signed) - 1):
            if not (still[i - 1] or still[i]):
                weight = lengths[i] / (lengths[i - 1] + lengths[i])
                slope[i] = weight * steps[i - 1] + (1 - weight) * steps[i]
        # at the ends the arm rests anyway: no need to begin to turn slowly as well
        slope[0], slope[-1] = (1.5 * steps[0] - 0.5 * slope[1], 1.5 * steps[-1] - 0.5 * slope[-2])
        if still[0] or len(signed) == 2:
            slope[0] = steps[0]
        if still[-1] or len(signed) == 2:
            slope[-1] = steps[-1]
        ends = [(q, v, none) for q, v in zip(signed, slope, strict=True)]
        self._pieces = [Quintic(h, a, b) for h, a, b in zip(lengths.tolist(), ends, ends[1:], strict=False)]

    def other(self, half_turn: int) -> Orientations:
        """The same with a half turn in the other direction."""
        places, quats, others = self._given
        return Orientations(places, quats, others=others | {half_turn})

    def at(self, s: float) -> Quat:
        """Orientation at a fraction of the whole."""
        index = min(max(bisect_right(self._places, s) - 1, 0), len(self._pieces) - 1)
        low, high = self._places[index], self._places[index + 1]
        x, y, z, w = self._pieces[index].at(min(1.0, (s - low) / (high - low)))
        k = (x * x + y * y + z * z + w * w) ** -0.5
        return x * k, y * k, z * k, w * k


class SplineGeometry:
    """Pose of the tool frame along a spline block.

    Args:
        lengths: of the segments, shape (n,).
        segments: as many.
        turning: orientation over the whole.
    """

    def __init__(
        self, lengths: Array, segments: list[Straight | Arc | Quintic], turning: Orientations
    ) -> None:
        ends = np.cumsum(lengths)
        self.length = float(ends[-1])
        self.angle = 0.0
        self.marks: list[float] = [0.0, *(ends / ends[-1]).tolist()]
        self.marks[-1] = 1.0
        self._segments, self._turning = segments, turning

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        index = min(bisect_right(self.marks, s), len(self._segments)) - 1
        low, high = self.marks[index], self.marks[index + 1]
        segment, t = self._segments[index], min(1.0, (s - low) / (high - low))
        if isinstance(segment, Quintic):
            x, y, z = segment.at(t)
            return x, y, z
        return segment.point(t)

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        return self._turning.at(s)


#: A segment shorter than this [m] only turns; one that also turns less than this [rad] is left out.
_SHORT, _STILL = 1e-5, 1e-6
#: Length that counts for a rotation in place [m/rad].
_LEVER = 0.1
#: A larger change of direction between two segments is a corner, where the arm rests [rad].
_CORNER = 2e-3
#: Samples of a segment: at least, at most, for each metre, and for each radian.
_FEW, _MANY, _PER_METRE, _PER_RADIAN = 17, 61, 200, 18
#: Samples of a segment that tell in which direction of a half turn the arm can follow.
_PER_SEGMENT = 60
_LOOKS = 9


@dataclass(slots=True)
class _SplineSegment:
    """A segment of a spline.

    Attributes:
        motion: what is followed.
        part: its number among the parts of the spline.
        start: position at its start, shape (3,) [m].
        end: position at its end.
        length: growth of the spline's parameter along it [m].
        line: of a straight or circular one; None: curved to fit its neighbours.
        turns: it only turns.
    """

    motion: SplineSegment
    part: int
    start: Array
    end: Array
    length: float
    line: Straight | Arc | None
    turns: bool

    def slope(self, s: float) -> Array:
        """Unit tangent of a straight or circular one, shape (3,)."""
        assert self.line is not None
        if isinstance(self.line, Straight):
            return (self.end - self.start) / self.length if not self.turns else np.zeros(3)
        return self.line.direction(s)

    def curvature(self, s: float) -> Array:
        """Second derivative of the position by the length, shape (3,) [1/m]."""
        return self.line.curvature(s) if isinstance(self.line, Arc) else np.zeros(3)


def plan_spline(robot: RobotModel, whole: seam.Spline, start: Array, tcp: Pose) -> Plan:
    """Plan a Cartesian spline block from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a segment makes no sense, or the path leaves the workspace or passes a singularity.
    """
    origin = Pose.from_matrix(forward(robot, start)) @ tcp
    segments, turning = _segments(whole, origin)
    if not segments:
        return Plan(whole, start, start)
    lengths = np.array([segment.length for segment in segments])
    curves = _curves(segments)

    def path_of(turning: Orientations) -> CartesianPath:
        return CartesianPath(robot, start, SplineGeometry(lengths, curves, turning), tcp, None)

    for half_turn, end in turning.half_turns:  # each in the direction in which the arm can follow
        other, looks = turning.other(half_turn), _PER_SEGMENT * len(segments)
        if not goes_on(robot, path_of(turning).at, start, end=end, looks=looks) and goes_on(
            robot, path_of(other).at, start, end=end, looks=looks
        ):
            turning = other
    path, geometry = path_of(turning), SplineGeometry(lengths, curves, turning)
    pieces = [
        Segment(
            SubPath(path, low, high),
            segment.length,
            segment_limits(segment.motion),
            _speed_limits(geometry, segment, low, high),
            _samples(geometry, segment, low, high),
        )
        for segment, (low, high) in zip(segments, pairwise(geometry.marks), strict=True)
    ]
    rests = [i for i, (one, two) in enumerate(pairwise(segments)) if _is_corner(one, two)]
    begins = _begins(len(whole.segments), [segment.part for segment in segments], geometry.marks)
    return timed(robot, whole, start, tcp, CompositePath(pieces), [*rests, len(pieces) - 1], begins)


def _samples(geometry: SplineGeometry, segment: _SplineSegment, low: float, high: float) -> int:
    """So many samples that its length and its rotation are seen."""
    turn = 2.0 * acos(min(1.0, abs(float(np.dot(geometry.quat(low), geometry.quat(high))))))
    return int(np.clip(max(segment.length * _PER_METRE, turn * _PER_RADIAN), _FEW, _MANY))


def _begins(parts: int, kept: Sequence[int], marks: Sequence[float]) -> list[float]:
    """Path parameter at which the parts begin, without the first; one without motion begins with the next."""
    return [marks[bisect_left(kept, part)] for part in range(1, parts)]


def _segments(whole: seam.Spline, origin: Pose) -> tuple[list[_SplineSegment], Orientations]:
    """The segments that move, and the orientation along them."""
    segments: list[_SplineSegment] = []
    here, quat, place = origin.xyz, origin.quat, 0.0
    known = [(place, quat)]
    for index, part in enumerate(whole.segments):
        check_numbers(part)
        if not isinstance(part, SplineSegment):
            raise PlanError(
                "planning", f"Can not plan motion: a spline cannot have a segment of kind {kind_of(part)}"
            )
        filled = inherited(part, whole)
        control = orientation_of(filled.orientation)
        if control.type == "joint" or control.reference == "path":
            raise PlanError(
                "planning",
                f"Can not plan motion: segment {index + 1} of the spline: orientation must be variable, constant or "
                f"ignored, relative to the base; got {control.type} relative to the {control.reference}",
            )
        target = pose_of(filled.end if isinstance(filled, seam.Circ) else filled.target)
        goal = target.quat if control.type == "variable" else quat
        segment = _segment(filled, here, target.xyz, Pose(here, quat).angle_to(Pose(here, goal)), index)
        if segment is not None:
            segments.append(segment)
            here, quat, place = target.xyz, goal, place + segment.length
            if control.type != "ignore":
                known.append((place, quat))
    if known[-1][0] < place or not segments:
        known.append((place or 1.0, quat))
    return segments, Orientations(
        np.array([p for p, _ in known]) / (place or 1.0), np.array([q for _, q in known])
    )


def _segment(
    segment: SplineSegment, here: Array, end: Array, angle: float, index: int
) -> _SplineSegment | None:
    chord = float(np.linalg.norm(end - here))
    if isinstance(segment, seam.Circ):
        try:
            arc = Arc(here, np.array(segment.via.xyz), end)
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (segment {index + 1} of the spline)") from None
        return _SplineSegment(segment, index, here, end, arc.length, arc, False)
    none = np.array([0.0, 0.0, 0.0, 1.0])
    if chord < _SHORT:
        if angle < _STILL:
            return None
        return _SplineSegment(
            segment, index, here, end, _LEVER * angle, Straight(here, end, Slerp(none, none)), True
        )
    line = Straight(here, end, Slerp(none, none)) if isinstance(segment, seam.Lin) else None
    return _SplineSegment(segment, index, here, end, chord, line, False)


def _is_corner(one: _SplineSegment, two: _SplineSegment) -> bool:
    if one.turns or two.turns:
        return True
    if one.line is None or two.line is None:
        return False
    return float(np.linalg.norm(one.slope(1.0) - two.slope(0.0))) > _CORNER


def _curves(segments: list[_SplineSegment]) -> list[Straight | Arc | Quintic]:
    """The curve of each segment; runs of curved ones continue tangent and curvature of their neighbours."""
    result: list[Straight | Arc | Quintic] = []
    index = 0
    while index < len(segments):
        line = segments[index].line
        if line is not None:
            result.append(line)
            index += 1
            continue
        last = index
        while last + 1 < len(segments) and segments[last + 1].line is None:
            last += 1
        before = segments[index - 1] if index and not segments[index - 1].turns else None
        after = segments[last + 1] if last + 1 < len(segments) and not segments[last + 1].turns else None
        run = segments[index : last + 1]
        points = np.array([run[0].start, *(segment.end for segment in run)])
        lengths = np.array([segment.length for segment in run])
        slope, curvature = slopes(
            points,
            lengths,
            None if before is None else before.slope(1.0),
            None if after is None else after.slope(0.0),
        )
        curvature[0] = 0.0 if before is None else before.curvature(1.0)
        curvature[-1] = 0.0 if after is None else after.curvature(0.0)
        ends = list(zip(points, slope, curvature, strict=True))
        result += [Quintic(h, a, b) for h, (a, b) in zip(lengths.tolist(), pairwise(ends), strict=True)]
        index = last + 1
    return result


def _speed_limits(
    geometry: SplineGeometry, segment: _SplineSegment, low: float, high: float
) -> tuple[float, ...]:
    """Largest speed of the spline's parameter that the program allows on a segment, at even samples [m/s]."""
    speed = or_default(segment.motion.dynamics.velocity, CARTESIAN_DEFAULT[0])
    turn = or_default(segment.motion.dynamics.orientation_velocity, ORIENTATION_DEFAULT[0])
    result = []
    step = (high - low) * 1e-3
    for fraction in np.linspace(0.0, 1.0, _LOOKS).tolist():
        s = min(max(low + fraction * (high - low), low + step), high - step)
        a, b = np.array(geometry.point(s - step)), np.array(geometry.point(s + step))
        p, q = np.array(geometry.quat(s - step)), np.array(geometry.quat(s + step))
        length = 2 * step * geometry.length
        slope = float(np.linalg.norm(b - a)) / length
        spin = 4 * float(np.arcsin(min(1.0, float(np.linalg.norm(q - p)) / 2))) / length
        result.append(min(UNBOUND, speed / max(slope, 1e-9), turn / max(spin, 1e-9)))
    return tuple(result)


def plan_joint_spline(robot: RobotModel, whole: seam.JointSpline, start: Array, tcp: Pose) -> Plan:
    """Plan a spline through joint positions from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a point is outside the limits or not reachable, or the curve between two leaves the limits.
    """
    points, lengths, kept, limits = [start], [], [], []
    for index, part in enumerate(whole.points):
        check_numbers(part)
        if not isinstance(part, JointMotion):
            raise PlanError(
                "planning",
                f"Can not plan motion: a joint spline cannot have a segment of kind {kind_of(part)}",
            )
        filled = inherited(part, whole)
        try:
            target = joint_target(robot, filled, points[-1], tcp)
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (point {index + 1} of the spline)") from None
        fastest = robot.dq_max * fractions(filled.dynamics.velocity)
        length = float((np.abs(target - points[-1]) / fastest).max())
        if length < _STILL:
            continue
        points.append(target)
        lengths.append(length)
        kept.append(index)
        limits.append(segment_limits(filled))
    if not kept:
        return Plan(whole, start, start)
    path = JointCurve(np.array(points), np.array(lengths))
    marks = [0.0, *(np.cumsum(lengths) / sum(lengths)).tolist()]
    pieces = [
        Segment(SubPath(path, low, min(1.0, high)), length, limit, (UNBOUND, UNBOUND), 33)
        for limit, length, (low, high) in zip(limits, lengths, pairwise(marks), strict=True)
    ]
    begins = _begins(len(whole.points), kept, marks)
    return timed(robot, whole, start, tcp, CompositePath(pieces), [len(pieces) - 1], begins)
