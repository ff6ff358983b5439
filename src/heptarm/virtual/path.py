"""Paths: joint positions over the path parameter s in [0, 1]."""

from __future__ import annotations

from math import acos, pi, sin
from typing import TypeAlias

import numpy as np

from heptarm.model import inverse
from heptarm.model.kinematics import Vec, forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

Quat: TypeAlias = tuple[float, float, float, float]


class JointLine:
    """Straight line in joint space."""

    __slots__ = ("end", "start", "way")

    def __init__(self, start: Array, end: Array) -> None:
        self.start, self.end = start, end
        self.way = end - start

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not needed here."""
        return self.start + s * self.way


class CartesianLine:
    """Straight line of the moved frame, orientation by SLERP, arm angle linear, all in phase with s.

    Args:
        robot: the robot.
        start: joint positions at s = 0, shape (7,) [rad].
        target: pose of the moved frame at s = 1.
        tcp: flange to moved frame.
        e1: arm angle at s = 1 [rad]; None: as at the start.
    """

    def __init__(self, robot: RobotModel, start: Array, target: Pose, tcp: Pose, e1: float | None) -> None:
        self._robot = robot
        self.start = start
        flange = Pose.from_matrix(forward(robot, start))
        self.origin, self.target = flange @ tcp, target
        to_flange = tcp.inverse()
        self._offset: Vec = tuple(to_flange.xyz.tolist())
        self._turned: Quat | None = tuple(to_flange.quat.tolist()) if to_flange.quat[3] < 1.0 else None
        self._status = inverse.status_of(robot, start.tolist())
        self._e1 = inverse.arm_angle(robot, start.tolist(), bool(self._status & 1))
        self._turn = 0.0 if e1 is None else (e1 - self._e1 + pi) % (2 * pi) - pi
        self.length = self.origin.distance_to(target)
        self.angle = self.origin.angle_to(target)
        dot = float(self.origin.quat @ target.quat)
        self._quat: Quat = tuple(self.origin.quat.tolist())
        self._goal: Quat = tuple((target.quat if dot >= 0 else -target.quat).tolist())
        self._from: Vec = tuple(self.origin.xyz.tolist())
        self._way: Vec = tuple((target.xyz - self.origin.xyz).tolist())
        self._half = acos(min(1.0, abs(dot)))

    def pose(self, s: float) -> Pose:
        """Pose of the moved frame."""
        return Pose(np.array(self._point(s)), np.array(self._slerp(s)))

    def _point(self, s: float) -> tuple[float, float, float]:
        (x, y, z), (u, v, w) = self._from, self._way
        return x + s * u, y + s * v, z + s * w

    def _slerp(self, s: float) -> tuple[float, float, float, float]:
        half, (x, y, z, w), (u, v, t, r) = self._half, self._quat, self._goal
        if half < 1e-9:
            return x, y, z, w
        k = 1.0 / sin(half)
        a, b = sin((1 - s) * half) * k, sin(s * half) * k
        return a * x + b * u, a * y + b * v, a * z + b * t, a * w + b * r

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad]; plain floats inside, since the tick waits for it.

        Raises:
            Unreachable: the line leaves the workspace.
        """
        quat = self._slerp(s)
        r, (x, y, z), (u, v, w) = _rows(quat), self._point(s), self._offset
        p = (
            x + r[0][0] * u + r[0][1] * v + r[0][2] * w,
            y + r[1][0] * u + r[1][1] * v + r[1][2] * w,
            z + r[2][0] * u + r[2][1] * v + r[2][2] * w,
        )
        if self._turned is not None:
            r = _rows(_product(quat, self._turned))
        e1 = self._e1 + s * self._turn
        return np.array(inverse.raw(self._robot, r, p, e1, self._status, near.tolist(), continuous=True))


def _rows(quat: Quat) -> inverse.Rows:
    """Rows of the rotation of a unit quaternion x y z w."""
    x, y, z, w = quat
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _product(a: Quat, b: Quat) -> Quat:
    (x, y, z, w), (i, j, k, r) = a, b
    return (
        w * i + x * r + y * k - z * j,
        w * j - x * k + y * r + z * i,
        w * k + x * j - y * i + z * r,
        w * r - x * i - y * j - z * k,
    )
