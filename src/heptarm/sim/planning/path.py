"""Paths: joint positions over the path parameter s in [0, 1]."""

from __future__ import annotations

from copy import copy
from math import pi
from typing import Protocol

import numpy as np

from heptarm.model import inverse
from heptarm.model.kinematics import Vec
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.virtual.geometry import Geometry, Quat, left, product


class JointPath(Protocol):
    """Joint positions over s."""

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """


class JointLine:
    """Straight line in joint space."""

    __slots__ = ("end", "start", "way")

    def __init__(self, start: Array, end: Array) -> None:
        self.start, self.end = start, end
        self.way = end - start

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not needed here."""
        return self.start + s * self.way


class Tip:
    """Joint positions that bring the moved frame somewhere, in the Status in which the arm begins.

    Args:
        robot: the robot.
        start: joint positions at the beginning, shape (7,) [rad].
        tcp: flange to moved frame.

    Attributes:
        status: of the arm at the beginning.
        e1: its arm angle [rad].
    """

    __slots__ = ("_offset", "_robot", "_turned", "e1", "status")

    def __init__(self, robot: RobotModel, start: Array, tcp: Pose) -> None:
        self._robot = robot
        to_flange = tcp.inverse()
        self._offset: Vec = tuple(to_flange.xyz.tolist())
        self._turned: Quat | None = tuple(to_flange.quat.tolist()) if to_flange.quat[3] < 1.0 else None
        self.status = inverse.status_of(robot, start.tolist())
        self.e1 = inverse.arm_angle(robot, start.tolist(), bool(self.status & 1))

    def joints(self, point: Vec, quat: Quat, e1: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad]; plain floats inside, since the tick waits for it.

        Raises:
            Unreachable: out of reach.
        """
        r, (x, y, z), (u, v, w) = _rows(quat), point, self._offset
        p = (
            x + r[0][0] * u + r[0][1] * v + r[0][2] * w,
            y + r[1][0] * u + r[1][1] * v + r[1][2] * w,
            z + r[2][0] * u + r[2][1] * v + r[2][2] * w,
        )
        if self._turned is not None:
            r = _rows(product(quat, self._turned))
        return np.array(inverse.raw(self._robot, r, p, e1, self.status, near.tolist(), continuous=True))


class CartesianPath:
    """Path of the moved frame in space, the arm angle linear with s.

    Args:
        robot: the robot.
        start: joint positions at s = 0, shape (7,) [rad].
        geometry: where the moved frame is.
        tcp: flange to moved frame.
        e1: arm angle at s = 1 [rad]; None: as at the start.

    Attributes:
        length: [m].
        angle: by which the moved frame turns [rad].
        status: of the arm at the start.
    """

    def __init__(
        self, robot: RobotModel, start: Array, geometry: Geometry, tcp: Pose, e1: float | None
    ) -> None:
        self.start = start
        self.geometry = geometry
        self.length, self.angle = geometry.length, geometry.angle
        self._tip = Tip(robot, start, tcp)
        self.status = self._tip.status
        self._e1 = self._tip.e1
        self._turn = 0.0 if e1 is None else (e1 - self._e1 + pi) % (2 * pi) - pi
        self._arm = self._linear

    def _linear(self, s: float) -> float:
        return self._e1 + s * self._turn

    def joined(self, other: CartesianPath, geometry: Geometry, last: float, first: float) -> CartesianPath:
        """The blend of this path's last share into another's first, the arm angle blended like the geometry."""
        result = copy(self)
        result.geometry, result.length, result.angle = geometry, geometry.length, geometry.angle
        mine, others = self._linear, other._linear

        def arm(s: float) -> float:
            return mine(1.0 - last * left(s)) + others(first * left(1.0 - s)) - other._linear(0.0)

        result._arm = arm
        return result

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """
        return self._tip.joints(self.geometry.point(s), self.geometry.quat(s), self._arm(s), near)


def _rows(quat: Quat) -> inverse.Rows:
    """Rows of the rotation of a unit quaternion x y z w."""
    x, y, z, w = quat
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
