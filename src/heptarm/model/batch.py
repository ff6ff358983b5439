"""Kinematics of many poses at once: forward kinematics, Jacobian, redundancy and inverse kinematics over arrays.

The formulas are those of `heptarm.model.kinematics` and `heptarm.model.inverse_kinematics`, which treat one pose at a
time. Here each number of theirs is an array over the poses. They are computed in chunks that fit into the cache of a
processor; the conversion of a chunk between rows and columns is part of the cost.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.model.inverse_kinematics import SINGULAR, raw
from heptarm.values.arrays import Array, finite_entries, instance, numbers
from heptarm.values.robot import RobotModel

#: Whole numbers, one for each pose.
Integers: TypeAlias = npt.NDArray[np.int64]
#: A vector for each pose of a chunk, shape (3, m).
_Vectors: TypeAlias = Array
#: Columns of a rotation for each pose of a chunk.
_Columns: TypeAlias = tuple[_Vectors, _Vectors, _Vectors]

#: Poses of a chunk: a dozen vectors of so many poses fit into half a megabyte.
_CHUNK = 2048
#: Solutions this far outside the joint limits count as inside, as in `inverse_kinematics.inside` [rad].
_ON_LIMIT = 1e-9
#: Squares of distances this far outside the reach are rounding errors [m²].
_ON_REACH = 1e-9


class RedundancyBatch(NamedTuple):
    """KUKA's redundancy of many joint positions; see `heptarm.Redundancy`.

    Attributes:
        e1: arm angles, shape (n,) [rad].
        status: bits 0-2, shape (n,).
        turn: bits 0-6, shape (n,).
    """

    e1: Array
    status: Integers
    turn: Integers


# --------------------------------------------------------------------------------------------------------- arguments


def _rows(value: npt.ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """A checked array of shape (n, *shape)."""
    wanted = f"({', '.join(('n', *map(str, shape)))})"
    given = numbers(value, name, f"numbers of shape {wanted}")
    if given.ndim != 1 + len(shape) or given.shape[1:] != shape:
        raise ShapeError(f"{name} must have shape {wanted}, got {given.shape}", parameter=name, value=value)
    return finite_entries(given, name)


def _for_each(value: npt.ArrayLike, count: int, name: str) -> Array:
    """One number for each of `count` poses, from as many or from one, shape (count,)."""
    given = finite_entries(numbers(value, name, f"a number or {count} numbers"), name)
    if given.shape not in ((), (count,)):
        raise ShapeError(
            f"{name} must be one number or have shape ({count},), got {given.shape}",
            parameter=name,
            value=value,
        )
    return np.broadcast_to(given, (count,))


def _chunks(count: int) -> Iterator[slice]:
    for first in range(0, count, _CHUNK):
        yield slice(first, min(first + _CHUNK, count))


# ----------------------------------------------------------------------------------------------------------- vectors


def _cross(a: _Vectors, b: _Vectors) -> _Vectors:
    result = np.empty_like(a)
    result[0] = a[1] * b[2] - a[2] * b[1]
    result[1] = a[2] * b[0] - a[0] * b[2]
    result[2] = a[0] * b[1] - a[1] * b[0]
    return result


def _dot(a: _Vectors, b: _Vectors) -> Array:
    result: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def _turn(u: _Vectors, v: _Vectors, c: Array, s: Array) -> tuple[_Vectors, _Vectors]:
    """Two columns of a rotation, turned towards each other: c u + s v and c v - s u."""
    return c * u + s * v, c * v - s * u


def _zy(ca: Array, sa: Array, cb: Array, sb: Array) -> _Columns:
    """Columns of Rz(a) Ry(b)."""
    x, y, z = np.empty((3, *ca.shape)), np.empty((3, *ca.shape)), np.empty((3, *ca.shape))
    x[0], x[1], x[2] = ca * cb, sa * cb, -sb
    y[0], y[1], y[2] = -sa, ca, 0.0
    z[0], z[1], z[2] = ca * sb, sa * sb, cb
    return x, y, z


class _Chain(NamedTuple):
    """Frames along the arm: after A2, after A4 and A6, then the flange; and elbow, wrist and flange [m]."""

    shoulder: _Columns
    upper: _Columns
    forearm: _Columns
    lower: _Columns
    hand: _Columns
    elbow: _Vectors
    wrist: _Vectors
    flange: _Vectors


def _chain(robot: RobotModel, c: Array, s: Array) -> _Chain:
    """The chain for cosines and sines of the joints, shape (7, m), without A7's turn."""
    shoulder = _zy(c[0], s[0], c[1], s[1])
    elbow = robot.d_se * shoulder[2]
    elbow[2] += robot.d_bs
    x, y = _turn(shoulder[0], shoulder[1], c[2], s[2])
    upper = x, y, shoulder[2]
    x, z = _turn(x, shoulder[2], c[3], s[3])  # Ry(-A4)
    forearm = x, y, z
    wrist = elbow + robot.d_ew * z
    x, y = _turn(x, y, c[4], s[4])
    lower = x, y, z
    z, x = _turn(z, x, c[5], s[5])
    return _Chain(shoulder, upper, forearm, lower, (x, y, z), elbow, wrist, wrist + robot.d_wf * z)


