"""Paths: joint positions over the path parameter s in [0, 1]."""

from __future__ import annotations

from math import acos, pi, sin

import numpy as np

from heptarm.model import inverse
from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.robot import RobotModel


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
        self._to_flange = tcp.inverse()
        self._status = inverse.status_of(robot, start.tolist())
        self._e1 = inverse.arm_angle(robot, start.tolist(), bool(self._status & 1))
        self._turn = 0.0 if e1 is None else (e1 - self._e1 + pi) % (2 * pi) - pi
        self.length = self.origin.distance_to(target)
        self.angle = self.origin.angle_to(target)
        self._quat = self.origin.quat
        dot = float(self._quat @ target.quat)
        self._goal = target.quat if dot >= 0 else -target.quat
        self._half = acos(min(1.0, abs(dot)))

    def pose(self, s: float) -> Pose:
        """Pose of the moved frame."""
        xyz = self.origin.xyz + s * (self.target.xyz - self.origin.xyz)
        return Pose(xyz, self._slerp(s))

    def _slerp(self, s: float) -> Array:
        if self._half < 1e-9:
            return self._quat
        k = sin(self._half)
        return (sin((1 - s) * self._half) * self._quat + sin(s * self._half) * self._goal) / k

    def at(self, s: float, near: Array) -> Array:
        """Joint positions next to `near`, shape (7,) [rad].

        Raises:
            Unreachable: the line leaves the workspace.
        """
        quat = self._slerp(s)
        r = rotation(quat)
        p = self.origin.xyz + s * (self.target.xyz - self.origin.xyz) + r @ self._to_flange.xyz
        if self._to_flange.quat[3] < 1.0:
            r = rotation(multiply(quat, self._to_flange.quat))
        rows = r.tolist()
        solved = inverse.raw(
            self._robot,
            (rows[0], rows[1], rows[2]),
            tuple(p.tolist()),
            self._e1 + s * self._turn,
            self._status,
            near.tolist(),
            continuous=True,
        )
        return np.array(solved)
