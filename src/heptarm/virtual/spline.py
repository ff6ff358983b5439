"""Plans splines: blocks of segments in space or of points in joint space, gone through without a halt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isnan

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.virtual.arc import Arc
from heptarm.virtual.batch import bounds_of, timed
from heptarm.virtual.chain import Chain, Piece, Stretch
from heptarm.virtual.curve import JointCurve, Orientations, Quintic, Track, slopes
from heptarm.virtual.geometry import Slerp, Straight
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.path import CartesianPath
from heptarm.virtual.planner import CARTESIAN_DEFAULT, ORIENTATION_DEFAULT, Plan, check_speeds, joint_target
from heptarm.virtual.profile import Limits

#: A segment shorter than this [m] only turns; one that turns less than this [rad] besides is left out.
_SHORT, _STILL = 1e-5, 1e-6
#: Length that a turn on the spot counts for [m/rad].
_LEVER = 0.1
#: A greater change of direction between two segments is a corner, where the arm rests [rad].
_CORNER = 2e-3
#: Samples of a segment: at least, at most, and for each metre.
_FEW, _MANY, _PER_METRE = 17, 61, 200
_LOOKS = 9
_UNBOUND = 1e9


@dataclass(slots=True)
class _Segment:
    """A segment of a spline.

    Attributes:
        order: what it was told.
        start: where it begins, shape (3,) [m].
        end: where it ends.
        length: what the spline's parameter grows by on it [m].
        line: a straight or round one; None: curved as its neighbours want it.
        turns: it only turns.
    """

    order: Order
    start: Array
    end: Array
    length: float
    line: Straight | Arc | None
    turns: bool

    def slope(self, s: float) -> Array:
        """Unit direction of a straight or round one, shape (3,)."""
        assert self.line is not None
        if isinstance(self.line, Straight):
            return (self.end - self.start) / self.length if not self.turns else np.zeros(3)
        return self.line.direction(s)

    def curvature(self, s: float) -> Array:
        """Second derivative of the place by the length, shape (3,) [1/m]."""
        return self.line.bend(s) if isinstance(self.line, Arc) else np.zeros(3)


def plan_spline(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan a Cartesian spline block from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a segment makes no sense, or the path cannot be led.
    """
    tcp = Pose.of(order.tcp[:3], order.tcp[3:])
    origin = Pose.from_matrix(forward(robot, start)) @ tcp
    segments, turning = _segments(order, origin)
    if not segments:
        return Plan(order, start, start, None, None, Limits(1.0, 1.0, 1.0))
    lengths = np.array([segment.length for segment in segments])
    track = Track(lengths, _drawn(segments), turning)
    path = CartesianPath(robot, start, track, tcp, None)
    pieces = [
        Piece(
            Stretch(path, low, high),
            segment.length,
            bounds_of(segment.order),
            _paces(track, segment, low, high),
            int(np.clip(segment.length * _PER_METRE, _FEW, _MANY)),
        )
        for segment, (low, high) in zip(segments, pairwise(track.marks), strict=True)
    ]
    rests = [i for i, (one, two) in enumerate(pairwise(segments)) if _is_corner(one, two)]
    begins = _begins(order.parts, [segment.order for segment in segments], track.marks)
    return timed(robot, order, start, Chain(pieces), [*rests, len(pieces) - 1], begins)


def _begins(parts: Sequence[Order], kept: Sequence[Order], marks: Sequence[float]) -> list[float]:
    """Path parameter at which the parts begin, without the first; one that leads nowhere begins with the next."""
    result, place = [], 0
    for one in parts:
        result.append(marks[place])
        if place < len(kept) and kept[place] is one:
            place += 1
    return result[1:]


def _segments(order: Order, origin: Pose) -> tuple[list[_Segment], Orientations]:
    """The segments that lead somewhere, and the turning along them."""
    segments: list[_Segment] = []
    here, quat, place = origin.xyz, origin.quat, 0.0
    known = [(place, quat)]
    for index, one in enumerate(order.parts):
        check_speeds(one)
        if one.kind not in ("spl", "lin", "circ") or one.pose is None:
            raise PlanError("planning", f"Can not plan motion: a spline cannot have a segment of kind {one.kind!r}")
        led = one.orientation
        if led.type == "joint" or led.reference == "path":
            raise PlanError(
                "planning",
                f"Can not plan motion: segment {index + 1} of the spline: here its orientation is variable, constant "
                f"or ignored relative to the base, not {led.type} relative to the {led.reference}",
            )
        target = Pose.of(one.pose[:3], one.pose[3:])
        wanted = target.quat if led.type == "variable" else quat
        segment = _segment(one, here, target.xyz, Pose(here, quat).angle_to(Pose(here, wanted)), index)
        if segment is not None:
            segments.append(segment)
            here, quat, place = target.xyz, wanted, place + segment.length
            if led.type != "ignore":
                known.append((place, quat))
    if known[-1][0] < place or not segments:
        known.append((place or 1.0, quat))
    return segments, Orientations(
        np.array([p for p, _ in known]) / (place or 1.0), np.array([q for _, q in known])
    )


