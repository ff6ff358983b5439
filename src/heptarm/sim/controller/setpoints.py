"""The set-points of a simulated controller, checked against velocity and position limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from heptarm.planning.motion import TICK
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Set-points this far beyond a limit are rounding errors [rad].
ON_LIMIT = 1e-9
#: So far beyond a limit a compliant arm gives when it is pushed there [rad]: position control begins on the limit
#: then, and its pull is a fiftieth of what a drive may lag behind.
GIVEN = 1e-3
#: Largest velocity of a set-point, relative to the axis' limit.
OVERSPEED = 1.2


class SetPoints:
    """Set-points of the last, this and the next tick; iterates over them.

    Args:
        robot: its limits hold.
        here: first set-point, at rest, shape (7,) [rad].

    Attributes:
        before: of the last tick, shape (7,) [rad].
        now: of this tick.
        after: of the next tick.
        largest_step: of an axis from one to the next, shape (7,) [rad].
    """

    __slots__ = ("_fastest", "_highest", "_lowest", "_small", "after", "before", "largest_step", "now")

    before: Array
    now: Array
    after: Array

    def __init__(self, robot: RobotModel, here: Array) -> None:
        self._fastest = robot.dq_max
        self.largest_step = OVERSPEED * robot.dq_max * TICK
        self._small = float(self.largest_step.min()) ** 2
        self._lowest, self._highest = robot.q_min - ON_LIMIT, robot.q_max + ON_LIMIT
        self.stay(here)

    def __iter__(self) -> Iterator[Array]:
        yield self.before
        yield self.now
        yield self.after

    @property
    def rests(self) -> bool:
        """Whether the next one equals this one."""
        return bool((self.after == self.now).all())

    @property
    def speed(self) -> Array:
        """Their velocity, within the axes' limits, shape (7,) [rad/s]; the same before and after a shift."""
        step = self.after - (self.before if self.now is self.after else self.now)
        speed: Array = np.clip(step / TICK, -self._fastest, self._fastest)
        return speed

    def shift(self) -> None:
        """Advance by a tick; the next set-point stays the same until another one is set."""
        self.before, self.now = self.now, self.after

    def stay(self, here: Array) -> None:
        """Rest at a position; on a limit, where a compliant arm is a hair beyond it."""
        inside = np.clip(here, self._lowest + ON_LIMIT, self._highest - ON_LIMIT)
        here = np.where(np.abs(inside - here) < GIVEN, inside, here)
        self.before, self.now, self.after = here.copy(), here.copy(), here.copy()

    def continue_from(self, here: Array, speed: Array) -> None:
        """Continue from a position and a velocity [rad/s]; called after a shift."""
        self.before = here - speed * TICK
        self.now = self.after = here.copy()

    def leap(self, there: Array) -> int | None:
        """The fastest axis that a next set-point would move too fast, from 0; None: there is none."""
        step = there - self.after
        if float(step @ step) <= self._small:  # the usual case: all axes together stay below each limit
            return None
        leap = np.abs(step) > self.largest_step
        return int(leap.argmax()) if leap.any() else None

    def beyond(self, there: Array) -> int | None:
        """The first axis that a set-point would move beyond its limits, from 0; None: there is none."""
        beyond = (there > self._highest) | (there < self._lowest)
        return int(beyond.argmax()) if beyond.any() else None


def stoppable(room: Array, acceleration: Array) -> Array:
    """Largest speeds for the next tick after which axes still come to rest within a distance, shape (7,) [rad/s].

    The speed changes from tick to tick: that of m accelerations times a tick stops within 1 + ... + m of the steps that
    one of them makes, and between two of these speeds the distance is linear.
    """
    step = acceleration * TICK
    room = np.maximum(room, 0.0)
    whole = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * room / (step * TICK)) - 1.0))
    most: Array = 0.5 * whole * step + room / ((whole + 1.0) * TICK)
    return most