# ----------------------------------------------------------------------------------------------------------- forward


def forward_batch(robot: RobotModel, q: npt.ArrayLike) -> Array:
    """Poses of the flange in the base frame; `forward` for many joint positions.

    Args:
        robot: the robot.
        q: joint positions, shape (n, 7) [rad].

    Returns:
        Homogeneous matrices, shape (n, 4, 4) [m].

    Raises:
        ShapeError: `q` has another shape.
        LimitError: an entry is not finite.
    """
    instance(robot, RobotModel, "robot")
    given = _rows(q, (7,), "q")
    result = np.zeros((len(given), 4, 4))
    result[:, 3, 3] = 1.0
    for part in _chunks(len(given)):
        angles = given[part].T.copy()
        c, s = np.cos(angles), np.sin(angles)
        chain = _chain(robot, c, s)
        x, y = _turn(chain.hand[0], chain.hand[1], c[6], s[6])
        out = result[part]
        for column, vectors in enumerate((x, y, chain.hand[2], chain.flange)):
            out[:, :3, column] = vectors.T
    return result


def jacobian_batch(robot: RobotModel, q: npt.ArrayLike) -> Array:
    """Geometric Jacobians of the flange, base axes; `jacobian` for many joint positions.

    Args:
        robot: the robot.
        q: joint positions, shape (n, 7) [rad].

    Returns:
        Shape (n, 6, 7): rows vx vy vz [m/rad], wx wy wz.

    Raises:
        ShapeError: `q` has another shape.
        LimitError: an entry is not finite.
    """
    instance(robot, RobotModel, "robot")
    given = _rows(q, (7,), "q")
    result = np.zeros((len(given), 6, 7))
    result[:, 5, 0] = 1.0
    for part in _chunks(len(given)):
        angles = given[part].T.copy()
        c, s = np.cos(angles), np.sin(angles)
        chain = _chain(robot, c, s)
        out = result[part]
        reach = chain.flange.copy()  # from the shoulder
        reach[2] -= robot.d_bs
        out[:, 0, 0], out[:, 1, 0] = -reach[1], reach[0]
        from_elbow, from_wrist = chain.flange - chain.elbow, chain.flange - chain.wrist
        levers = {
            1: (chain.shoulder[1], reach),
            2: (chain.shoulder[2], reach),
            3: (-chain.upper[1], from_elbow),
            4: (chain.forearm[2], from_wrist),
            5: (chain.lower[1], from_wrist),
        }
        for joint, (axis, lever) in levers.items():
            out[:, :3, joint] = _cross(axis, lever).T
            out[:, 3:, joint] = axis.T
        out[:, 3:, 6] = chain.hand[2].T  # the flange lies on the axis of A7
    return result


# -------------------------------------------------------------------------------------------------------- redundancy


class _Reference(NamedTuple):
    """The arm with A3 = 0 whose wrist is at w: cosine and sine of its A1, and R03."""

    ca: Array
    sa: Array
    columns: _Columns


def _reference(
    robot: RobotModel, w: _Vectors, square: Array, c4: Array, s4: Array, behind: npt.NDArray[np.bool_]
) -> _Reference:
    radius = np.hypot(w[0], w[1])
    upright = radius == 0.0
    over = np.where(behind, -1.0, 1.0) / np.where(upright, 1.0, radius)
    ca, sa = np.where(upright, np.where(behind, -1.0, 1.0), w[0] * over), w[1] * over
    radius = np.where(behind, -radius, radius)
    # difference of the directions to the wrist and, in the upper arm's axes, of the wrist
    ahead, up = -robot.d_ew * s4, robot.d_se + robot.d_ew * c4
    cb, sb = (w[2] * up + radius * ahead) / square, (radius * up - w[2] * ahead) / square
    return _Reference(ca, sa, _zy(ca, sa, cb, sb))


