"""Arm angles of a flange pose at which joints reach their limits.

After Shimizu et al. (see `inverse_kinematics`), section IV: with the wrist and the flange fixed, the rotations of
shoulder and wrist are R(psi) = S sin(psi) + K cos(psi) + C, and every event is a root of s sin(psi) + k
cos(psi) + c = 0 with coefficients from S, K and C. Between two neighbouring events nothing changes, so one
sample decides for the whole interval: no feasible interval is too narrow to be found.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, ceil, cos, hypot, pi, sin
from typing import TypeAlias

import numpy as np

from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Coefficients of sin(psi), cos(psi) and 1.
Wave: TypeAlias = tuple[float, float, float]

_ROUNDING = 1e-12


def events(robot: RobotModel, u: Array, elbow: Array, flange: Array, q4: float) -> list[float]:
    """Arm angles in (-pi, pi], ascending, at which a joint may meet a limit or a branch may change.

    Args:
        robot: the robot.
        u: unit vector from the shoulder to the wrist, shape (3,).
        elbow: R03 of the arm at psi = 0, shape (3, 3).
        flange: rotation of the flange, shape (3, 3).
        q4: the elbow joint [rad].
    """
    x, y, z = u
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    along = np.outer(u, u) @ elbow
    # R03 = sin [u]x R0 + cos (1 - u u') R0 + u u' R0
    shoulder = np.stack([cross @ elbow, elbow - along, along])
    c, s = cos(q4), sin(q4)
    back = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])  # Ry(q4), the inverse of Ry(-q4)
    wrist = back @ shoulder.transpose(0, 2, 1) @ flange
    limits = robot.q_max.tolist()
    found = _joint_events(shoulder.tolist(), limits[0:3]) + _joint_events(wrist.tolist(), limits[4:7])
    # Status bit 0 changes where the wrist crosses the plane x = 0 of A1
    found += _roots(tuple(x * w[0][2] + y * w[1][2] for w in shoulder.tolist()))
    return sorted(found)


def _joint_events(r: list[list[list[float]]], limits: Sequence[float]) -> list[float]:
    """Events of the three joints of R = Rz(a) Ry(b) Rz(c); the limits are symmetric."""
    a, b, c = limits

    def entry(i: int, j: int) -> Wave:
        return r[0][i][j], r[1][i][j], r[2][i][j]

    s, k, o = entry(2, 2)
    # cos(b) = r22 meets cos(limit); at its extremes b may pass through 0, where a and c jump by pi
    found = _roots((s, k, o - cos(b)))
    if hypot(s, k) > _ROUNDING:
        found += [atan2(s, k), atan2(-s, -k)]
    for limit in (a, -a):
        # tan(a) = r12 / r02
        found += _roots(_mix(entry(1, 2), cos(limit), entry(0, 2), -sin(limit)))
    for limit in (c, -c):
        # tan(c) = r21 / -r20
        found += _roots(_mix(entry(2, 1), cos(limit), entry(2, 0), sin(limit)))
    return found


def _mix(p: Wave, f: float, q: Wave, g: float) -> Wave:
    return f * p[0] + g * q[0], f * p[1] + g * q[1], f * p[2] + g * q[2]


def _roots(wave: Sequence[float]) -> list[float]:
    """Solutions of s sin(psi) + k cos(psi) + c = 0 in (-pi, pi]."""
    s, k, c = wave
    size = hypot(s, k)
    if size < _ROUNDING or abs(c) > size * (1.0 + _ROUNDING):
        return []
    middle, half = atan2(s, k), acos(max(-1.0, min(1.0, -c / size)))
    return [wrapped(middle + half), wrapped(middle - half)]


def wrapped(angle: float) -> float:
    """The angle in (-pi, pi]."""
    return angle - 2 * pi * ceil((angle - pi) / (2 * pi))
