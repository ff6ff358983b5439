"""A taught path in short pieces: how far an arm was from it, and how late it was on it."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np

from heptarm.values.checks import Array
from heptarm.values.motion.trajectory import Trajectory

#: Longest piece [rad], unless there would be more pieces than this.
_PIECE, _MOST_PIECES = 1e-3, 200_000
#: Pieces in one box.
_BOX = 64
#: Longest delay that is looked for, in the time of the trajectory [s]; and from so many positions.
LONGEST_LAG, _MOST_LAGS = 2.0, 2000
#: Places of a path are as near as the nearest one up to this [rad]. A slower path shows no delay [rad/s].
_AS_NEAR, _SLOW = 1e-3, 0.02


class TaughtPath:
    """The path of a trajectory, as straight pieces that are so short that their ends and feet are near enough.

    Args:
        trajectory: linear between two of its points.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        steps = np.abs(np.diff(trajectory.q, axis=0)).max(axis=1)
        longest = max(_PIECE, float(steps.sum()) / _MOST_PIECES)
        counts = np.maximum(np.ceil(steps / longest), 1.0).astype(np.int64)
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        spans = np.repeat(np.diff(trajectory.times) / counts, counts)
        begins = np.repeat(trajectory.times[:-1], counts) + inside * spans
        self._times = np.append(begins, trajectory.duration)
        self._q = trajectory.positions(self._times)
        self._along = np.diff(self._q, axis=0)
        self._squares = np.maximum(np.einsum("ij,ij->i", self._along, self._along), 1e-300)
        speeds = np.abs(self._along).max(axis=1) / np.diff(self._times)
        self._is_moving = speeds > min(_SLOW, 0.5 * float(speeds.max()))
        starts = np.arange(0, len(self._along), _BOX)
        self._low = np.minimum(*(np.minimum.reduceat(ends, starts) for ends in (self._q[:-1], self._q[1:])))
        self._high = np.maximum(*(np.maximum.reduceat(ends, starts) for ends in (self._q[:-1], self._q[1:])))

    def deviation(self, seen: Sequence[Array]) -> float:
        """Largest distance of any axis of joint positions, shape (7,) each, from the path, whatever the time [rad]."""
        largest, box = 0.0, 0
        for q in seen:
            # most are near the ones before, which is all that matters unless they are the farthest ones so far
            distance, box = self._nearest_in(q, max(box - 1, 0), box + 2)
            if distance <= largest:
                continue
            bounds = np.maximum(self._low - q, q - self._high).max(axis=1)
            for other in bounds.argsort().tolist():
                if distance <= max(float(bounds[other]), largest):
                    break
                found, place = self._nearest_in(q, other, other + 1)
                if found < distance:
                    distance, box = found, place
            largest = max(largest, distance)
        return largest

    def lag(self, times: Sequence[float], seen: Sequence[Array]) -> float:
        """Median delay at joint positions, shape (7,) each, that an arm had at times [s]; NaN: nothing moves there."""
        every = -(-len(times) // _MOST_LAGS) or 1
        found = (self._delay(t, q) for t, q in zip(times[::every], seen[::every], strict=True))
        # where the path rests, all of its times are as near
        moving = [late for late, is_moving in found if is_moving]
        return float(np.median(moving)) if moving else nan

    def _nearest_in(self, q: Array, first: int, last: int) -> tuple[float, int]:
        """Distance from the path in some of its boxes [rad], and the box that is nearest."""
        begin, end = first * _BOX, min(last * _BOX, len(self._along))
        distances = np.minimum(
            self._feet(q, begin, end)[0],
            np.abs(q - self._q[begin:end]).max(axis=1),
        )
        nearest = int(distances.argmin())
        return float(distances[nearest]), (begin + nearest) // _BOX

    def _feet(self, q: Array, begin: int, end: int) -> tuple[Array, Array]:
        """Distances from the nearest points of pieces [rad], and where on these they are, [0, 1]."""
        off, along = q - self._q[begin:end], self._along[begin:end]
        part = np.clip(np.einsum("ij,ij->i", off, along) / self._squares[begin:end], 0.0, 1.0)
        return np.abs(off - part[:, None] * along).max(axis=1), part

    def _delay(self, t: float, q: Array) -> tuple[float, bool]:
        """By how much an arm was late at a time [s], and whether the path moves there."""
        begin = max(int(np.searchsorted(self._times, t - LONGEST_LAG, side="right")) - 1, 0)
        end = min(max(int(np.searchsorted(self._times, t)), begin + 1), len(self._along))
        begin = min(begin, end - 1)
        distances, part = self._feet(q, begin, end)
        padded = np.concatenate([[np.inf], distances, [np.inf]])
        is_least = (distances <= padded[:-2]) & (distances <= padded[2:])
        # a path that turns back passes most places twice within a short time: the last pass counts
        index = int(np.flatnonzero(is_least & (distances <= distances.min() + _AS_NEAR))[-1])
        there, after = self._times[begin + index], self._times[begin + index + 1]
        return max(t - float(there + part[index] * (after - there)), 0.0), bool(
            self._is_moving[begin + index]
        )