def redundancy_batch(robot: RobotModel, q: npt.ArrayLike) -> RedundancyBatch:
    """E1, Status and Turn; `redundancy` for many joint positions of shape (n, 7) [rad].

    Raises:
        ShapeError: `q` has another shape.
        LimitError: an entry is not finite.
    """
    instance(robot, RobotModel, "robot")
    return _redundancy(robot, _rows(q, (7,), "q"))


def _redundancy(robot: RobotModel, given: Array) -> RedundancyBatch:
    e1, status = np.empty(len(given)), np.empty(len(given), dtype=np.int64)
    for part in _chunks(len(given)):
        angles = given[part, :6].T.copy()
        c, s = np.cos(angles), np.sin(angles)
        x, y, z = _zy(c[0], s[0], c[1], s[1])
        x, y = _turn(x, y, c[2], s[2])
        w = robot.d_se * z + robot.d_ew * (c[3] * z - s[3] * x)  # shoulder to wrist
        square = _dot(w, w)
        behind = w[0] * c[0] + w[1] * s[0] < -SINGULAR
        reference = _reference(robot, w, square, c[3], s[3], behind).columns
        # R03 is a rotation of the reference about w: its axis and its trace give the angle
        axial = _cross(reference[0], x) + _cross(reference[1], y) + _cross(reference[2], z)
        trace = _dot(reference[0], x) + _dot(reference[1], y) + _dot(reference[2], z)
        e1[part] = np.arctan2(_dot(axial, w) / np.sqrt(square), trace - 1.0)
        status[part] = behind + 2 * (angles[3] < 0) + 4 * (angles[5] <= 0)
    turn = (given < 0) @ (1 << np.arange(7))
    return RedundancyBatch(e1, status, turn)


# ----------------------------------------------------------------------------------------------------------- inverse


def solve_batch(
    robot: RobotModel,
    poses: npt.ArrayLike,
    *,
    e1: npt.ArrayLike | None = None,
    status: npt.ArrayLike | None = None,
    near: npt.ArrayLike | None = None,
) -> Array:
    """Inverse kinematics of many flange poses with a given redundancy.

    E1 and Status decide which of the arm positions of a pose is meant. They are given, or those of `near`. Unlike
    `solve`, it does not look for another arm angle when a joint limit forbids this one.

    Args:
        robot: the robot.
        poses: of the flange in the base frame, homogeneous matrices of shape (n, 4, 4) [m].
        e1: arm angles, shape (n,), or one for all [rad]; None: those of `near`.
        status: bits 0-2, shape (n,), or one for all; None: those of `near`.
        near: joint positions, shape (n, 7), or (7,) for all [rad]; at a singularity they decide as in `solve`.

    Returns:
        Joint positions, shape (n, 7) [rad]; NaN in the rows of poses that are out of reach, or that need a joint
        beyond its limit with this redundancy.

    Raises:
        CommandRejected: neither `near` nor both `e1` and `status` are given.
        ShapeError: an argument has another shape.
        LimitError: an entry is not finite, or a Status outside 0 to 7.
    """
    instance(robot, RobotModel, "robot")
    given = _rows(poses, (4, 4), "poses")
    count = len(given)
    hints = None
    if near is not None:
        hints = numbers(near, "near", f"numbers of shape (7,) or ({count}, 7)")
        hints = _rows(hints[None] if hints.ndim == 1 else hints, (7,), "near")
        if len(hints) not in (1, count):
            raise ShapeError(
                f"near must have shape (7,) or ({count}, 7), got {np.shape(near)}",
                parameter="near",
                value=near,
            )
    if e1 is None or status is None:
        if hints is None:
            raise CommandRejected(
                "neither near nor both e1 and status are given",
                parameter="e1" if e1 is None else "status",
                hint="give near, or e1 and status; solve looks for an arm angle by itself",
            )
        own = _redundancy(robot, hints)
        e1 = np.broadcast_to(own.e1, (count,)) if e1 is None else e1
        status = np.broadcast_to(own.status, (count,)) if status is None else status
    arm_angles, bits = _for_each(e1, count, "e1"), _status(status, count)
    spread = None if hints is None else np.broadcast_to(hints, (count, 7))
    result = np.empty((count, 7))
    for part in _chunks(count):
        matrices = given[part, :3].transpose(1, 2, 0).copy()
        _solve(
            robot,
            matrices,
            arm_angles[part],
            bits[part],
            None if spread is None else spread[part],
            result[part],
        )
    return result


def _status(value: npt.ArrayLike, count: int) -> Integers:
    given = _for_each(value, count, "status")
    if not np.isin(given, np.arange(8)).all():
        wrong = given[~np.isin(given, np.arange(8))][0]
        raise LimitError(
            f"status must be an integer in [0, 7], got {wrong:g}",
            code=2,
            parameter="status",
            value=float(wrong),
            allowed="[0, 7]",
        )
    return given.astype(np.int64)


