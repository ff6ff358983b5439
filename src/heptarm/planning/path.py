"""Paths: joint positions over the path parameter s in [0, 1], and distances along them."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from math import isnan, nan, pi, remainder
from typing import Protocol

import numpy as np

from heptarm.model.inverse_kinematics import PathInverse, status_of
from heptarm.planning.geometry import Geometry, blend_weight
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel


class JointPath(Protocol):
    """Joint positions over s."""

    @property
    def line(self) -> tuple[Array, Array] | None:
        """Joint positions at s = 0 and their span up to s = 1, shape (7,) each [rad]; None: it is no straight line."""

    @property
    def keeps_a3(self) -> bool:
        """Whether A3 stays as far as it can: no E1 is given for the end."""

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """

    def samples(self, s: Array) -> Array | None:
        """Joint positions at n values of s, shape (n, 7) [rad]; None: each depends on the one before."""


class JointLine:
    """Straight line in joint space."""

    __slots__ = ("line",)

    line: tuple[Array, Array]
    keeps_a3 = False

    def __init__(self, start: Array, end: Array) -> None:
        self.line = (start, end - start)

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not used."""
        start, span = self.line
        return start + s * span

    def samples(self, s: Array) -> Array:
        """See `JointPath`."""
        start, span = self.line
        found: Array = start + s[:, None] * span
        return found


class Sequential:
    """A path whose joint positions have to be computed one after the other."""

    __slots__ = ()

    line = None

    @property
    def keeps_a3(self) -> bool:
        """See `JointPath`."""
        return False

    def samples(self, s: Array) -> Array | None:
        """See `JointPath`."""
        return None


class CartesianPath(Sequential):
    """Path of the tool frame in space, E1 (the angle of A3) linear with s.

    Args:
        robot: the robot.
        start: joint positions at s = 0, shape (7,) [rad].
        geometry: pose of the tool frame over s.
        tcp: flange to tool frame.
        e1: at s = 1 [rad]; None: A3 stays, as far as the joints on the path need no long way then.

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
        self._inverse = PathInverse(robot, tcp)
        self.status, self._start = status_of(robot, start.tolist()), float(start[2])
        self._turn = 0.0 if e1 is None else remainder(e1, 2 * pi) - self._start
        self._a3 = self._free if e1 is None else self._linear

    @property
    def keeps_a3(self) -> bool:
        """See `JointPath`."""
        return isnan(self._a3(0.0))

    def _linear(self, s: float) -> float:
        return self._start + s * self._turn

    @staticmethod
    def _free(s: float) -> float:
        return nan

    def joined(self, other: CartesianPath, geometry: Geometry, last: float, first: float) -> CartesianPath:
        """The blend of this path's last fraction into another's first, E1 blended like the geometry."""
        result = copy(self)
        result.geometry, result.length, result.angle = geometry, geometry.length, geometry.angle
        mine, others, corner = self._linear, other._linear, other._start

        def blended(s: float) -> float:
            return mine(1.0 - last * blend_weight(s)) + others(first * blend_weight(1.0 - s)) - corner

        if self._turn or other._turn:
            result._a3 = blended
        return result

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the path leaves the workspace.
        """
        return self._inverse.joints(self.geometry.point(s), self.geometry.quat(s), near, a3=self._a3(s))


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
