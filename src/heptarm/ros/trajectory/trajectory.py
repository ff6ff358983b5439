"""Trajectories of seven joints: interpolation between points, braking, and the preview of coming set-points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from heptarm.values.checks import Array, Value, frozen


@dataclass(frozen=True, slots=True, eq=False)
class KinematicState(Value):
    """Position, velocity and acceleration of all joints at one time.

    Attributes:
        q: positions, shape (7,) [rad].
        dq: velocities, shape (7,) [rad/s].
        ddq: accelerations, shape (7,) [rad/s²].
    """

    q: Array
    dq: Array
    ddq: Array

    @staticmethod
    def at_rest(q: Array) -> KinematicState:
        """Make the state of rest at `q`, shape (7,) [rad]."""
        zeros = frozen(np.zeros(7))
        return KinematicState(q, zeros, zeros)


@dataclass(frozen=True, slots=True, eq=False)
class TrajectorySample(Value):
    """A trajectory that is executed, at one instant.

    Attributes:
        desired: where the arm should be.
        time: on the trajectory, scaled by the override [s].
        elapsed: since its start [s].
    """

    desired: KinematicState
    time: float
    elapsed: float


class JointTrajectory:
    """Piecewise polynomial through points in time.

    A piece is linear if one of its ends has only positions, cubic if both have velocities, quintic if both have
    accelerations as well.

    Args:
        times: of the points, increasing, shape (n,) [s].
        q: positions, shape (n, 7) [rad].
        dq: velocities, shape (n, 7) [rad/s]; a row of NaN: not given.
        ddq: accelerations, likewise [rad/s²].

    Attributes:
        times: see above.
        points: the positions, shape (n, 7) [rad].
    """

    def __init__(self, times: Array, q: Array, dq: Array, ddq: Array) -> None:
        self.times = frozen(times)
        self.points = frozen(q)
        self._pieces = _pieces(times, q, dq, ddq)
        self._last = KinematicState(
            frozen(q[-1]), frozen(np.nan_to_num(dq[-1])), frozen(np.nan_to_num(ddq[-1]))
        )

    @property
    def duration(self) -> float:
        """Time of the last point [s]."""
        return float(self.times[-1])

    @property
    def end(self) -> KinematicState:
        """State at the last point."""
        return self._last

    def sample(self, t: float) -> KinematicState:
        """Evaluate at a time [s], clamped to the first and the last point."""
        if t >= self.times[-1]:
            return self._last
        piece = max(int(np.searchsorted(self.times, t, side="right")) - 1, 0)
        x = max(t - float(self.times[piece]), 0.0)
        c = self._pieces[piece]
        q = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))
        dq = c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5])))
        ddq = 2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5]))
        return KinematicState(q, dq, ddq)

    def positions(self, times: Array) -> Array:
        """Evaluate positions at many times, shape (n,) [s]; returns shape (n, 7) [rad]."""
        if len(self._pieces) == 0:
            return np.tile(self._last.q, (len(times), 1))
        t = np.clip(times, self.times[0], self.times[-1])
        piece = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self._pieces) - 1)
        x, c = (t - self.times[piece])[:, None], self._pieces[piece]
        q = c[:, 0] + x * (c[:, 1] + x * (c[:, 2] + x * (c[:, 3] + x * (c[:, 4] + x * c[:, 5]))))
        return np.asarray(np.where((t >= self.times[-1])[:, None], self._last.q, q))

    def index(self, t: float) -> int:
        """Index of the point that is approached at a time [s]."""
        return int(np.searchsorted(self.times, t, side="left"))

    def extremes(self, per_piece: int = 16) -> tuple[Array, Array]:
        """Sample positions [rad] and velocities [rad/s], `per_piece` of every piece, shape (m, 7) each."""
        if len(self._pieces) == 0:
            return self._last.q[None], self._last.dq[None]
        fraction = np.linspace(0.0, 1.0, per_piece)
        x = (np.diff(self.times)[:, None] * fraction)[..., None]
        c = self._pieces[:, :, None, :]
        q = c[:, 0] + x * (c[:, 1] + x * (c[:, 2] + x * (c[:, 3] + x * (c[:, 4] + x * c[:, 5]))))
        dq = c[:, 1] + x * (2 * c[:, 2] + x * (3 * c[:, 3] + x * (4 * c[:, 4] + x * 5 * c[:, 5])))
        return q.reshape(-1, 7), dq.reshape(-1, 7)


def _pieces(times: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """Polynomial coefficients of the pieces, shape (n - 1, 6, 7), lowest power first."""
    span = np.diff(times)[:, None]
    q0, q1, v0, v1, a0, a1 = q[:-1], q[1:], dq[:-1], dq[1:], ddq[:-1], ddq[1:]
    out = np.zeros((len(q) - 1, 6, 7))
    step = q1 - q0
    out[:, 0], out[:, 1] = q0, step / span
    cubic = ~np.isnan(v0 + v1).any(axis=1)
    t, d = span[cubic], step[cubic]
    b0, b1 = v0[cubic], v1[cubic]
    out[cubic, 1] = b0
    out[cubic, 2] = (3 * d / t - 2 * b0 - b1) / t
    out[cubic, 3] = (b0 + b1 - 2 * d / t) / t**2
    quintic = cubic & ~np.isnan(a0 + a1).any(axis=1)
    t, d = span[quintic], step[quintic]
    b0, b1, c0, c1 = v0[quintic], v1[quintic], a0[quintic], a1[quintic]
    out[quintic, 2] = c0 / 2
    out[quintic, 3] = (20 * d / t - 8 * b1 - 12 * b0 - (3 * c0 - c1) * t) / (2 * t**2)
    out[quintic, 4] = (-30 * d / t + 14 * b1 + 16 * b0 + (3 * c0 - 2 * c1) * t) / (2 * t**3)
    out[quintic, 5] = (12 * d / t - 6 * (b0 + b1) - (c0 - c1) * t) / (2 * t**4)
    return out


class BrakingTrajectory:
    """Brake to rest along the tangent: all joints stop together, each with constant deceleration.

    Args:
        begin: state to brake from.
        deceleration: largest deceleration of each joint, shape (7,) [rad/s²].
        low: lower position limits, shape (7,) [rad].
        high: upper position limits, shape (7,) [rad].

    Attributes:
        duration: time to rest [s].
    """

    def __init__(self, begin: KinematicState, deceleration: Array, low: Array, high: Array) -> None:
        self._begin, self._low, self._high = begin, low, high
        self.duration = float(np.max(np.abs(begin.dq) / deceleration))

    def sample(self, t: float) -> KinematicState:
        """Evaluate `t` seconds after its start."""
        if self.duration <= 0.0:
            return KinematicState.at_rest(self._begin.q)
        x = min(max(t, 0.0), self.duration)
        dq = self._begin.dq * (1.0 - x / self.duration)
        q = self._begin.q + x * (self._begin.dq + dq) / 2
        held = np.minimum(np.maximum(q, self._low), self._high)
        slowing = -self._begin.dq / self.duration if x < self.duration else np.zeros(7)
        return KinematicState(held, np.where(held == q, dq, 0.0), np.where(held == q, slowing, 0.0))

    def positions(self, times: Array) -> Array:
        """Evaluate positions at many times, shape (n,) [s]; returns shape (n, 7) [rad]."""
        if self.duration <= 0.0:
            return np.tile(self._begin.q, (len(times), 1))
        x = np.clip(times, 0.0, self.duration)[:, None]
        q = self._begin.q + x * self._begin.dq * (1.0 - x / (2.0 * self.duration))
        return np.asarray(np.clip(q, self._low, self._high))


class TimedPositions(Protocol):
    """Joint positions as a function of time."""

    def positions(self, times: Array) -> Array:
        """Evaluate at times, shape (n,) [s]; returns shape (n, 7) [rad]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PreviewSegment:
    """A segment of a preview.

    Attributes:
        begin: start time on the clock of the execution [s].
        path: positions over a time of its own.
        at: that time at `begin` [s].
        rate: how fast that time passes; the speed override.
    """

    begin: float
    path: TimedPositions
    at: float = 0.0
    rate: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """Set-points from now on, as far as they are known.

    Attributes:
        key: equal in two previews if the later one continues the earlier one unchanged.
        segments: one after the other; the first one also holds before its start.
    """

    key: tuple[float, ...]
    segments: tuple[PreviewSegment, ...]

    def positions(self, times: Array) -> Array:
        """Evaluate at times on the clock of the execution, shape (n,) [s]; returns shape (n, 7) [rad]."""
        out = np.empty((len(times), 7))
        for number, segment in enumerate(self.segments):
            inside = times >= segment.begin if number else np.ones(len(times), dtype=bool)
            out[inside] = segment.path.positions(segment.at + segment.rate * (times[inside] - segment.begin))
        return out