def _segment(one: Order, here: Array, end: Array, angle: float, index: int) -> _Segment | None:
    chord = float(np.linalg.norm(end - here))
    if one.kind == "circ":
        assert one.via is not None
        try:
            arc = Arc(here, np.array(one.via[:3]), end)
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (segment {index + 1} of the spline)") from None
        return _Segment(one, here, end, arc.length, arc, False)
    none = np.array([0.0, 0.0, 0.0, 1.0])
    if chord < _SHORT:
        if angle < _STILL:
            return None
        return _Segment(one, here, end, _LEVER * angle, Straight(here, end, Slerp(none, none)), True)
    line = Straight(here, end, Slerp(none, none)) if one.kind == "lin" else None
    return _Segment(one, here, end, chord, line, False)


def _is_corner(one: _Segment, two: _Segment) -> bool:
    if one.turns or two.turns:
        return True
    if one.line is None or two.line is None:
        return False
    return float(np.linalg.norm(one.slope(1.0) - two.slope(0.0))) > _CORNER


def _drawn(segments: list[_Segment]) -> list[Straight | Arc | Quintic]:
    """Every segment's way; runs of curved ones take over direction and curvature of their neighbours."""
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
        points = np.array([run[0].start, *(one.end for one in run)])
        lengths = np.array([one.length for one in run])
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


def _paces(track: Track, segment: _Segment, low: float, high: float) -> tuple[float, ...]:
    """Largest speed of the spline's parameter that the segment's program allows, at even samples [m/s]."""
    speed = _or(segment.order.cart_velocity, CARTESIAN_DEFAULT[0])
    turn = _or(segment.order.ori_velocity, ORIENTATION_DEFAULT[0])
    result = []
    step = (high - low) * 1e-3
    for share in np.linspace(0.0, 1.0, _LOOKS).tolist():
        s = min(max(low + share * (high - low), low + step), high - step)
        a, b = np.array(track.point(s - step)), np.array(track.point(s + step))
        p, q = np.array(track.quat(s - step)), np.array(track.quat(s + step))
        length = 2 * step * track.length
        slope = float(np.linalg.norm(b - a)) / length
        spin = 4 * float(np.arcsin(min(1.0, float(np.linalg.norm(q - p)) / 2))) / length
        result.append(min(_UNBOUND, speed / max(slope, 1e-9), turn / max(spin, 1e-9)))
    return tuple(result)


def _or(value: float, default: float) -> float:
    return default if isnan(value) else value


def plan_joint_spline(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan a spline through joint positions from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a point is outside the limits or not reachable, or the curve between them leaves the limits.
    """
    points, lengths, orders = [start], [], []
    for index, one in enumerate(order.parts):
        check_speeds(one)
        if one.kind != "ptp":
            raise PlanError(
                "planning", f"Can not plan motion: a joint spline cannot have a segment of kind {one.kind!r}"
            )
        try:
            target = joint_target(robot, one, points[-1])
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (point {index + 1} of the spline)") from None
        length = float((np.abs(target - points[-1]) / (robot.dq_max * one.joint_velocity)).max())
        if length < _STILL:
            continue
        points.append(target)
        lengths.append(length)
        orders.append(one)
    if not orders:
        return Plan(order, start, start, None, None, Limits(1.0, 1.0, 1.0))
    path = JointCurve(np.array(points), np.array(lengths))
    marks = [0.0, *(np.cumsum(lengths) / sum(lengths)).tolist()]
    pieces = [
        Piece(Stretch(path, low, min(1.0, high)), length, bounds_of(one), (_UNBOUND, _UNBOUND), 33)
        for one, length, (low, high) in zip(orders, lengths, pairwise(marks), strict=True)
    ]
    return timed(robot, order, start, Chain(pieces), [len(pieces) - 1], _begins(order.parts, orders, marks))
