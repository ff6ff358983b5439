"""Smooth curves through points: piecewise polynomials with continuous slope and curvature.

The slopes are those of the cubic spline with the points' distances as parameter; each piece then is the quintic with
its ends' places, slopes and curvatures, so that a piece beside a line or an arc takes over their curvature.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from heptarm.model.kinematics import Vec
from heptarm.values.arrays import Array
from heptarm.virtual.arc import Arc
from heptarm.virtual.geometry import Quat, Straight


class Quintic:
    """Polynomial piece between two points.

    Args:
        length: what the curve's parameter grows by on it.
        start: place, slope and curvature at its start, each shape (m,).
        end: likewise.
    """

    __slots__ = ("_coefficients",)

    def __init__(self, length: float, start: tuple[Array, Array, Array], end: tuple[Array, Array, Array]) -> None:
        (p, v, a), (q, w, b) = start, end
        v, w, a, b, way = v * length, w * length, a * length**2, b * length**2, q - p
        rows = (
            6 * way - 3 * (v + w) - 0.5 * (a - b),
            -15 * way + 8 * v + 7 * w + 1.5 * a - b,
            10 * way - 6 * v - 4 * w - 1.5 * a + 0.5 * b,
            0.5 * a,
            v,
            p,
        )
        self._coefficients: list[tuple[float, ...]] = [tuple(column) for column in np.array(rows).T.tolist()]

    def at(self, t: float) -> tuple[float, ...]:
        """Place at a share t of the piece."""
        return tuple(((((a * t + b) * t + c) * t + d) * t + e) * t + f for a, b, c, d, e, f in self._coefficients)


def slopes(points: Array, lengths: Array, first: Array | None, last: Array | None) -> tuple[Array, Array]:
    """Slopes and curvatures of the cubic spline through n points, shapes (n, m).

    Args:
        points: shape (n, m).
        lengths: of the parameter between them, shape (n - 1,).
        first: slope at the start, shape (m,); None: no curvature there.
        last: slope at the end; None: no curvature there.
    """
    n, steps = len(points), np.diff(points, axis=0) / lengths[:, None]
    matrix, right = np.zeros((n, n)), np.zeros_like(points)
    for i in range(1, n - 1):
        a, b = 1 / lengths[i - 1], 1 / lengths[i]
        matrix[i, i - 1 : i + 2] = a, 2 * (a + b), b
        right[i] = 3 * (steps[i - 1] * a + steps[i] * b)
    for row, other, fixed, step in ((0, 1, first, steps[0]), (n - 1, n - 2, last, steps[-1])):
        matrix[row, row] = 1.0
        right[row] = 1.5 * step if fixed is None else fixed
        matrix[row, other] = 0.5 if fixed is None else 0.0
    slope: Array = np.linalg.solve(matrix, right).astype(np.float64)
    curvature = np.empty_like(points)
    curvature[:-1] = (6 * steps - 4 * slope[:-1] - 2 * slope[1:]) / lengths[:, None]
    curvature[-1] = (4 * slope[-1] + 2 * slope[-2] - 6 * steps[-1]) / lengths[-1]
    return slope, curvature


class Piecewise:
    """Polynomial pieces one after the other.

    Args:
        lengths: of the parameter on them.
        pieces: as many.
    """

    def __init__(self, lengths: Array, pieces: list[Quintic]) -> None:
        ends = np.cumsum(lengths)
        self._pieces = pieces
        self._marks: list[float] = [0.0, *(ends / ends[-1]).tolist()]

    def at(self, s: float) -> tuple[float, ...]:
        """Place at a share s of the whole."""
        index = min(bisect_right(self._marks, s), len(self._pieces)) - 1
        low, high = self._marks[index], self._marks[index + 1]
        return self._pieces[index].at((s - low) / (high - low))


def through(points: Array, lengths: Array) -> Piecewise:
    """The smooth curve through points, shape (n, m), with lengths of the parameter between them, shape (n - 1,)."""
    slope, curvature = slopes(points, lengths, None, None)
    ends = list(zip(points, slope, curvature, strict=True))
    return Piecewise(
        lengths, [Quintic(h, a, b) for h, a, b in zip(lengths.tolist(), ends, ends[1:], strict=False)]
    )


class JointCurve:
    """Smooth curve through joint positions."""

    __slots__ = ("_curve",)

    def __init__(self, points: Array, lengths: Array) -> None:
        self._curve = through(points, lengths)

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad]; `near` is not needed here."""
        return np.array(self._curve.at(s))


class Orientations:
    """Smooth turning through orientations; it stands still between two that are the same.

    Args:
        places: shares of the whole at which they are, shape (n,), ascending.
        quats: shape (n, 4).
    """

    def __init__(self, places: Array, quats: Array) -> None:
        signed = quats.copy()
        for i in range(1, len(signed)):
            signed[i] *= -1.0 if signed[i] @ signed[i - 1] < 0 else 1.0
        self._places: list[float] = places.tolist()
        lengths = np.diff(places)
        steps = np.diff(signed, axis=0) / lengths[:, None]
        still = np.linalg.norm(steps, axis=1) < 1e-9
        none = np.zeros(4)
        slope = [none] * len(signed)
        for i in range(1, len(signed) - 1):
            if not (still[i - 1] or still[i]):
                share = lengths[i] / (lengths[i - 1] + lengths[i])
                slope[i] = share * steps[i - 1] + (1 - share) * steps[i]
        # at the ends the arm rests anyway: no need to begin the turning slowly as well
        slope[0], slope[-1] = (1.5 * steps[0] - 0.5 * slope[1], 1.5 * steps[-1] - 0.5 * slope[-2])
        if still[0] or len(signed) == 2:
            slope[0] = steps[0]
        if still[-1] or len(signed) == 2:
            slope[-1] = steps[-1]
        ends = [(q, v, none) for q, v in zip(signed, slope, strict=True)]
        self._pieces = [Quintic(h, a, b) for h, a, b in zip(lengths.tolist(), ends, ends[1:], strict=False)]

    def at(self, s: float) -> Quat:
        """Orientation at a share of the whole."""
        index = min(max(bisect_right(self._places, s) - 1, 0), len(self._pieces) - 1)
        low, high = self._places[index], self._places[index + 1]
        x, y, z, w = self._pieces[index].at(min(1.0, (s - low) / (high - low)))
        k = (x * x + y * y + z * z + w * w) ** -0.5
        return x * k, y * k, z * k, w * k


class Track:
    """Way of the moved frame along a spline block.

    Args:
        lengths: of the segments, shape (n,).
        segments: as many.
        turning: the orientation over the whole.
    """

    def __init__(self, lengths: Array, segments: list[Straight | Arc | Quintic], turning: Orientations) -> None:
        ends = np.cumsum(lengths)
        self.length = float(ends[-1])
        self.angle = 0.0
        self.marks: list[float] = [0.0, *(ends / ends[-1]).tolist()]
        self.marks[-1] = 1.0
        self._segments, self._turning = segments, turning

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        index = min(bisect_right(self.marks, s), len(self._segments)) - 1
        low, high = self.marks[index], self.marks[index + 1]
        segment, share = self._segments[index], min(1.0, (s - low) / (high - low))
        if isinstance(segment, Quintic):
            x, y, z = segment.at(share)
            return x, y, z
        return segment.point(share)

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        return self._turning.at(s)
