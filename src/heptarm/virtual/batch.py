"""Plans a batch: motions one after the other, blended where they say so.

Every motion's path is measured in the time that it would take at its programmed speed, so that a blend goes over
from one speed to the other as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isnan

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.virtual.blend import GeometryBlend, JointBlend, zone
from heptarm.virtual.chain import Bounds, Chain, Halts, Piece, Stretch, course, survey
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.path import CartesianPath, JointLine
from heptarm.virtual.planner import (
    CARTESIAN_DEFAULT,
    ORIENTATION_DEFAULT,
    Plan,
    cartesian_limits,
    cartesian_path,
    check_speeds,
    joint_target,
)
from heptarm.virtual.profile import Limits
from heptarm.virtual.timing import Relay, paced
from heptarm.virtual.way import Way

_LINES = ("lin", "lin_rel", "circ")
#: Samples of a part to find its blending zones with.
_LOOKS = 65
#: A blend shorter than this at programmed speed is a halt [s].
_SHORTEST = 2e-3
#: Share of a motion that a blend may take where another takes the other end of it.
_HALF = 0.5
_STILL = 1e-7


@dataclass(slots=True)
class _Part:
    """A motion of a batch.

    Attributes:
        path: joint positions; None: it is there already.
        time: that it takes at programmed speed [s].
        bounds: what it allows.
        end: joint positions there, shape (7,) [rad].
        places: of the moved frame, shape (n, 3) [m].
        quats: likewise, shape (n, 4).
        begin: share that the blend at its beginning takes.
        finish: share that the blend at its end takes.
    """

    path: CartesianPath | JointLine | None
    time: float
    bounds: Bounds
    end: Array
    places: Array
    quats: Array
    begin: float = 0.0
    finish: float = 0.0


def bounds_of(order: Order) -> Bounds:
    """What an order allows, beside its speed."""
    joints = Bounds(np.array(order.joint_velocity), np.array(order.joint_acceleration), np.array(order.joint_jerk))
    if order.kind not in (*_LINES, "spl"):
        return joints
    line = _defaulted((order.cart_acceleration, order.cart_jerk), CARTESIAN_DEFAULT[1:])
    turn = _defaulted((order.ori_acceleration, order.ori_jerk), ORIENTATION_DEFAULT[1:])
    return replace(joints, line=line, turn=turn)


def _defaulted(values: tuple[float, float], defaults: Sequence[float]) -> tuple[float, float]:
    one, other = (default if isnan(value) else value for value, default in zip(values, defaults, strict=True))
    return one, other


def plan_batch(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan a batch from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: one of its motions cannot be planned; the text says which.
    """
    parts: list[_Part] = []
    here = start
    for index, one in enumerate(order.parts):
        try:
            check_speeds(one)
            part = _part(robot, replace(one, tcp=order.tcp), here)
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (motion {index + 1} of the batch)") from None
        parts.append(part)
        here = part.end
    for before, after, one in zip(parts, parts[1:], order.parts, strict=False):
        _share(before, after, one.blending)
    chain, rests, marks = _chained(parts)
    if chain is None:
        return Plan(order, start, start, None, None, Limits(1.0, 1.0, 1.0), marks=(0.0,) * (len(parts) - 1))
    return timed(robot, order, start, chain, rests, marks)


def timed(
    robot: RobotModel, order: Order, start: Array, chain: Chain, rests: Sequence[int], marks: Sequence[float]
) -> Plan:
    """The plan that goes along a chain.

    Args:
        robot: the robot.
        order: what was asked.
        start: joint positions, shape (7,) [rad].
        chain: the path.
        rests: pieces behind which the arm rests, ascending; the last piece is the last of them.
        marks: s at which the parts begin, without the first.

    Raises:
        PlanError: the path cannot be led.
    """
    seen = survey(robot, chain, start, Pose.of(order.tcp[:3], order.tcp[3:]))
    for q in seen.q:
        outside = (q < robot.q_min - 1e-9) | (q > robot.q_max + 1e-9)
        if outside.any():
            axes = " ".join(f"A{i + 1}" for i in np.flatnonzero(outside.any(axis=0)))
            raise PlanError("joint_limit", f"Can not plan motion: Command Position violates limit {axes} on the path")
    edges = [0, *(index + 1 for index in rests)]
    courses = tuple(course(robot, chain, seen, a, b) for a, b in pairwise(edges))
    law = Relay([paced(one) for one in courses])
    halts = Halts(tuple(chain.marks[edge] for edge in edges[1:]), courses, law)
    shares = [np.linspace(low, high, len(q)) for q, (low, high) in zip(seen.q, pairwise(chain.marks), strict=True)]
    way = Way.through(np.concatenate(shares), np.concatenate([places for places, _ in seen.poses]))
    return Plan(order, start, seen.q[-1][-1], chain, law, Limits(1.0, 1.0, 1.0), halts, tuple(marks), way)


