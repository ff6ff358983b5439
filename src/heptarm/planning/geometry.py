"""Geometry of Cartesian paths: position and orientation of the tool frame on straight lines and arcs."""

from __future__ import annotations

from itertools import pairwise
from math import acos, cos, sin
from typing import Protocol, TypeAlias

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.model.kinematics import Vec, flange
from heptarm.planning.motion import PlanError
from heptarm.values.checks import Array
from heptarm.values.motion.circle import arc_of
from heptarm.values.motion.orientation import Orientation
from heptarm.values.pose import Pose, multiply, quaternion, towards
from heptarm.values.robot import RobotModel

#: Quaternion x y z w.
Quat: TypeAlias = tuple[float, float, float, float]


class Geometry(Protocol):
    """Pose of the tool frame over s in [0, 1].

    Attributes:
        length: of the path [m].
        angle: by which it turns [rad].
    """

    length: float
    angle: float

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""


class OrientationPath(Protocol):
    """Orientation over s in [0, 1]; the attribute angle is the whole angle it turns by [rad]."""

    angle: float

    def at(self, s: float) -> Quat:
        """Orientation in the base."""


class Slerp:
    """From one orientation to another about a fixed axis, by the smaller angle; half a turn as in `towards`.

    Args:
        start: quaternion x y z w.
        end: quaternion x y z w.
        is_other: half a turn goes in the other direction.
    """

    __slots__ = ("_from", "_half", "_to", "angle")

    def __init__(self, start: Array, end: Array, *, is_other: bool = False) -> None:
        end = towards(start, end, is_other=is_other)
        self._from: Quat = tuple(start.tolist())
        self._to: Quat = tuple(end.tolist())
        self._half = acos(max(-1.0, min(1.0, float(start @ end))))
        self.angle = Pose.of((0, 0, 0), start).angle_to(Pose.of((0, 0, 0), end))

    def at(self, s: float) -> Quat:
        """Orientation in the base."""
        half, (x, y, z, w), (u, v, t, r) = self._half, self._from, self._to
        if half < 1e-9:
            return x, y, z, w
        k = 1.0 / sin(half)
        a, b = sin((1 - s) * half) * k, sin(s * half) * k
        return a * x + b * u, a * y + b * v, a * z + b * t, a * w + b * r


class JointOrientation:
    """The orientation that the tool frame has in a PTP from one joint position to another."""

    __slots__ = ("_robot", "_span", "_start", "_tcp", "angle")

    def __init__(self, robot: RobotModel, start: Array, end: Array, tcp: Array) -> None:
        self._robot, self._start, self._span, self._tcp = robot, start, end - start, tcp
        turned = [np.array(self.at(i / 32)) for i in range(33)]
        # as if the fastest part were the whole: the orientation does not change evenly
        self.angle = 32 * max(2 * acos(min(1.0, abs(float(a @ b)))) for a, b in pairwise(turned))

    def at(self, s: float) -> Quat:
        """Orientation in the base."""
        columns, _ = flange(self._robot, (self._start + s * self._span).tolist())
        x, y, z, w = multiply(quaternion(np.array(columns).T), self._tcp).tolist()
        return x, y, z, w


class Straight:
    """Straight line."""

    __slots__ = ("_from", "_span", "_turn", "angle", "length")

    def __init__(self, origin: Array, target: Array, turn: OrientationPath) -> None:
        self._from: Vec = tuple(origin.tolist())
        self._span: Vec = tuple((target - origin).tolist())
        self._turn = turn
        self.length = float(np.linalg.norm(target - origin))
        self.angle = turn.angle

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        (x, y, z), (u, v, w) = self._from, self._span
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


def blend_weight(sigma: float) -> float:
    """Weight of the first path at a place in a blend, from 1 to 0.

    The slope goes from -2 to 0 with the least jerk: its second derivative is a triangle.
    """
    if sigma < 0.5:
        return 1.0 - 2.0 * sigma * (1.0 - sigma * sigma / 1.5)
    rest = 1.0 - sigma
    return rest * rest * rest / 0.75


class Arc:
    """Arc from one point through another to a third, in phase with s.

    Args:
        start: shape (3,) [m], as the other points.
        via: a point on the arc.
        end: where it ends.

    Attributes:
        length: [m].
        axis: unit normal; the arc turns about it by the right-hand rule, shape (3,).
        sweep: angle of the arc [rad], in (0, 2 pi).
        radius: [m].
        angle: by which the orientation turns [rad].

    Raises:
        PlanError: the points coincide or lie on a line.
    """

    def __init__(self, start: Array, via: Array, end: Array) -> None:
        try:
            circle = arc_of(start, via, end)
        except CommandRejected as error:
            raise PlanError("planning", f"Can not plan motion: {error.text}") from None
        spoke = start - circle.centre
        self.axis, self.sweep, self.radius = circle.normal, circle.angle, circle.radius
        self.length = circle.length
        self.angle = 0.0
        self._centre: Vec = tuple(circle.centre.tolist())
        self._spoke: Vec = tuple(spoke.tolist())
        self._across: Vec = tuple(np.cross(circle.normal, spoke).tolist())
        self._turn: OrientationPath | None = None
        self._follows = False

    def turning(self, turn: OrientationPath, *, follows: bool) -> Arc:
        """This arc with an orientation; `follows`: relative to the tangent."""
        self._turn, self._follows = turn, follows
        self.angle = turn.angle + (self.sweep if follows else 0.0)
        return self

    def oriented(self, start: Array, end: Array, control: Orientation, *, is_other: bool = False) -> Arc:
        """This arc with an orientation from one quaternion to another, relative to base or path; see `Slerp`."""
        follows = control.reference == "path"
        if control.type == "constant":
            end = start
        elif follows:
            half = -self.sweep / 2
            end = multiply(np.array([*(self.axis * sin(half)), cos(half)]), end)
        return self.turning(Slerp(start, end, is_other=is_other), follows=follows)

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        c, d = cos(s * self.sweep), sin(s * self.sweep)
        (x, y, z), (u, v, w), (k, m, n) = self._centre, self._spoke, self._across
        return x + c * u + d * k, y + c * v + d * m, z + c * w + d * n

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        assert self._turn is not None
        own = self._turn.at(s)
        if not self._follows:
            return own
        half = 0.5 * s * self.sweep
        x, y, z = self.axis.tolist()
        d = sin(half)
        return product((x * d, y * d, z * d, cos(half)), own)

    def direction(self, s: float) -> Array:
        """Unit tangent, shape (3,)."""
        c, d = cos(s * self.sweep), sin(s * self.sweep)
        return (c * np.array(self._across) - d * np.array(self._spoke)) / self.radius

    def curvature(self, s: float) -> Array:
        """Second derivative of the position by the length, shape (3,) [1/m]."""
        c, d = cos(s * self.sweep), sin(s * self.sweep)
        return -(c * np.array(self._spoke) + d * np.array(self._across)) / self.radius**2
