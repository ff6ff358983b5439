"""From commands, at most one per receive period, to one set-point per millisecond; and their limits."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from heptarm.fri.protocol.messages import CommandMode
from heptarm.planning.motion import TICK
from heptarm.sim.controller.setpoints import OVERSPEED, stoppable
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Ticks without a command during which the motion continues.
COAST = 5
#: Fraction of the acceleration with which set-points return to the commands: these accelerate, too.
_PLANNED = 0.5
#: Set-points this close to the reference, and this close to its speed, are on it [rad, rad/tick].
_TOGETHER = 1e-9


class CommandInterpolator:
    """Follows the commands of a client, one set-point per tick.

    The reference goes straight from command to command in the client's time, and on beyond the last one for a
    while; its mean over a receive period makes it smooth. So late answers do not hurry the arm, and set-points
    accelerate no harder than the commands. What is missing breaks the reference: the set-points then return to it
    within the limits of the axes.

    Args:
        robot: its limits hold.
        start: first set-point, shape (7,) [rad].
        ticks: receive period [ticks].
    """

    def __init__(self, robot: RobotModel, start: Array, *, ticks: int) -> None:
        self._ticks = ticks
        self._leap = OVERSPEED * robot.dq_max * TICK
        self._fastest, self._acceleration = robot.dq_max, robot.ddq_max
        self._low, self._high = robot.q_min, robot.q_max
        self._coast = max(COAST, 2 * ticks)
        self.q = start.copy()
        self._speed = np.zeros(7)  # [rad/tick], as all speeds here
        self._time = 0  # ticks so far
        self._arrival = -ticks - self._coast  # of the last command
        self._late = 0  # how late that was
        self._knots = deque([_Knot(0, start, np.zeros(7))])  # the one followed, and later ones
        self._has_begun = False
        self._window = deque([start] * ticks, maxlen=ticks)  # of the reference
        self._before = start  # the reference of the last tick
        self._is_broken = self._stays = False

    @property
    def age(self) -> int:
        """Ticks since the last command was due, at the latest."""
        return self._time - self._arrival + self._late

    def command(self, q: Array, *, after: int, late: int = 0) -> None:
        """Take a command.

        Args:
            q: shape (7,) [rad].
            after: ticks of the client's time since the command before.
            late: ticks since the message that it answers, beyond the one in which an answer is due.
        """
        self._arrival, self._late = self._time, late
        last, due = self._knots[-1], self._time - late + self._ticks
        before = last.due if self._has_begun else due - after
        self._is_broken = self._is_broken or self._stays or before < self._time
        self._has_begun, self._stays = True, False
        self._knots.append(_Knot(max(due, before + 1), q, (q - last.q) / after))

    def stay(self, q: Array) -> None:
        """Be at a position, shape (7,) [rad], until the next command; from there it returns to the commands."""
        self.q, self._speed, self._stays = q, np.zeros(7), True

    def tick(self) -> Array:
        """The set-point of the next tick, shape (7,) [rad]."""
        self._time += 1
        if not self._has_begun:
            return self.q
        while len(self._knots) > 1 and self._knots[0].due < self._time:
            self._knots.popleft()
        knot = self._knots[0]
        over = self._time - knot.due
        self._is_broken = self._is_broken or over > 0
        if self._stays or over > self._coast:
            self._window.extend([self.q] * self._ticks)
            self._before = self.q
            step = self._bounded(np.zeros(7))
        else:
            self._window.append(np.clip(knot.q + over * knot.speed, self._low, self._high))
            target = np.mean(self._window, axis=0) if self._ticks > 1 else self._window[0]
            step = self._towards(target, target - self._before)
            self._before = target
        self.q, self._speed = self.q + step, step
        return self.q

    def _towards(self, target: Array, speed: Array) -> Array:
        """The step to a target that moves with a speed, or as much of it as an axis can do."""
        step: Array = target - self.q
        lag = step - speed
        if (
            self._is_broken
            and np.abs(lag).max() < _TOGETHER
            and np.abs(speed - self._speed).max() < _TOGETHER
        ):
            self._is_broken = self._knots[0].due < self._time
        if not self._is_broken:
            return np.clip(step, -self._leap, self._leap)
        closing = stoppable(np.abs(lag), _PLANNED * self._acceleration) * TICK
        return self._bounded(speed + np.sign(lag) * np.minimum(np.abs(lag), closing))

    def _bounded(self, step: Array) -> Array:
        """The step nearest to another one within velocity and acceleration, that stops before the position limits."""
        fastest, change = self._fastest * TICK, self._acceleration * TICK * TICK
        step = np.clip(np.clip(step, -fastest, fastest), self._speed - change, self._speed + change)
        down = stoppable(self.q - self._low, self._acceleration) * TICK
        up = stoppable(self._high - self.q, self._acceleration) * TICK
        return np.clip(step, -down, up)


@dataclass(frozen=True, slots=True)
class _Knot:
    """A command: the tick at which its position is due, and the speed on the way there [rad/tick]."""

    due: int
    q: Array
    speed: Array


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
