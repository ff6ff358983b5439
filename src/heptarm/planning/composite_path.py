"""Paths of several segments: their samples, and the limits along them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import inf, sqrt, tau

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.batch import forward_batch
from heptarm.planning.motion import PlanError
from heptarm.planning.path import JointPath, Sequential
from heptarm.planning.time_scaling import PathConstraints
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

#: A larger step between two samples is a jump to another branch of the inverse kinematics [rad].
LARGEST_STEP = 0.35
_STENCIL = 7
#: Limit of a speed that the program does not bound.
UNBOUND = 1e9


@dataclass(frozen=True, slots=True)
class SegmentLimits:
    """What a program allows on a segment, beside its speed along the path.

    Attributes:
        joint_velocity: fractions of the axes' maxima, shape (7,).
        joint_acceleration: likewise.
        joint_jerk: likewise.
        line: acceleration and jerk of the tool frame [m/s², m/s³]; infinite: only the joints are limited.
        turn: of its rotation [rad/s², rad/s³].
    """

    joint_velocity: Array
    joint_acceleration: Array
    joint_jerk: Array
    line: tuple[float, float] = (inf, inf)
    turn: tuple[float, float] = (inf, inf)

    def least(self, other: SegmentLimits) -> SegmentLimits:
        """The stricter of two, each by each."""
        return SegmentLimits(
            np.minimum(self.joint_velocity, other.joint_velocity),
            np.minimum(self.joint_acceleration, other.joint_acceleration),
            np.minimum(self.joint_jerk, other.joint_jerk),
            (min(self.line[0], other.line[0]), min(self.line[1], other.line[1])),
            (min(self.turn[0], other.turn[0]), min(self.turn[1], other.turn[1])),
        )


@dataclass(frozen=True, slots=True)
class Segment:
    """Part of a composite path.

    Attributes:
        path: over its own parameter in [0, 1].
        length: growth of the composite path's parameter along it.
        limits: what the program allows.
        speed_limit: largest speed of the composite path's parameter, at evenly spaced samples.
        samples: how many to take.
    """

    path: JointPath
    length: float
    limits: SegmentLimits
    speed_limit: tuple[float, ...] = (1.0, 1.0)
    samples: int = 61


class CompositePath(Sequential):
    """Path over s in [0, 1] made of segments.

    Args:
        segments: one after the other; each begins where the one before it ends, in position, slope and curvature,
            unless the arm rests there.

    Attributes:
        marks: s at which each segment begins, and 1.
    """

    def __init__(self, segments: list[Segment]) -> None:
        self.segments = segments
        ends = np.cumsum([segment.length for segment in segments])
        self.total = float(ends[-1])
        self.marks: list[float] = [0.0, *(ends / self.total).tolist()]
        self.marks[-1] = 1.0

    @property
    def lines(self) -> Array | None:
        """The straight lines in joint space that it consists of, shape (n, 16); None: not only of such lines.

        In a row: s at both ends, joint positions at the first one, and their span.
        """
        rows = []
        for segment, ends in zip(self.segments, pairwise(self.marks), strict=True):
            line = segment.path.line
            if line is None:
                return None
            rows.append((*ends, *line[0], *line[1]))
        return np.array(rows)

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """
        index = min(bisect_right(self.marks, s), len(self.segments)) - 1
        low, high = self.marks[index], self.marks[index + 1]
        return self.segments[index].path.at(min(1.0, (s - low) / (high - low)), near)


class SubPath:
    """The part of a path between two values of its parameter."""

    __slots__ = ("_first", "_path", "_span")

    def __init__(self, path: JointPath, first: float, last: float) -> None:
        self._path, self._first, self._span = path, first, last - first

    @property
    def line(self) -> tuple[Array, Array] | None:
        """See `JointPath`."""
        whole = self._path.line
        return None if whole is None else (whole[0] + self._first * whole[1], self._span * whole[1])

    @property
    def keeps_a3(self) -> bool:
        """See `JointPath`."""
        return self._path.keeps_a3

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad]."""
        return self._path.at(self._first + s * self._span, near)

    def samples(self, s: Array) -> Array | None:
        """See `JointPath`."""
        return self._path.samples(self._first + s * self._span)


@dataclass(frozen=True, slots=True)
class PathSamples:
    """Samples of a composite path.

    Attributes:
        q: of each segment, shapes (n, 7) [rad].
        positions: of the tool frame, shapes (n, 3) [m].
        rotations: of the flange, matrices, shapes (n, 3, 3).
        followed: whether they had to be computed one after the other.
    """

    q: list[Array]
    positions: list[Array]
    rotations: list[Array]
    followed: list[bool]


def check_limits(robot: RobotModel, q: Array, where: str = "") -> None:
    """Refuse joint positions that the robot cannot have; `where` goes into the error's text."""
    outside = [i for i in range(7) if not robot.q_min[i] - 1e-9 <= q[i] <= robot.q_max[i] + 1e-9]
    if outside:
        axes = " ".join(f"A{i + 1}" for i in outside)
        values = ", ".join(
            f"A{i + 1} = {value:.2f} deg of [{low:.0f}, {high:.0f}]"
            for i in outside
            for value, low, high in [np.degrees([q[i], robot.q_min[i], robot.q_max[i]])]
        )
        raise PlanError(
            "joint_limit", f"Can not plan motion: Command Position violates limit {axes}{where} ({values})"
        )


