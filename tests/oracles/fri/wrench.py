"""Estimate of the external wrench from the sensors of the joints, in Python: what native/kinematics.h has to do."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt

from heptarm.fri.protocol.messages import JOINTS

#: Damping of the inverse: near singular postures the estimate becomes too small instead of arbitrarily large.
DAMPING = 1e-4
_DIRECTION = (2, 1, 2, 1, 2, 1, 2)
_SIGN = (1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0)
_Vector = Sequence[float]


class WrenchEstimator:
    """Wrench on the flange that explains the external torques best: min |J' F - tau_ext|, damped.

    It is as good as the load data, and assumes a contact at the tool: a push on the elbow is explained, too. Damped
    least squares after Siciliano et al., "Robotics", 2009, section 3.5; kinematics.h has the same operations in the
    same order.

    Args:
        chain: see `chain_of`.

    Attributes:
        chain: likewise.
    """

    def __init__(self, chain: Sequence[float]) -> None:
        self.chain = tuple(chain)
        self._origins = [tuple(chain[3 * i : 3 * i + 3]) for i in range(JOINTS)]
        self._flange = tuple(chain[3 * JOINTS :])
        self._posture: tuple[float, ...] | None = None
        self._inverse: list[list[float]] = []

    def wrench(self, q: Sequence[float], tau_ext: Sequence[float]) -> list[float]:
        """Estimate the wrench.

        Args:
            q: positions [rad].
            tau_ext: external torques [Nm].

        Returns:
            Force and moment on the flange in base axes [N, Nm].
        """
        if self._posture != tuple(q):
            self._posture, self._inverse = tuple(q), self._inverse_of(q)
        return [_dot(row, tau_ext) for row in self._inverse]

    def _inverse_of(self, q: Sequence[float]) -> list[list[float]]:
        """Damped inverse of the transposed Jacobian, of shape (6, 7)."""
        columns = [list(column) for column in self._jacobian(q)]
        rows = [[column[r] for column in columns] for r in range(6)]
        factor = [[0.0] * 6 for _ in range(6)]
        for i in range(6):
            for j in range(i + 1):
                value = _dot(rows[i], rows[j]) + (DAMPING if i == j else 0.0)
                value -= _dot(factor[i][:j], factor[j])
                factor[i][j] = sqrt(value) if i == j else value / factor[j][j]
        for column in columns:
            for i in range(6):
                column[i] = (column[i] - _dot(factor[i][:i], column)) / factor[i][i]
            for i in range(5, -1, -1):
                for j in range(i + 1, 6):
                    column[i] -= factor[j][i] * column[j]
                column[i] /= factor[i][i]
        return [[column[r] for column in columns] for r in range(6)]

    def _jacobian(self, q: Sequence[float]) -> list[tuple[float, ...]]:
        """Columns of the Jacobian of the flange."""
        turn = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        place = [0.0, 0.0, 0.0]
        joints = []
        for angle, origin, direction, sign in zip(q, self._origins, _DIRECTION, _SIGN, strict=True):
            c, s = cos(angle), sin(angle) * sign
            first, second = (0, 1) if direction == 2 else (2, 0)
            place = [value + _dot(row, origin) for value, row in zip(place, turn, strict=True)]
            for row in turn:
                u, v = row[first], row[second]
                row[first], row[second] = c * u + s * v, c * v - s * u
            joints.append(([sign * row[direction] for row in turn], place))
        tip = [value + _dot(row, self._flange) for value, row in zip(place, turn, strict=True)]
        columns: list[tuple[float, ...]] = []
        for (ax, ay, az), point in joints:
            x, y, z = (end - start for end, start in zip(tip, point, strict=True))
            columns.append((ay * z - az * y, az * x - ax * z, ax * y - ay * x, ax, ay, az))
        return columns


def _dot(a: _Vector, b: _Vector) -> float:
    """Sum of products, added in their order as C does; `b` may be longer."""
    total = 0.0
    for one, other in zip(a, b, strict=False):
        total += one * other
    return total
