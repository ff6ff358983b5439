"""Kinematics of many poses at once: forward kinematics, Jacobian, redundancy and inverse kinematics over arrays.

They are the functions of `heptarm.model.kinematics` and `heptarm.model.inverse_kinematics` in a loop in C.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError
from heptarm.model.inverse_kinematics import FOUND
from heptarm.model.native import constants, many
from heptarm.values.checks import Array, finite_entries, instance, numbers
from heptarm.values.pose import check_rotation
from heptarm.values.robot import RobotModel

#: Whole numbers, one for each pose.
Integers: TypeAlias = npt.NDArray[np.int64]


class RedundancyBatch(NamedTuple):
    """KUKA's redundancy of many joint positions; see `heptarm.Redundancy`.

    Attributes:
        e1: angles of A3, shape (n,) [rad].
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
    return np.ascontiguousarray(finite_entries(given, name))


def _for_each(value: npt.ArrayLike, count: int, name: str) -> Array:
    """One number for each of `count` poses, from as many or from one, shape (count,)."""
    given = finite_entries(numbers(value, name, f"a number or {count} numbers"), name)
    if given.shape not in ((), (count,)):
        raise ShapeError(
            f"{name} must be one number or have shape ({count},), got {given.shape}",
            parameter=name,
            value=value,
        )
    return np.ascontiguousarray(np.broadcast_to(given, (count,)))


# ---------------------------------------------------------------------------------------------------------- functions


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
    result = np.empty((len(given), 4, 4))
    many().hk_forward(constants(robot), len(given), given.ctypes.data, result.ctypes.data)
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
    result = np.empty((len(given), 6, 7))
    many().hk_jacobian(constants(robot), len(given), given.ctypes.data, None, result.ctypes.data)
    return result


def redundancy_batch(robot: RobotModel, q: npt.ArrayLike) -> RedundancyBatch:
    """E1, Status and Turn; `redundancy` for many joint positions of shape (n, 7) [rad].

    Raises:
        ShapeError: `q` has another shape.
        LimitError: an entry is not finite.
    """
    instance(robot, RobotModel, "robot")
    given = _rows(q, (7,), "q")
    status = np.empty(len(given), dtype=np.int32)
    many().hi_statuses(constants(robot), len(given), given.ctypes.data, status.ctypes.data)
    return RedundancyBatch(given[:, 2].copy(), status.astype(np.int64), (given < 0) @ (1 << np.arange(7)))


def solve_batch(
    robot: RobotModel,
    poses: npt.ArrayLike,
    *,
    e1: npt.ArrayLike | None = None,
    status: npt.ArrayLike | None = None,
    near: npt.ArrayLike | None = None,
) -> Array:
    """Inverse kinematics of many flange poses; `solve` for each of them.

    Args:
        robot: the robot.
        poses: of the flange in the base frame, homogeneous matrices of shape (n, 4, 4) [m].
        e1: angles of A3, shape (n,), or one for all [rad]; None: not given.
        status: bits 0-2, shape (n,), or one for all; None: not given.
        near: joint positions, shape (n, 7), or (7,) for all [rad]; None: a usual bent arm.

    Returns:
        Joint positions, shape (n, 7) [rad]; NaN in the rows of poses that `solve` refuses as unreachable.

    Raises:
        ShapeError: an argument has another shape, or the rotation of a pose is none.
        LimitError: an entry is not finite, or a Status outside 0 to 7.
    """
    instance(robot, RobotModel, "robot")
    given = _rows(poses, (4, 4), "poses")
    check_rotation(given[:, :3, :3], "poses")
    count = len(given)
    hints = None if near is None else _hints(near, count)
    angles = np.full(count, np.nan) if e1 is None else _for_each(e1, count, "e1")
    bits = np.full(count, -1, dtype=np.int32) if status is None else _status(status, count)
    result, outcome = np.empty((count, 7)), np.empty(count, dtype=np.int32)
    many().hi_solve(
        constants(robot),
        count,
        given.ctypes.data,
        angles.ctypes.data,
        bits.ctypes.data,
        None if hints is None else hints.ctypes.data,
        e1 is not None,
        result.ctypes.data,
        outcome.ctypes.data,
    )
    result[outcome != FOUND] = np.nan
    return result


def _hints(near: npt.ArrayLike, count: int) -> Array:
    hints = numbers(near, "near", f"numbers of shape (7,) or ({count}, 7)")
    hints = _rows(hints[None] if hints.ndim == 1 else hints, (7,), "near")
    if len(hints) not in (1, count):
        raise ShapeError(
            f"near must have shape (7,) or ({count}, 7), got {np.shape(near)}",
            parameter="near",
            value=near,
        )
    return np.ascontiguousarray(np.broadcast_to(hints, (count, 7)))


def _status(value: npt.ArrayLike, count: int) -> npt.NDArray[np.int32]:
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
    return given.astype(np.int32)
