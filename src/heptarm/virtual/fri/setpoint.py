"""From commands, one each receive period at best, to a set-point each millisecond.

A command is reached one receive period after it came, on a cubic whose velocity at the end is that of the last two
commands; at 1 ms it is taken as it is. KUKA does not say what a cabinet does when a command is missing. Here the
set-point goes on with the last velocity for `COAST` ms, or two receive periods if these are longer, then brakes with
the axes' acceleration. When commands come again it moves to them with no axis faster than `OVERSPEED` allows.
"""

from __future__ import annotations

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.tick import TICK

#: Ticks without a command during which the motion goes on.
COAST = 5
#: A set-point moves at most this many times as fast as an axis may.
OVERSPEED = 1.2


class SetPoint:
    """The set-point under a stream of commands.

    Args:
        robot: whose limits hold.
        start: where it is, shape (7,) [rad].
        ticks: receive period [ticks].
    """

    def __init__(self, robot: RobotModel, start: Array, *, ticks: int) -> None:
        self._ticks = ticks
        self._leap = OVERSPEED * robot.dq_max * TICK
        self._slowing = robot.ddq_max * TICK * TICK
        self._least, self._most = robot.q_min, robot.q_max
        self._coast = max(COAST, 2 * ticks)
        self.q = start.copy()
        self._speed = np.zeros(7)  # [rad/tick], as all speeds here
        self._from, self._from_speed = self.q, self._speed
        self._goal, self._goal_speed = self.q, self._speed
        self._age = ticks + self._coast  # ticks since the last command
        self._last = self.q

    @property
    def age(self) -> int:
        """Ticks since the last command."""
        return self._age

    def command(self, q: Array, *, after: int) -> None:
        """Take a command, shape (7,) [rad], `after` ticks of its client's time later than the one before."""
        self._from, self._from_speed = self.q, self._speed
        self._goal_speed = (q - self._last) / after
        self._goal = self._last = q
        self._age = 0

    def tick(self) -> Array:
        """The set-point of the next tick, shape (7,) [rad]."""
        self._age += 1
        if self._age <= self._ticks:
            wanted = self._on_the_way(self._age / self._ticks)
        elif self._age <= self._ticks + self._coast:
            wanted = self._goal + (self._age - self._ticks) * self._goal_speed
        else:
            wanted = self.q + self._speed - np.clip(self._speed, -self._slowing, self._slowing)
        wanted = np.clip(wanted, self._least, self._most)
        step = np.clip(wanted - self.q, -self._leap, self._leap)
        self.q = self.q + step
        self._speed = step
        return self.q

    def _on_the_way(self, s: float) -> Array:
        """Cubic from where the command came to the command; s in (0, 1]."""
        if s >= 1.0:
            return self._goal
        n, r = self._ticks, 1.0 - s
        rise = s * s * (3.0 - 2.0 * s)
        return (
            self._from
            + rise * (self._goal - self._from)
            + (n * s * r * r) * self._from_speed
            - (n * s * s * r) * self._goal_speed
        )
