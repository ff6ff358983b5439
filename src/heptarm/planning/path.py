"""Paths: joint positions over the path parameter s in [0, 1], and distances along them."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from math import pi
from typing import Protocol

import numpy as np

from heptarm.model import inverse_kinematics
from heptarm.model.kinematics import Vec
from heptarm.planning.geometry import Geometry, Quat, blend_weight, product
from heptarm.planning.native_inverse import NativeInverse, inverse_library
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel


class JointPath(Protocol):
    """Joint positions over s."""

    @property
    def line(self) -> tuple[Array, Array] | None:
        """Joint positions at s = 0 and their span up to s = 1, shape (7,) each [rad]; None: it is no straight line."""

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """


class JointLine:
    """Straight line in joint space."""

    __slots__ = ("line",)

    line: tuple[Array, Array]

    def __init__(self, start: Array, end: Array) -> None:
        self.line = (start, end - start)

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not used."""
        start, span = self.line
        return start + s * span


class TcpInverseKinematics:
    """Joint positions for poses of the tool frame, in the Status of the arm at the start of its motion.

    Args:
        robot: the robot.
        start: joint positions at the start, shape (7,) [rad].
        tcp: flange to tool frame.

    Attributes:
        status: of the arm at the start.
        e1: its arm angle [rad].
    """

    __slots__ = ("_native", "_offset", "_robot", "_turned", "e1", "status")

    def __init__(self, robot: RobotModel, start: Array, tcp: Pose) -> None:
        self._robot = robot
        to_flange = tcp.inverse()
        self._offset: Vec = tuple(to_flange.xyz.tolist())
        self._turned: Quat | None = tuple(to_flange.quat.tolist()) if to_flange.quat[3] < 1.0 else None
        library = inverse_library()
        self._native = (
            None
            if library is None
            else NativeInverse(library, robot, self._offset, self._turned or (0.0, 0.0, 0.0, 1.0))
        )
        self.status = inverse_kinematics.status_of(robot, start.tolist())
        self.e1 = inverse_kinematics.arm_angle(robot, start.tolist(), bool(self.status & 1))

    def joints(self, point: Vec, quat: Quat, e1: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad]; computes with plain floats, since every tick calls it.

        Raises:
            Unreachable: out of reach.
        """
        if self._native is not None:
            found = self._native.joints(point, quat, e1, self.status, near)
            if found is not None:
                return found
        r, (x, y, z), (u, v, w) = _rows(quat), point, self._offset
        p = (
            x + r[0][0] * u + r[0][1] * v + r[0][2] * w,
            y + r[1][0] * u + r[1][1] * v + r[1][2] * w,
            z + r[2][0] * u + r[2][1] * v + r[2][2] * w,
        )
        if self._turned is not None:
            r = _rows(product(quat, self._turned))
        return np.array(
            inverse_kinematics.raw(self._robot, r, p, e1, self.status, near.tolist(), continuous=True)
        )


class Sequential:
    """A path whose joint positions have to be computed one after the other."""

    __slots__ = ()

    line = None


class CartesianPath(Sequential):
    """Path of the tool frame in space, the arm angle linear with s.

    Args:
        robot: the robot.
        start: joint positions at s = 0, shape (7,) [rad].
        geometry: pose of the tool frame over s.
        tcp: flange to tool frame.
        e1: arm angle at s = 1 [rad]; None: as at the start.

    Attributes:
        length: [m].
        angle: by which the tool frame turns [rad].
        status: of the arm at the start.
    """

    def __init__(
        self, robot: RobotModel, start: Array, geometry: Geometry, tcp: Pose, e1: float | None
    ) -> None:
        self.geometry = geometry
        self.length, self.angle = geometry.length, geometry.angle
        self._inverse = TcpInverseKinematics(robot, start, tcp)
        self.status = self._inverse.status
        self._e1 = self._inverse.e1
        self._turn = 0.0 if e1 is None else (e1 - self._e1 + pi) % (2 * pi) - pi
        self._arm = self._linear

    def _linear(self, s: float) -> float:
        return self._e1 + s * self._turn

    def joined(self, other: CartesianPath, geometry: Geometry, last: float, first: float) -> CartesianPath:
        """The blend of this path's last fraction into another's first, the arm angle blended like the geometry."""
        result = copy(self)
        result.geometry, result.length, result.angle = geometry, geometry.length, geometry.angle
        mine, others = self._linear, other._linear

        def arm(s: float) -> float:
            return (
                mine(1.0 - last * blend_weight(s))
                + others(first * blend_weight(1.0 - s))
                - other._linear(0.0)
            )

        result._arm = arm
        return result

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """
        return self._inverse.joints(self.geometry.point(s), self.geometry.quat(s), self._arm(s), near)


def _rows(quat: Quat) -> inverse_kinematics.Rows:
    """Rows of the rotation of a unit quaternion x y z w."""
    x, y, z, w = quat
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@dataclass(frozen=True, slots=True)
class PathLengths:
    """Distances of the tool frame along a path.

    Attributes:
        s: path parameter at samples, ascending, shape (n,).
        lengths: distance from the start to each of them, shape (n,) [m].
    """

    s: Array
    lengths: Array

    @classmethod
    def through(cls, s: Array, positions: Array) -> PathLengths:
        """From positions of the tool frame, shape (n, 3) [m], at values of s, shape (n,)."""
        steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        return cls(s, np.concatenate([[0.0], np.cumsum(steps)]))

    def find(self, distance: float, low: float, high: float, *, from_start: bool) -> float | None:
        """Path parameter at a distance [m] from one end of the part between two others; None: beyond its end."""
        first, last = np.interp([low, high], self.s, self.lengths).tolist()
        target = (first if from_start else last) + distance
        if target > last + 1e-9:
            return None
        if target <= first and (from_start or target < last):
            return low
        return high if target >= last else float(np.interp(target, self.lengths, self.s))