def _part(robot: RobotModel, order: Order, start: Array) -> _Part:
    path: CartesianPath | JointLine | None
    if order.kind == "ptp":
        end = joint_target(robot, order, start)
        path = JointLine(start, end)
        way = np.maximum(np.abs(path.way), 1e-12)
        time = 1.0 / float((robot.dq_max * order.joint_velocity / way).min())
        still = float(np.abs(path.way).max()) < _STILL
    elif order.kind in _LINES:
        path = cartesian_path(robot, order, start)
        time = 1.0 / cartesian_limits(order, path).velocity
        still = path.length < _STILL and path.angle < _STILL and isnan(order.redundancy[0])
        if not still and path.length < _STILL and path.angle < _STILL:
            time = 1.0  # only the elbow moves: as fast as the joints allow, see its bounds
    else:
        raise PlanError("planning", f"Can not plan motion: a batch cannot have a motion of kind {order.kind!r}")
    if still:
        return _Part(None, 0.0, bounds_of(order), start, np.zeros((0, 3)), np.zeros((0, 4)))
    tcp = Pose.of(order.tcp[:3], order.tcp[3:])
    piece = Piece(path, 1.0, bounds_of(order), samples=_LOOKS)
    seen = survey(robot, Chain([piece]), start, tcp)
    ((places, quats),) = seen.poses
    return _Part(path, time, bounds_of(order), seen.q[0][-1], places, quats)


def _share(before: _Part, after: _Part, blending: tuple[float, float, float]) -> None:
    """Give the blend of two motions its shares of both, equally long at programmed speed."""
    if before.path is None or after.path is None or not any(blending):
        return
    most = min(
        before.time * min(zone(before.places, before.quats, blending, backwards=True), 1.0 - before.begin),
        after.time * min(zone(after.places, after.quats, blending, backwards=False), _HALF),
    )
    if most >= _SHORTEST:
        before.finish, after.begin = most / before.time, most / after.time


def _chained(parts: list[_Part]) -> tuple[Chain | None, list[int], list[float]]:
    """The chain, the pieces behind which it rests, and where the parts begin."""
    pieces: list[Piece] = []
    rests: list[int] = []
    begins: list[tuple[int, float]] = []  # piece and share of it
    for index, part in enumerate(parts):
        blended = part.begin > 0.0
        if blended:
            begins.append((len(pieces) - 1, 0.5))
        else:
            if pieces and part.path is not None:
                rests.append(len(pieces) - 1)
            begins.append((len(pieces), 0.0))
        if part.path is None:
            continue
        whole = 1.0 - part.begin - part.finish
        if whole * part.time > _SHORTEST / 10:
            stretch = Stretch(part.path, part.begin, 1.0 - part.finish)
            pieces.append(Piece(stretch, whole * part.time, part.bounds, samples=max(17, int(81 * whole))))
        if part.finish > 0.0:
            pieces.append(_blend(part, parts[index + 1]))
    if not pieces:
        return None, [], []
    chain = Chain(pieces)
    rests.append(len(pieces) - 1)
    marks = [
        1.0 if piece >= len(pieces) else chain.marks[piece] + share * (chain.marks[piece + 1] - chain.marks[piece])
        for piece, share in begins[1:]
    ]
    return chain, rests, marks


def _blend(before: _Part, after: _Part) -> Piece:
    one, other = before.path, after.path
    assert one is not None and other is not None
    length, bounds = 2 * before.finish * before.time, before.bounds.least(after.bounds)
    if isinstance(one, CartesianPath) and isinstance(other, CartesianPath) and one.status == other.status:
        geometry = GeometryBlend(one.geometry, other.geometry, before.finish, after.begin)
        return Piece(one.joined(other, geometry, before.finish, after.begin), length, bounds, samples=41)
    path = JointBlend(one, other, before.finish, after.begin, before.end)
    loose = replace(bounds, line=(inf, inf), turn=(inf, inf))
    return Piece(path, length, loose, samples=41)
