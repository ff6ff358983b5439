"""The model's functions in C (`kinematics.c`, `redundancy.c`, `dynamics.c`), and a robot's constants for them.

Functions for one posture keep Python's lock; those for many release it. Numbers travel in arrays of ctypes, which are
made faster than arrays of numpy.
"""

from __future__ import annotations

import ctypes
from functools import cache, lru_cache
from typing import Any, ClassVar, TypeAlias

import numpy as np

from heptarm._library import library
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Seven joints, a homogeneous matrix, and a Jacobian in C.
Joints, Matrix, Jacobian = ctypes.c_double * 7, ctypes.c_double * 16, ctypes.c_double * 42
#: A matrix of seven rows and columns.
Square = ctypes.c_double * 49
#: Intervals of arm angles.
Spans = ctypes.c_double * 56
#: Axes or points of seven joints.
Vectors, Vector = ctypes.c_double * 21, ctypes.c_double * 3
Reals: TypeAlias = "ctypes.Array[ctypes.c_double]"
_P, _REAL, _INT, _LONG = ctypes.c_void_p, ctypes.c_double, ctypes.c_int, ctypes.c_long
_FUNCTIONS: dict[str, tuple[object, ...]] = {
    "hk_forward": (None, _P, _LONG, _P, _P),
    "hk_link": (None, _P, _P, _INT, _P),
    "hk_jacobian": (None, _P, _LONG, _P, _P, _P),
    "hk_joints": (None, _P, _P, _P, _P, _P),
    "hi_arm_angle": (_REAL, _P, _P),
    "hi_intervals": (_INT, _P, _P, _INT, _P),
    "hi_joints": (_INT, _P, _P, *[_REAL] * 8, _INT, _P, _P),
    "hi_solve": (None, _P, _LONG, _P, _P, _P, _P, _INT, _P, _P),
    "hi_status": (_INT, _P, _P),
    "hi_statuses": (None, _P, _LONG, _P, _P),
    "hi_with_arm_angle": (_INT, _P, _P, _REAL, _INT, _P, _P),
    "hd_coriolis_matrix": (None, _P, _P, _P, _P),
    "hd_forward": (_INT, _P, _P, _P, _P, _P, _P),
    "hd_inverse": (None, _P, _P, _P, _P, _P, _P),
    "hd_mass_matrix": (None, _P, _P, _P),
}


def _typed(made: ctypes.CDLL) -> ctypes.CDLL:
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(made, name)
        function.restype, function.argtypes = result, tuple(arguments)
    return made


@cache
def one() -> ctypes.CDLL:
    """The functions for one posture.

    Raises:
        Unavailable: the extension is missing.
    """
    return _typed(library(holds_gil=True))


@cache
def many() -> ctypes.CDLL:
    """The functions for many postures.

    Raises:
        Unavailable: the extension is missing.
    """
    return _typed(library())


class Arm(ctypes.Structure):
    """`struct arm` of redundancy.h: the chain along z, its distances [m], limits of the joints [rad]."""

    _fields_: ClassVar = (
        ("origin", _REAL * 21),
        ("flange", _REAL * 3),
        ("distances", _REAL * 4),
        ("q_min", _REAL * 7),
        ("q_max", _REAL * 7),
    )


@lru_cache(maxsize=64)
def constants(robot: RobotModel) -> Any:
    """Constants of a robot, by reference: `struct arm` for a function in C."""
    origin = np.zeros((7, 3))
    origin[1, 2], origin[3, 2], origin[5, 2] = robot.d_bs, robot.d_se, robot.d_ew
    made = Arm(
        (_REAL * 21)(*origin.ravel().tolist()),
        (_REAL * 3)(0.0, 0.0, robot.d_wf),
        (_REAL * 4)(robot.d_bs, robot.d_se, robot.d_ew, robot.d_wf),
        (_REAL * 7)(*robot.q_min.tolist()),
        (_REAL * 7)(*robot.q_max.tolist()),
    )
    return ctypes.byref(made)


def reals(values: Array) -> Reals:
    """Numbers of an array for C."""
    return (_REAL * values.size)(*values.ravel().tolist())


def values_of(numbers: Reals) -> Array:
    """Numbers of C as an array over the same memory."""
    return np.frombuffer(memoryview(numbers), dtype=np.float64)
