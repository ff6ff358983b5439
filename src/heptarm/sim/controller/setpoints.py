"""The set-points of a simulated controller, and what its axes could not follow."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.tick import TICK

#: Set-points this far behind a limit are rounding errors [rad].
ON_LIMIT = 1e-9
#: A set-point that asks for more than this many times an axis' speed is not followed.
OVERSPEED = 1.2


class SetPoints:
    """Those of the last, this and the next tick; iterates over them.

    Args:
        robot: whose axes have to follow.
        here: where they begin, at rest, shape (7,) [rad].

    Attributes:
        before: of the last tick, shape (7,) [rad].
        now: of this tick.
        after: of the next tick.
    """

    __slots__ = ("_fastest", "_highest", "_leap", "_lowest", "after", "before", "now")

    before: Array
    now: Array
    after: Array

    def __init__(self, robot: RobotModel, here: Array) -> None:
        self._fastest = robot.dq_max
        self._leap = OVERSPEED * robot.dq_max * TICK
        self._lowest, self._highest = robot.q_min - ON_LIMIT, robot.q_max + ON_LIMIT
        self.stay(here)

    def __iter__(self) -> Iterator[Array]:
        yield self.before
        yield self.now
        yield self.after

    @property
    def rests(self) -> bool:
        """Whether the next one is where this one is."""
        return bool((self.after == self.now).all())

    @property
    def speed(self) -> Array:
        """How fast they move, within the axes' limits, shape (7,) [rad/s]; the same before and after a shift."""
        step = self.after - (self.before if self.now is self.after else self.now)
        speed: Array = np.clip(step / TICK, -self._fastest, self._fastest)
        return speed

    def shift(self) -> None:
        """A tick goes by; the next set-point is the same until another one is set."""
        self.before, self.now = self.now, self.after

    def stay(self, here: Array) -> None:
        """Rest at a position."""
        self.before, self.now, self.after = here.copy(), here.copy(), here.copy()

    def go_on(self, here: Array, speed: Array) -> None:
        """Be at a position, having come there at a speed [rad/s]; called after a shift."""
        self.before = here - speed * TICK
        self.now = self.after = here.copy()

    def leap(self, there: Array) -> int | None:
        """The fastest axis of those that could not follow to a next set-point, from 0; None: all could."""
        leap = np.abs(there - self.after) > self._leap
        return int(leap.argmax()) if leap.any() else None

    def beyond(self, there: Array) -> int | None:
        """The first axis that a set-point would lead beyond its limits, from 0; None: there is none."""
        beyond = (there > self._highest) | (there < self._lowest)
        return int(beyond.argmax()) if beyond.any() else None
