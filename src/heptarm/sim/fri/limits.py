"""From commands, at most one per receive period, to one set-point per millisecond; and their limits."""

from __future__ import annotations

import numpy as np

from heptarm.fri.protocol.messages import CommandMode
from heptarm.planning.motion import TICK
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Ticks without a command during which the motion continues.
COAST = 5
#: Largest velocity of a set-point, relative to the axis' limit.
OVERSPEED = 1.2


class CommandInterpolator:
    """Interpolates between the commands of a client.

    Args:
        robot: its limits hold.
        start: first set-point, shape (7,) [rad].
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
        """Take a command, shape (7,) [rad], `after` ticks of the client's time later than the one before."""
        self._from, self._from_speed = self.q, self._speed
        self._goal_speed = (q - self._last) / after
        self._goal = self._last = q
        self._age = 0

    def tick(self) -> Array:
        """The set-point of the next tick, shape (7,) [rad]."""
        self._age += 1
        if self._age <= self._ticks:
            target = self._interpolated(self._age / self._ticks)
        elif self._age <= self._ticks + self._coast:
            target = self._goal + (self._age - self._ticks) * self._goal_speed
        else:
            target = self.q + self._speed - np.clip(self._speed, -self._slowing, self._slowing)
        target = np.clip(target, self._least, self._most)
        step = np.clip(target - self.q, -self._leap, self._leap)
        self.q = self.q + step
        self._speed = step
        return self.q

    def _interpolated(self, s: float) -> Array:
        """Cubic from the set-point at the arrival of the command to the command; s in (0, 1]."""
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


#: Under a torque overlay the position only preloads a spring; public clients command it up to 0.1 rad off.
COMPLIANT_DELTA = 0.12
#: Largest superposed force and torque [N, Nm].
FORCE, MOMENT = 500.0, 200.0

_WRENCH = np.array((FORCE,) * 3 + (MOMENT,) * 3)


class CommandLimits:
    """Limits of a client's commands in one command mode."""

    def __init__(self, robot: RobotModel, mode: CommandMode) -> None:
        self._robot = robot
        self._leap = OVERSPEED * robot.dq_max * TICK
        self._least_delta = COMPLIANT_DELTA if mode is CommandMode.TORQUE else 0.0

    def position(self, q: Array, before: Array, ticks: int) -> str:
        """Why a joint position, shape (7,) [rad], `ticks` after the one before, is illegal; empty if it is legal."""
        robot = self._robot
        if not np.isfinite(q).all():
            return f"Illegal axis position: A{_first(~np.isfinite(q))} is not finite"
        outside = (q < robot.q_min) | (q > robot.q_max)
        if outside.any():
            axis = _first(outside)
            value, low, high = np.degrees((q[axis - 1], robot.q_min[axis - 1], robot.q_max[axis - 1]))
            return (
                f"Illegal axis position: A{axis} at {value:.2f} deg; allowed is [{low:.0f}, {high:.0f}] deg"
            )
        legal = np.maximum(self._leap * ticks, self._least_delta)
        delta = np.abs(q - before)
        if (delta > legal).any():
            axis = _first(delta > legal)
            moved, most = np.degrees((delta[axis - 1], legal[axis - 1]))
            return f"Illegal axis delta: A{axis} by {moved:.3f} deg in {ticks} ms; allowed is {most:.3f} deg"
        return ""

    def torque(self, tau: Array) -> str:
        """Why superposed torques, shape (7,) [Nm], are illegal; empty if they are legal."""
        wrong = ~(np.abs(tau) <= self._robot.tau_max)
        if wrong.any():
            axis = _first(wrong)
            return f"Illegal torque: A{axis} {tau[axis - 1]:g} Nm; allowed is {self._robot.tau_max[axis - 1]:g} Nm"
        return ""

    def wrench(self, wrench: Array) -> str:
        """Why a superposed wrench, shape (6,) [N, Nm], is illegal; empty if it is legal."""
        wrong = ~(np.abs(wrench) <= _WRENCH)
        if wrong.any():
            return f"Illegal wrench: {wrench.tolist()}; allowed are {FORCE:g} N and {MOMENT:g} Nm"
        return ""


def _first(wrong: np.ndarray) -> int:
    """Number of the first wrong axis, from 1."""
    return int(wrong.argmax()) + 1