def _solve(
    robot: RobotModel, matrices: Array, e1: Array, status: Integers, near: Array | None, out: Array
) -> None:
    """Solve a chunk: matrices of shape (3, 4, m), results into `out`, shape (m, 7)."""
    x, y, z, p = (matrices[:, column] for column in range(4))
    behind, below, down = (status & 1) != 0, (status & 2) != 0, (status & 4) != 0
    w = p - robot.d_wf * z
    w[2] -= robot.d_bs
    square = _dot(w, w)
    far, least = (robot.d_se + robot.d_ew) ** 2 - square, square - (robot.d_se - robot.d_ew) ** 2
    fails = (far < -_ON_REACH) | (least < -_ON_REACH) | (square < _ON_REACH)
    far, least = np.sqrt(np.maximum(far, 0.0)), np.sqrt(np.maximum(least, 0.0))
    square = np.where(fails, 1.0, square)
    q4 = np.where(below, -2.0, 2.0) * np.arctan2(far, least)
    scale = 0.25 / (robot.d_se * robot.d_ew)
    c4, s4 = (least * least - far * far) * scale, np.where(below, -2.0, 2.0) * far * least * scale
    reference = _reference(robot, w, square, c4, s4, behind)
    # R03: the reference, turned about w by E1 (Rodrigues)
    u = w / np.sqrt(square)
    c, s = np.cos(e1), np.sin(e1)
    r03 = tuple(c * one + s * _cross(u, one) + ((1.0 - c) * _dot(u, one)) * u for one in reference.columns)
    # the wrist is before or behind A1's x axis
    size = np.hypot(r03[2][0], r03[2][1])
    ahead = w[0] * r03[2][0] + w[1] * r03[2][1]  # times the size
    out[:, 0], out[:, 1], out[:, 2], is_singular = _zyz(
        r03[0][0], r03[1][0], r03[2], r03[0][1], r03[1][1], (ahead < 0) != behind
    )
    is_singular |= np.abs(ahead) < SINGULAR * size
    out[:, 3] = q4
    # R47: the flange, seen from the forearm
    fx, fz = _turn(r03[0], r03[2], c4, s4)
    fy = r03[1]
    turned = np.empty_like(z)
    turned[0], turned[1], turned[2] = _dot(fx, z), _dot(fy, z), _dot(fz, z)
    out[:, 4], out[:, 5], out[:, 6], is_bent = _zyz(
        _dot(fx, x), _dot(fx, y), turned, _dot(fy, x), _dot(fy, y), down
    )
    is_singular |= is_bent
    for row in np.flatnonzero(is_singular & ~fails):  # there one pose at a time decides as `solve` does
        m = matrices[:, :, row].tolist()
        rows = (m[0][0], m[0][1], m[0][2]), (m[1][0], m[1][1], m[1][2]), (m[2][0], m[2][1], m[2][2])
        hint = None if near is None else near[row].tolist()
        out[row] = raw(robot, rows, (m[0][3], m[1][3], m[2][3]), float(e1[row]), int(status[row]), hint)
    outside = (out < robot.q_min - _ON_LIMIT) | (out > robot.q_max + _ON_LIMIT)
    out[fails | outside.any(axis=1)] = np.nan


def _zyz(
    r00: Array, r01: Array, z: _Vectors, r10: Array, r11: Array, is_negative: npt.NDArray[np.bool_]
) -> tuple[Array, Array, Array, npt.NDArray[np.bool_]]:
    """Angles a, b, c of a rotation Rz(a) Ry(b) Rz(c), and where b does not determine a and c.

    Args:
        r00: entry of the rotation, as r01, r10 and r11, shape (m,).
        r01: see above.
        z: its last column.
        r10: see above.
        r11: see above.
        is_negative: the wanted sign of b.
    """
    sign = np.where(is_negative, -1.0, 1.0)
    size = np.hypot(z[0], z[1])
    a, b = np.arctan2(sign * z[1], sign * z[0]), sign * np.arctan2(size, z[2])
    # a + c where b is nearer to 0, a - c where it is nearer to pi
    flip = np.where(z[2] >= 0.0, 1.0, -1.0)
    both = np.arctan2(flip * r10 - r01, r00 * flip + r11)
    c = flip * (both - a)
    c = np.where(c > np.pi, c - 2 * np.pi, np.where(c <= -np.pi, c + 2 * np.pi, c))
    return a, b, c, size < SINGULAR
