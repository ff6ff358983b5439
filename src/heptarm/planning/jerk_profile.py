"""Jerk-limited profiles of the path parameter s: to the end of the path, and to a stop on it.

Ruckig computes both in one dimension, where it is exact and needs no intermediate waypoints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Trajectory

from heptarm.values.checks import Array


@dataclass(frozen=True, slots=True)
class ProfileLimits:
    """Largest velocity, acceleration and jerk of s, all positive."""

    velocity: float
    acceleration: float
    jerk: float

    def least(self, other: ProfileLimits) -> ProfileLimits:
        """The stricter of two, each by each."""
        return ProfileLimits(
            min(self.velocity, other.velocity),
            min(self.acceleration, other.acceleration),
            min(self.jerk, other.jerk),
        )

    def slower(self, factor: float) -> ProfileLimits:
        """The limits of the same motion in a time longer by a factor."""
        return ProfileLimits(self.velocity / factor, self.acceleration / factor**2, self.jerk / factor**3)


class TimeLaw(Protocol):
    """s over time; the attribute duration is the time until it rests at its end [s]."""

    duration: float

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; constant after the end."""

    @property
    def pieces(self) -> Array | None:
        """The cubic polynomials that it consists of, shape (n, 5): when each begins [s], and its coefficients.

        They are of s over the time since then, the constant first. None: it does not consist of any.
        """


class ScaledProfile:
    """The remainder of a profile between two times [s], at a fraction of its speed."""

    __slots__ = ("_begin", "_profile", "_scale", "duration")

    pieces = None

    def __init__(self, profile: TimeLaw, begin: float, end: float, scale: float) -> None:
        self._profile, self._begin, self._scale = profile, begin, scale
        self.duration = (end - begin) / scale

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]."""
        place, speed, acceleration = self._profile.at(self._begin + min(time, self.duration) * self._scale)
        return place, speed * self._scale, acceleration * self._scale**2


#: Where two kinds of profile meet exactly, as for 0.2 rad at 10 rad/s² and 100 rad/s³, Ruckig may find
#: neither; with a little less acceleration the case is not on the edge any more.
_FRACTIONS = (1.0, 0.9999, 0.999, 0.99)

#: The limits of s of a very short path are huge; above this jerk Ruckig computes in another unit of s.
_COARSE = 1e6


def _unit(limits: ProfileLimits) -> float:
    return 1.0 if limits.jerk <= _COARSE else limits.jerk / _COARSE


class JerkProfile:
    """A jerk-limited profile of s; the parameters are in a unit of s."""

    __slots__ = ("_trajectory", "_unit", "duration")

    def __init__(self, parameters: InputParameter, unit: float) -> None:
        self._unit = unit
        acceleration = parameters.max_acceleration[0]
        for fraction in _FRACTIONS:
            parameters.max_acceleration = [acceleration * fraction]
            trajectory = Trajectory(1)
            try:
                result = Ruckig(1).calculate(parameters, trajectory)
            except RuckigError:
                continue
            if result in (Result.Working, Result.Finished):
                self._trajectory = trajectory
                self.duration = float(trajectory.duration)
                return
        raise ValueError("no jerk-limited profile exists for these limits")

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; constant after the end."""
        position, velocity, acceleration = self._trajectory.at_time(min(time, self.duration))
        unit = self._unit
        return position[0] * unit, velocity[0] * unit, acceleration[0] * unit

    @property
    def pieces(self) -> Array | None:
        """See `TimeLaw`."""
        found = self._trajectory.profiles[0][0]
        if found.brake.duration > 0.0 or found.accel.duration > 0.0:  # pieces before the seven
            return None
        begins = np.concatenate([[0.0], np.cumsum(found.t)[:-1]])
        p, v, a, j = (np.array(array)[:7] * self._unit for array in (found.p, found.v, found.a, found.j))
        pieces: Array = np.stack([begins, p, v, a / 2, j / 6], axis=1)
        return pieces


def _parameters(state: tuple[float, float, float], limits: ProfileLimits) -> InputParameter:
    unit = _unit(limits)
    parameters = InputParameter(1)
    parameters.current_position = [state[0] / unit]
    parameters.current_velocity = [state[1] / unit]
    parameters.current_acceleration = [state[2] / unit]
    parameters.max_velocity = [limits.velocity / unit]
    parameters.max_acceleration = [limits.acceleration / unit]
    parameters.max_jerk = [limits.jerk / unit]
    return parameters


def change(state: tuple[float, float, float], goal: float, limits: ProfileLimits) -> JerkProfile:
    """From a state (value, rate, its rate) to rest at a goal."""
    parameters = _parameters(state, limits)
    parameters.target_position = [goal / _unit(limits)]
    parameters.target_velocity = [0.0]
    parameters.target_acceleration = [0.0]
    return JerkProfile(parameters, _unit(limits))


def brake(state: tuple[float, float, float], limits: ProfileLimits) -> JerkProfile:
    """From a state (s, velocity, acceleration) to rest, wherever on the path that is."""
    parameters = _parameters(state, limits)
    parameters.control_interface = ControlInterface.Velocity
    parameters.target_velocity = [0.0]
    parameters.target_acceleration = [0.0]
    return JerkProfile(parameters, _unit(limits))
