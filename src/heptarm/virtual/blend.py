"""Blends: how the end of one path goes over into the beginning of the next.

The first path is left ever more slowly while the second is begun ever faster, and their displacements from the
corner between them add up. In space that keeps a blend between two lines in their plane and a constant orientation
constant; where a path in joint space takes part, the axes' displacements add up.
"""

from __future__ import annotations

import numpy as np

from heptarm.model.kinematics import Vec
from heptarm.values.arrays import Array
from heptarm.virtual.geometry import Geometry, Quat, left, product
from heptarm.virtual.path import JointPath


class JointBlend:
    """Blend of two paths by their joint positions.

    Args:
        before: the first path.
        after: the second path.
        last: share of the first path that lies in the blend.
        first: share of the second path that does.
        corner: joint positions between them, shape (7,) [rad].
    """

    __slots__ = ("_after", "_before", "_corner", "_first", "_last")

    def __init__(self, before: JointPath, after: JointPath, last: float, first: float, corner: Array) -> None:
        self._before, self._after = before, after
        self._last, self._first, self._corner = last, first, corner

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]."""
        before = self._before.at(1.0 - self._last * left(s), near)
        return before + self._after.at(self._first * left(1.0 - s), self._corner) - self._corner


class GeometryBlend:
    """Blend of two ways of the moved frame.

    Args:
        before: the first way.
        after: the second way.
        last: share of the first way that lies in the blend.
        first: share of the second way that does.
    """

    def __init__(self, before: Geometry, after: Geometry, last: float, first: float) -> None:
        self._before, self._after, self._last, self._first = before, after, last, first
        self.length = before.length * last + after.length * first
        self.angle = before.angle * last + after.angle * first
        self._corner: Vec = before.point(1.0)
        x, y, z, w = before.quat(1.0)
        self._back: Quat = (-x, -y, -z, w)

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        (x, y, z), (u, v, w) = self._before.point(1.0 - self._last * left(s)), self._corner
        i, j, k = self._after.point(self._first * left(1.0 - s))
        return x + i - u, y + j - v, z + k - w

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        before = self._before.quat(1.0 - self._last * left(s))
        return product(product(before, self._back), self._after.quat(self._first * left(1.0 - s)))


def zone(
    places: Array, quats: Array, blending: tuple[float, float, float], *, backwards: bool
) -> float:
    """Share of a path that a blending allows at one of its ends.

    Args:
        places: of the moved frame at even samples, shape (n, 3) [m].
        quats: likewise, shape (n, 4).
        blending: fraction of the path, distance [m], rotation [rad]; zeros do not count.
        backwards: at its end.
    """
    relative, distance, turn = blending
    if backwards:
        places, quats = places[::-1], quats[::-1]
    shares = [relative] if relative > 0 else []
    for most, ways in (
        (distance, np.linalg.norm(places - places[0], axis=1)),
        (turn, 2 * np.arccos(np.minimum(1.0, np.abs(quats @ quats[0])))),
    ):
        if most > 0:
            beyond = np.flatnonzero(ways > most)
            if len(beyond):
                k = int(beyond[0])
                part = (most - ways[k - 1]) / (ways[k] - ways[k - 1])
                shares.append((k - 1 + float(part)) / (len(ways) - 1))
            else:
                shares.append(1.0)
    return min(shares, default=0.0)
