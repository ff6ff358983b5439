"""Where the moved frame is along a Cartesian path, and how it turns there."""

from __future__ import annotations

from itertools import pairwise
from math import acos, sin
from typing import Protocol, TypeAlias

import numpy as np

from heptarm.model.kinematics import Vec, flange
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, multiply, quaternion
from heptarm.values.robot import RobotModel

#: Quaternion x y z w.
Quat: TypeAlias = tuple[float, float, float, float]


class Geometry(Protocol):
    """Place of the moved frame over s in [0, 1].

    Attributes:
        length: of the way [m].
        angle: by which it turns [rad].
    """

    length: float
    angle: float

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""


class Turn(Protocol):
    """Orientation over s in [0, 1]; the attribute angle is what it turns by in all [rad]."""

    angle: float

    def at(self, s: float) -> Quat:
        """Orientation in the base."""


class Slerp:
    """From one orientation to another about a fixed axis, the shorter way."""

    __slots__ = ("_from", "_half", "_to", "angle")

    def __init__(self, start: Array, end: Array) -> None:
        dot = float(start @ end)
        self._from: Quat = tuple(start.tolist())
        self._to: Quat = tuple((end if dot >= 0 else -end).tolist())
        self._half = acos(min(1.0, abs(dot)))
        self.angle = Pose.of((0, 0, 0), start).angle_to(Pose.of((0, 0, 0), end))

    def at(self, s: float) -> Quat:
        """Orientation in the base."""
        half, (x, y, z, w), (u, v, t, r) = self._half, self._from, self._to
        if half < 1e-9:
            return x, y, z, w
        k = 1.0 / sin(half)
        a, b = sin((1 - s) * half) * k, sin(s * half) * k
        return a * x + b * u, a * y + b * v, a * z + b * t, a * w + b * r


class JointTurn:
    """As the joints would turn the moved frame in a PTP from one joint position to another."""

    __slots__ = ("_robot", "_start", "_tcp", "_way", "angle")

    def __init__(self, robot: RobotModel, start: Array, end: Array, tcp: Array) -> None:
        self._robot, self._start, self._way, self._tcp = robot, start, end - start, tcp
        turned = [np.array(self.at(i / 32)) for i in range(33)]
        # what the fastest part would make of the whole: the turning is not even
        self.angle = 32 * max(2 * acos(min(1.0, abs(float(a @ b)))) for a, b in pairwise(turned))

    def at(self, s: float) -> Quat:
        """Orientation in the base."""
        columns, _ = flange(self._robot, (self._start + s * self._way).tolist())
        x, y, z, w = multiply(quaternion(np.array(columns).T), self._tcp).tolist()
        return x, y, z, w


class Straight:
    """Straight line."""

    __slots__ = ("_from", "_turn", "_way", "angle", "length")

    def __init__(self, origin: Array, target: Array, turn: Turn) -> None:
        self._from: Vec = tuple(origin.tolist())
        self._way: Vec = tuple((target - origin).tolist())
        self._turn = turn
        self.length = float(np.linalg.norm(target - origin))
        self.angle = turn.angle

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        (x, y, z), (u, v, w) = self._from, self._way
        return x + s * u, y + s * v, z + s * w

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        return self._turn.at(s)


def product(a: Quat, b: Quat) -> Quat:
    """Hamilton product."""
    (x, y, z, w), (i, j, k, r) = a, b
    return (
        w * i + x * r + y * k - z * j,
        w * j - x * k + y * r + z * i,
        w * k + x * j - y * i + z * r,
        w * r - x * i - y * j - z * k,
    )


def left(sigma: float) -> float:
    """What is left of the first path's zone at a place in a blend, from 1 to 0.

    The slope goes from -2 to 0 with the least jerk: its second derivative is a triangle.
    """
    if sigma < 0.5:
        return 1.0 - 2.0 * sigma * (1.0 - sigma * sigma / 1.5)
    rest = 1.0 - sigma
    return rest * rest * rest / 0.75
