"""Inverse kinematics of paths in C; where there is no compiler, `TcpInverseKinematics` computes in Python."""

from __future__ import annotations

import ctypes
import functools

import numpy as np

from heptarm._library import Unavailable, library
from heptarm.model.kinematics import Vec
from heptarm.planning.geometry import Quat
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

_REAL, _POINTER = ctypes.c_double, ctypes.c_void_p


@functools.cache
def inverse_library() -> ctypes.CDLL | None:
    """Load the function; None: this system is not supported, or has no compiler."""
    try:
        made = library(holds_gil=True)
    except Unavailable:
        return None
    made.hi_joints.argtypes = (_POINTER, *([_REAL] * 8), ctypes.c_int, _POINTER, _POINTER)
    made.hi_joints.restype = ctypes.c_int
    return made


class NativeInverse:
    """The function for one tool frame.

    Args:
        library: see `inverse_library`.
        robot: the robot.
        offset: tool frame to flange, translation [m].
        turn: the same, rotation.
    """

    __slots__ = ("_arm", "_at", "_joints", "_near", "_near_at")

    def __init__(self, library: ctypes.CDLL, robot: RobotModel, offset: Vec, turn: Quat) -> None:
        self._joints = library.hi_joints
        self._arm = np.array((robot.d_bs, robot.d_se, robot.d_ew, robot.d_wf, *offset, *turn))
        self._near = np.empty(7)
        self._at, self._near_at = self._arm.ctypes.data, self._near.ctypes.data

    def joints(self, point: Vec, quat: Quat, e1: float, status: int, near: Array) -> Array | None:
        """Joint positions next to `near`, shape (7,) [rad]; None: out of reach."""
        self._near[:] = near
        found = np.empty(7)
        done = self._joints(self._at, *point, *quat, e1, status, self._near_at, found.ctypes.data)
        return found if done else None
