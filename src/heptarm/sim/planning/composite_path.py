"""Paths put together from pieces, and what bounds the speed along them."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, quaternion
from heptarm.values.robot import RobotModel
from heptarm.virtual.order import PlanError
from heptarm.virtual.path import JointPath
from heptarm.virtual.profile import Rest, TimeLaw, brake
from heptarm.virtual.timing import Course, Relay

#: More than this between two samples is a jump to another branch [rad].
LARGEST_STEP = 0.35
_STENCIL = 7
#: Of its speed, where it does not matter any more.
_BARELY = 1e-3
#: How much more jerk that may take than it needs.
_SOONER = 1.05


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a program allows on a piece, beside its nominal speed.

    Attributes:
        joint_velocity: fractions of the axes' maxima, shape (7,).
        joint_acceleration: likewise.
        joint_jerk: likewise.
        line: acceleration and jerk of the moved frame [m/s², m/s³]; infinite: only the joints count.
        turn: of its rotation [rad/s², rad/s³].
    """

    joint_velocity: Array
    joint_acceleration: Array
    joint_jerk: Array
    line: tuple[float, float] = (inf, inf)
    turn: tuple[float, float] = (inf, inf)

    def least(self, other: Bounds) -> Bounds:
        """The stricter of two, each by each."""
        return Bounds(
            np.minimum(self.joint_velocity, other.joint_velocity),
            np.minimum(self.joint_acceleration, other.joint_acceleration),
            np.minimum(self.joint_jerk, other.joint_jerk),
            (min(self.line[0], other.line[0]), min(self.line[1], other.line[1])),
            (min(self.turn[0], other.turn[0]), min(self.turn[1], other.turn[1])),
        )


@dataclass(frozen=True, slots=True)
class Piece:
    """Part of a chain.

    Attributes:
        path: over its own parameter in [0, 1].
        length: what the chain's parameter grows by on it.
        bounds: what the program allows.
        pace: largest speed of the chain's parameter, at samples that are evenly spaced.
        samples: how many to take.
    """

    path: JointPath
    length: float
    bounds: Bounds
    pace: tuple[float, ...] = (1.0, 1.0)
    samples: int = 61


class Chain:
    """Path over s in [0, 1] made of pieces.

    Args:
        pieces: one after the other; each begins where the one before it ends, in position, slope and curvature,
            unless the arm rests there.

    Attributes:
        marks: s at which each piece begins, and 1.
    """

    def __init__(self, pieces: list[Piece]) -> None:
        self.pieces = pieces
        ends = np.cumsum([piece.length for piece in pieces])
        self.total = float(ends[-1])
        self.marks: list[float] = [0.0, *(ends / self.total).tolist()]
        self.marks[-1] = 1.0

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """
        index = min(bisect_right(self.marks, s), len(self.pieces)) - 1
        low, high = self.marks[index], self.marks[index + 1]
        return self.pieces[index].path.at(min(1.0, (s - low) / (high - low)), near)


class Stretch:
    """Part of a path."""

    __slots__ = ("_first", "_path", "_way")

    def __init__(self, path: JointPath, first: float, last: float) -> None:
        self._path, self._first, self._way = path, first, last - first

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad]."""
        return self._path.at(self._first + s * self._way, near)


@dataclass(frozen=True, slots=True)
class Surveyed:
    """Samples of a chain.

    Attributes:
        q: of each piece, shapes (n, 7) [rad].
        poses: of the moved frame, as positions (n, 3) [m] and quaternions (n, 4).
    """

    q: list[Array]
    poses: list[tuple[Array, Array]]


def survey(robot: RobotModel, chain: Chain, start: Array, tcp: Pose) -> Surveyed:
    """Go along a chain once.

    Raises:
        PlanError: it leaves the workspace or the joints' limits, or would have to jump.
    """
    joints, poses, near = [], [], start
    for index, piece in enumerate(chain.pieces):
        seen = []
        for k in range(piece.samples):
            share = 100 * (chain.marks[index] + (chain.marks[index + 1] - chain.marks[index]) * k / piece.samples)
            try:
                q = piece.path.at(k / (piece.samples - 1), near)
            except Unreachable as error:
                raise PlanError(
                    "unreachable", f"Can not plan motion: the path is not reachable at {share:.0f} %: {error.text}"
                ) from None
            step = np.abs(q - near)
            if step.max() > LARGEST_STEP:
                raise PlanError(
                    "planning",
                    f"Can not plan motion: A{int(step.argmax()) + 1} would have to jump at {share:.0f} % of the path "
                    "(singularity)",
                )
            near = q
            seen.append(q)
        joints.append(np.array(seen))
        frames = [forward(robot, q) for q in seen]
        places = np.array([f[:3, :3] @ tcp.xyz + f[:3, 3] for f in frames])
        poses.append((places, np.array([quaternion(f[:3, :3]) for f in frames])))
    return Surveyed(joints, poses)


