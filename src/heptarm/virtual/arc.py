"""Arc of a circle through three points."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from heptarm.model.kinematics import Vec
from heptarm.values.arrays import Array
from heptarm.values.orientation import Orientation
from heptarm.values.pose import multiply
from heptarm.virtual.geometry import Quat, Slerp, Turn, product
from heptarm.virtual.order import PlanError

#: Sides of the three points' triangle shorter than this [m], or a flatter triangle than this make no circle.
_SHORT, _FLAT = 1e-6, 1e-4


class Arc:
    """Arc from one point through another to a third, in phase with s.

    Args:
        start: shape (3,) [m], as the other points.
        via: a point on the way.
        end: where it ends.

    Attributes:
        length: [m].
        axis: unit normal, about which the arc turns by the right hand, shape (3,).
        sweep: angle of the arc [rad], in (0, 2 pi).
        radius: [m].
        angle: by which the orientation turns [rad].

    Raises:
        PlanError: the points coincide or lie on a line.
    """

    def __init__(self, start: Array, via: Array, end: Array) -> None:
        a, b = via - start, end - start
        normal = np.cross(a, b)
        sides = (np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(end - via))
        area = float(np.linalg.norm(normal))
        if min(sides) < _SHORT or area < _FLAT * float(sides[0] * sides[1]):
            raise PlanError(
                "planning", "Can not plan motion: start, auxiliary point and end of the circle lie on a line"
            )
        # centre of the circumcircle, seen from the start
        to_centre = (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2 * area * area)
        self.axis = normal / area
        spoke = -to_centre
        across = np.cross(self.axis, spoke)
        last = end - start - to_centre
        self.sweep = float(np.arctan2(last @ across, last @ spoke)) % (2 * pi)
        self.radius = float(np.linalg.norm(spoke))
        self.length = self.radius * self.sweep
        self.angle = 0.0
        self._centre: Vec = tuple((start + to_centre).tolist())
        self._spoke: Vec = tuple(spoke.tolist())
        self._across: Vec = tuple(across.tolist())
        self._turn: Turn | None = None
        self._follows = False

    def turning(self, turn: Turn, *, follows: bool) -> Arc:
        """The same arc with an orientation; `follows`: seen from the tangent."""
        self._turn, self._follows = turn, follows
        self.angle = turn.angle + (self.sweep if follows else 0.0)
        return self

    def led(self, start: Array, end: Array, led: Orientation) -> Arc:
        """The same arc with an orientation led from one quaternion to another, relative to base or path."""
        follows = led.reference == "path"
        if led.type == "constant":
            end = start
        elif follows:
            half = -self.sweep / 2
            end = multiply(np.array([*(self.axis * sin(half)), cos(half)]), end)
        return self.turning(Slerp(start, end), follows=follows)

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
        """Unit direction of the way, shape (3,)."""
        c, d = cos(s * self.sweep), sin(s * self.sweep)
        return (c * np.array(self._across) - d * np.array(self._spoke)) / self.radius

    def bend(self, s: float) -> Array:
        """Second derivative of the place by the length, shape (3,) [1/m]."""
        c, d = cos(s * self.sweep), sin(s * self.sweep)
        return -(c * np.array(self._spoke) + d * np.array(self._across)) / self.radius**2
