"""The inner loops of the timing of paths with numpy: what `native/path_timing.c` is compared with."""

from __future__ import annotations

import numpy as np

from heptarm.planning.time_scaling import SPARE, PathConstraints
from heptarm.values.checks import Array


def least_around(s: Array, values: Array, reaches: Array) -> Array:
    """See `heptarm.planning.time_scaling.least_around`."""
    result = values.copy()
    lows, highs = np.searchsorted(s, s - reaches), np.searchsorted(s, s + reaches)
    for value, low, high in zip(values, lows, highs):
        result[low:high] = np.minimum(result[low:high], value)
    return result


def reachable(s: Array, free: Array, taken: Array, square: Array) -> Array:
    """See `heptarm.planning.time_scaling.reachable`."""
    x, gaps, least = square.copy(), 2.0 * np.diff(s), SPARE * free.min(axis=1)
    for k in range(len(x) - 1):
        more = (free[k : k + 2] - taken[k : k + 2] * x[k]).min()
        x[k + 1] = min(x[k + 1], x[k] + gaps[k] * max(least[k], more)) if x[k] < x[k + 1] else x[k + 1]
    for k in range(len(x) - 1, 0, -1):
        more = (free[k - 1 : k + 1] - taken[k - 1 : k + 1] * x[k]).min()
        x[k - 1] = min(x[k - 1], x[k] + gaps[k - 1] * max(least[k], more)) if x[k] < x[k - 1] else x[k - 1]
    return x


def excess(path: PathConstraints, step: float, speed: Array) -> Array:
    """See `heptarm.planning.time_scaling.Excess`."""
    place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
    place = path.s[0] + place * ((path.s[-1] - path.s[0]) / place[-1])
    v, acceleration = speed[:, None], np.gradient(speed, step)
    a, j = acceleration[:, None], np.gradient(acceleration, step)[:, None]
    steepest, first, second, third = (
        np.column_stack([np.interp(place, path.s, column) for column in x.T])
        for x in (path.steepest, path.first, path.second, path.third)
    )
    at = np.clip(np.searchsorted(path.s, place), 0, len(path.s) - 1)
    fast = np.maximum((steepest * v / path.velocity[at]).max(axis=1), speed / path.fastest[at])
    hard = np.abs(first * a + second * v**2) / path.acceleration[at]
    sudden = np.abs(first * j + 3 * second * v * a + third * v**3) / path.jerk[at]
    result = np.zeros((3, len(path.s)))
    for row, seen in zip(result, (fast, hard.max(axis=1), sudden.max(axis=1)), strict=True):
        np.maximum.at(row, at, seen)
    return result