def course(robot: RobotModel, chain: Chain, seen: Surveyed, first: int, last: int) -> Course:
    """What bounds the speed along the pieces first to last - 1 of a chain; where two meet there are two samples."""
    columns: list[list[Array]] = [[] for _ in range(8)]
    for index in range(first, last):
        piece, low = chain.pieces[index], chain.marks[index]
        n, span = piece.samples, chain.marks[index + 1] - chain.marks[index]
        step = span / (n - 1)
        places, quats = seen.poses[index]
        values = np.column_stack([seen.q[index], places, _turned(quats)])
        slopes = [matrix @ values / step**k for k, matrix in enumerate(_derivatives(n), start=1)]
        line, turn = piece.bounds.line, piece.bounds.turn
        pace = np.interp(np.linspace(0, 1, n), np.linspace(0, 1, len(piece.pace)), piece.pace) / chain.total
        rows = (
            np.concatenate([robot.dq_max * piece.bounds.joint_velocity, [inf] * 4]),
            np.concatenate(
                [robot.ddq_max * piece.bounds.joint_acceleration, [line[0]] * 3, [turn[0]]]
            ),
            np.concatenate([robot.dddq_max * piece.bounds.joint_jerk, [line[1]] * 3, [turn[1]]]),
        )
        new = [low + step * np.arange(n), *slopes, pace, *(np.tile(row, (n, 1)) for row in rows)]
        for column, part in zip(columns, new, strict=True):
            column.append(part)
    merged = [np.concatenate(column) for column in columns]
    none = [inf] * 4
    return Course(
        merged[0],
        merged[1],
        merged[2],
        merged[3],
        merged[4],
        merged[5],
        merged[6],
        merged[7],
        np.concatenate([robot.ddq_max, none]),
        np.concatenate([robot.dddq_max, none]),
    )


@lru_cache(maxsize=64)
def _derivatives(count: int) -> tuple[Array, Array, Array]:
    """Matrices that make the first three derivatives of even samples, from seven neighbours each, unit steps."""
    result = np.zeros((3, count, count))
    for index in range(count):
        low = min(max(0, index - _STENCIL // 2), count - _STENCIL)
        powers = np.arange(low - index, low - index + _STENCIL)[None, :] ** np.arange(_STENCIL)[:, None]
        weights = np.linalg.inv(powers.astype(float))  # row j: the share of each power in sample j
        for order, factor in ((1, 1.0), (2, 2.0), (3, 6.0)):
            result[order - 1, index, low : low + _STENCIL] = factor * weights[:, order]
    return result[0], result[1], result[2]


def _turned(quats: Array) -> Array:
    """Angle turned by since the first of n quaternions, shape (n,) [rad]."""
    signs = np.where(np.einsum("ij,ij->i", quats[1:], quats[:-1]) < 0, -1.0, 1.0)
    chords = np.linalg.norm(quats[1:] * signs[:, None] - quats[:-1], axis=1)
    return np.concatenate([[0.0], np.cumsum(4 * np.arcsin(np.minimum(1.0, chords / 2)))])


@dataclass(frozen=True, slots=True)
class Halts:
    """A path with places where the arm rests on its way.

    Attributes:
        marks: s of the rests, ascending; the last is 1.
        courses: what bounds the speed from one rest to the next.
        law: s over time at full speed.
    """

    marks: tuple[float, ...]
    courses: tuple[Course, ...]
    law: Relay

    def brake(self, time: float, scale: float, rate: float) -> TimeLaw:
        """How it comes to rest.

        Args:
            time: how far it has come on its law [s].
            scale: share of the law's speed that it goes at.
            rate: how fast that share changes [1/s].
        """
        s, speed, acceleration = self.law.at(time)
        leg = self._leg(s)
        state = (s, speed * scale, acceleration * scale * scale + speed * rate)
        limits = self.courses[leg].brakes(s, state[1])
        if state[1] > 0.0 > state[2]:  # it brakes already: end that early enough not to turn round
            limits = replace(limits, jerk=max(limits.jerk, _SOONER * state[2] ** 2 / (2 * state[1])))
        stop = brake(state, limits)
        if stop.at(stop.duration)[0] <= self.marks[leg] or scale < _BARELY:
            return stop
        return Rest(self.law, time, self.law.rest(time), scale)  # it would rest sooner anyway

    def _leg(self, s: float) -> int:
        return min(bisect_right(self.marks, s), len(self.courses) - 1)
