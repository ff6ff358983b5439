"""The speed override: how fast motion time runs under overrides, pauses, stops on the path and T1."""

from __future__ import annotations

from math import inf

import numpy as np

from heptarm.model.kinematics import flange, jacobian
from heptarm.planning.jerk_profile import JerkProfile, ProfileLimits, change
from heptarm.planning.motion import TICK
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Rate at which overrides and pauses change the speed: [1/s], [1/s²], [1/s³].
OVERRIDE_SLEW = ProfileLimits(4.0, 40.0, 800.0)
#: Below this factor the full speed cannot be computed from the set-points any more.
_FAINT = 1e-4
#: Fraction of the axes' acceleration with which a motion halts on its path: the rest is for its bend.
_GRIP = 0.98
#: Sharpness of the transition to the speed ceiling; higher is sharper.
_SHARPNESS = 8


class SpeedOverride:
    """Scales the time of motions.

    Args:
        robot: its acceleration limits hold during stops.

    Attributes:
        factor: motion time per plant time in the running tick, 0 to 1.
        scale: the same at the end of the tick.
        rate: its change [1/s].
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._step = _GRIP * robot.ddq_max * TICK
        self._free = 1.0  # the factor before a ceiling
        self._goal = 1.0
        self._slew: JerkProfile | None = None  # while it changes
        self._slew_time = 0.0
        self._full = np.zeros(7)  # velocity of the last set-points at full speed [rad/s]
        self._before = 1.0  # the factor of the last tick but one
        self.factor = self.scale = 1.0
        self.rate = 0.0

    @property
    def rests(self) -> bool:
        """Whether motion time does not advance."""
        return self.scale == 0.0 and self.factor == 0.0

    def rests_at(self, factor: float) -> bool:
        """Whether this was the factor for two ticks, so that `advance` to it without a ceiling changes nothing."""
        return (
            self._slew is None
            and factor == self._goal == self._free == self.factor == self.scale == self._before
            and self.rate == 0.0
        )

    def advance(
        self,
        goal: float,
        command: SetPoints,
        *,
        halts: bool = False,
        ceiling: float = inf,
        tcp: tuple[float, ...] = (0.0, 0.0, 0.0),
    ) -> None:
        """Advance by one tick.

        Args:
            goal: factor to reach smoothly.
            command: the set-points so far.
            halts: come to rest instead, as fast as the axes may brake along the path.
            ceiling: largest speed of a point on the flange [m/s].
            tcp: that point, in the flange's axes [m].
        """
        if halts:
            self._halt(command)
            return
        full = self._ahead(command) if ceiling < inf else None
        before, self._before = self._free, self.factor
        if goal != self._goal or self._slew is not None:
            self._ramp(goal)
        # trapezoidal, so that the speed is scale times the profile's
        self.factor, self.scale = 0.5 * (before + self._free), self._free
        self.rate = 0.0 if self._slew is None else self._slew.at(self._slew_time)[1]
        if full is None:
            return
        axes, origin = flange(self._robot, command.after.tolist())
        point = np.array(origin) + np.array(axes).T @ np.array(tcp)
        speed = float(np.linalg.norm(jacobian(self._robot, command.after, point)[:3] @ full))
        cap = (1.0 + (speed / ceiling) ** _SHARPNESS) ** (-1.0 / _SHARPNESS)
        self.factor *= cap
        self.scale *= cap
        self.rate *= cap

    @property
    def last_factor(self) -> float:
        """The factor of the tick before."""
        return self._before

    def change_by(self, part: float) -> None:
        """Make only a part of the running tick's change, 0 to 1, and the rest later: an axis cannot follow."""
        self.factor = self.scale = self._before + part * (self.factor - self._before)
        self.rate *= part
        if self._slew is not None:
            self._slew_time -= (1.0 - part) * TICK
            self._free = self._slewed(self._slew)

    def rest(self) -> None:
        """Motion time does not advance from now on; the motion begins again from rest."""
        self.factor = self.scale = self.rate = self._free = self._goal = self._before = 0.0
        self._slew = None

    def _halt(self, command: SetPoints) -> None:
        speed, ahead = (command.after - command.now) / TICK, self._ahead(command)
        factor = 0.0
        moving = np.abs(ahead) > 1e-9
        if moving.any():
            # the least factor with which no axis leaves its acceleration limit
            bounds = (speed[moving] - np.sign(ahead[moving]) * self._step[moving]) / ahead[moving]
            factor = min(self.scale, max(0.0, float(bounds.max())))
        self.rate, self._before = (factor - self.scale) / TICK, self.factor
        self.factor = self.scale = self._free = self._goal = factor
        self._slew = None

    def _ahead(self, command: SetPoints) -> Array:
        """Velocity of the next set-point at full speed, shape (7,) [rad/s]."""
        if self.factor < _FAINT or self._before < _FAINT:
            return self._full
        before, now, after = command
        self._full = (after - now) / (TICK * self.factor)
        return 2.0 * self._full - (now - before) / (TICK * self._before)

    def _ramp(self, goal: float) -> None:
        if goal != self._goal or self._slew is None:
            state = (self._free, 0.0, 0.0) if self._slew is None else self._slew.at(self._slew_time)
            self._goal, self._slew, self._slew_time = goal, change(state, goal, OVERRIDE_SLEW), 0.0
        elif self._slew_time >= self._slew.duration:
            self._free, self._slew = goal, None
            return
        self._slew_time += TICK
        self._free = self._slewed(self._slew)

    def _slewed(self, slew: JerkProfile) -> float:
        return (
            self._goal
            if self._slew_time >= slew.duration
            else min(1.0, max(0.0, slew.at(self._slew_time)[0]))
        )
