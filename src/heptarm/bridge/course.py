"""Where a runner leads the arm from now on, if nothing changes: one leg after the other, in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from heptarm.values.arrays import Array


class Path(Protocol):
    """Positions over a time of their own."""

    def positions(self, times: Array) -> Array:
        """Where it is at times, shape (n,) [s]; shape (n, 7) [rad]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A part of a course.

    Attributes:
        begin: when it begins, on the runner's clock [s].
        path: where it leads.
        at: the path's time then [s].
        pace: how fast the path's time goes.
    """

    begin: float
    path: Path
    at: float = 0.0
    pace: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Where the arm is led.

    Attributes:
        key: equal for two courses of which the later one goes on with the earlier one.
        legs: one after the other; the first counts before its begin, too.
    """

    key: tuple[float, ...]
    legs: tuple[Leg, ...]

    def positions(self, times: Array) -> Array:
        """Where the arm is led at times of the runner's clock, shape (n,) [s]; shape (n, 7) [rad]."""
        out = np.empty((len(times), 7))
        for number, leg in enumerate(self.legs):
            here = times >= leg.begin if number else np.ones(len(times), dtype=bool)
            out[here] = leg.path.positions(leg.at + leg.pace * (times[here] - leg.begin))
        return out