def sample(robot: RobotModel, path: CompositePath, start: Array, tcp: Pose) -> PathSamples:
    """Follow a path once from joint positions of shape (7,) [rad].

    Raises:
        PlanError: it leaves the workspace or the joint limits, or passes a singularity: what comes first on the way.
    """
    result, near = PathSamples([], [], [], []), start
    # an axis that is outside, after its drive has tripped, may come back
    lowest, highest = np.minimum(robot.q_min, start) - 1e-9, np.maximum(robot.q_max, start) + 1e-9

    def check(joints: Array) -> None:
        outside = ((joints < lowest) | (joints > highest)).any(axis=1)
        if outside.any():
            check_limits(robot, joints[int(outside.argmax())], " on the path")

    for segment, span in zip(path.segments, pairwise(path.marks), strict=True):
        fractions = np.linspace(0.0, 1.0, segment.samples)
        joints = segment.path.samples(fractions)
        result.followed.append(joints is None)
        if joints is None:
            joints = _followed(segment.path, near, fractions, span, check)
        check(joints)
        near = joints[-1]
        frames = forward_batch(robot, joints)
        result.q.append(joints)
        result.positions.append(frames[:, :3, :3] @ tcp.xyz + frames[:, :3, 3])
        result.rotations.append(frames[:, :3, :3])
    return result


def _followed(
    path: JointPath,
    near: Array,
    fractions: Array,
    span: tuple[float, float],
    check: Callable[[Array], None],
) -> Array:
    """Joint positions at fractions of a segment, each next to the one before, shape (n, 7) [rad].

    Args:
        path: of the segment.
        near: joint positions at its start, shape (7,) [rad].
        fractions: of it, shape (n,).
        span: s at which it begins and ends.
        check: refuses joint positions outside the limits, shape (n, 7).

    Raises:
        PlanError: see `sample`.
    """
    joints = np.empty((len(fractions), 7))
    for index, fraction in enumerate(fractions.tolist()):
        percent = 100 * (span[0] + (span[1] - span[0]) * fraction)
        try:
            joints[index] = path.at(fraction, near)
        except Unreachable as error:
            check(joints[:index])
            raise PlanError(
                "unreachable",
                f"Can not plan motion: the path is not reachable at {percent:.0f} %: {error.text}",
            ) from None
        # a joint that passes half a turn goes on: its limit is the reason why the path cannot be followed, not a jump
        joints[index] -= tau * np.round((joints[index] - near) / tau)
        step = np.abs(joints[index] - near)
        if step.max() > LARGEST_STEP:
            check(joints[:index])
            raise PlanError(
                "planning",
                f"Can not plan motion: A{int(step.argmax()) + 1} would have to jump at {percent:.0f} % of the path "
                "(singularity)",
            )
        near = joints[index]
    return joints


def constraints(
    robot: RobotModel, path: CompositePath, samples: PathSamples, first: int, last: int
) -> PathConstraints:
    """What bounds the motion along the segments first to last - 1; where two meet there are two samples."""
    columns: list[list[Array]] = [[] for _ in range(8)]
    none = [inf] * 4
    for index in range(first, last):
        segment, low = path.segments[index], path.marks[index]
        n, span = segment.samples, path.marks[index + 1] - path.marks[index]
        step = span / (n - 1)
        positions, turned = samples.positions[index], _turned(samples.rotations[index])
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
        values = np.column_stack([samples.q[index], positions, length, turned])
        slopes = [matrix @ values / step**k for k, matrix in enumerate(_derivatives(n), start=1)]
        line, turn, limits = segment.limits.line, segment.limits.turn, segment.limits
        given = np.linspace(0, 1, len(segment.speed_limit))
        fastest = np.interp(np.linspace(0, 1, n), given, segment.speed_limit) / path.total
        rows = (
            np.concatenate([robot.dq_max * limits.joint_velocity, [inf], none]),
            np.concatenate([robot.ddq_max * limits.joint_acceleration, [line[0]] * 4, [turn[0]]]),
            np.concatenate([robot.dddq_max * limits.joint_jerk, [line[1]] * 4, [turn[1]]]),
        )
        new = [low + step * np.arange(n), *slopes, fastest, *(np.tile(row, (n, 1)) for row in rows)]
        for column, part in zip(columns, new, strict=True):
            column.append(part)
    merged = [np.concatenate(column) for column in columns]
    merged.append(np.concatenate([robot.ddq_max, [inf], none]))
    merged.append(np.concatenate([robot.dddq_max, [inf], none]))
    return PathConstraints(*merged)


@lru_cache(maxsize=64)
def _derivatives(count: int) -> tuple[Array, Array, Array]:
    """Matrices that make the first three derivatives of even samples, from seven neighbours each, unit steps."""
    result = np.zeros((3, count, count))
    for index in range(count):
        low = min(max(0, index - _STENCIL // 2), count - _STENCIL)
        powers = np.arange(low - index, low - index + _STENCIL)[None, :] ** np.arange(_STENCIL)[:, None]
        weights = np.linalg.inv(powers.astype(float))  # row j: the weight of each power in sample j
        for order, factor in ((1, 1.0), (2, 2.0), (3, 6.0)):
            result[order - 1, index, low : low + _STENCIL] = factor * weights[:, order]
    return result[0], result[1], result[2]


def turns(rotations: Array, others: Array) -> Array:
    """Angles of n rotations to others, shapes (n, 3, 3) or broadcast to that; shape (n,) [rad].

    The norm of the difference of two rotation matrices is √8 times the sine of half the angle.
    """
    chords = np.linalg.norm(rotations - others, axis=(-2, -1))
    angles: Array = 2.0 * np.arcsin(np.minimum(1.0, chords / sqrt(8.0)))
    return angles


def _turned(rotations: Array) -> Array:
    """Angle turned by since the first of n rotations, shape (n,) [rad]."""
    return np.concatenate([[0.0], np.cumsum(turns(rotations[1:], rotations[:-1]))])
