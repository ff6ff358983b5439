"""Jerk-limited profiles of the path parameter s: to the end of the path, and to a stop on it.

Ruckig computes both in one dimension, where it is exact and needs no intermediate waypoints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Trajectory


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest velocity, acceleration and jerk of s, all positive."""

    velocity: float
    acceleration: float
    jerk: float

    def least(self, other: Limits) -> Limits:
        """The stricter of two, each by each."""
        return Limits(
            min(self.velocity, other.velocity),
            min(self.acceleration, other.acceleration),
            min(self.jerk, other.jerk),
        )


class TimeLaw(Protocol):
    """s over time; the attribute duration is when it has come to its end [s]."""

    duration: float

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; beyond the end it keeps its last values."""


class Rest:
    """What is left of a law up to a time [s], gone through at a share of its speed."""

    __slots__ = ("_begin", "_law", "_scale", "duration")

    def __init__(self, law: TimeLaw, begin: float, end: float, scale: float) -> None:
        self._law, self._begin, self._scale = law, begin, scale
        self.duration = (end - begin) / scale

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]."""
        place, speed, acceleration = self._law.at(self._begin + min(time, self.duration) * self._scale)
        return place, speed * self._scale, acceleration * self._scale**2


#: Where two kinds of profile meet exactly, as for 0.2 rad at 10 rad/s² and 100 rad/s³, Ruckig may find
#: neither; with a little less acceleration it is not on the edge any more.
_SHARES = (1.0, 0.9999, 0.999, 0.99)


#: Numbers of a path of next to no length are huge; beyond this jerk Ruckig is asked in another unit of s.
_COARSE = 1e6


def _unit(limits: Limits) -> float:
    return 1.0 if limits.jerk <= _COARSE else limits.jerk / _COARSE


class Profile:
    """s over time; the parameters are in a unit of s."""

    __slots__ = ("_trajectory", "_unit", "duration")

    def __init__(self, parameters: InputParameter, unit: float) -> None:
        self._unit = unit
        acceleration = parameters.max_acceleration[0]
        for share in _SHARES:
            parameters.max_acceleration = [acceleration * share]
            trajectory = Trajectory(1)
            try:
                result = Ruckig(1).calculate(parameters, trajectory)
            except RuckigError:
                continue
            if result in (Result.Working, Result.Finished):
                self._trajectory = trajectory
                self.duration = float(trajectory.duration)
                return
        raise ValueError("no profile for these limits")

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; beyond the end it keeps its last values."""
        position, velocity, acceleration = self._trajectory.at_time(min(time, self.duration))
        unit = self._unit
        return position[0] * unit, velocity[0] * unit, acceleration[0] * unit


def _parameters(state: tuple[float, float, float], limits: Limits) -> InputParameter:
    unit = _unit(limits)
    parameters = InputParameter(1)
    parameters.current_position = [state[0] / unit]
    parameters.current_velocity = [state[1] / unit]
    parameters.current_acceleration = [state[2] / unit]
    parameters.max_velocity = [limits.velocity / unit]
    parameters.max_acceleration = [limits.acceleration / unit]
    parameters.max_jerk = [limits.jerk / unit]
    return parameters


def travel(limits: Limits) -> Profile:
    """From rest at 0 to rest at 1."""
    return change((0.0, 0.0, 0.0), 1.0, limits)


def change(state: tuple[float, float, float], goal: float, limits: Limits) -> Profile:
    """From a state (value, rate, its rate) to rest at a goal."""
    parameters = _parameters(state, limits)
    parameters.target_position = [goal / _unit(limits)]
    parameters.target_velocity = [0.0]
    parameters.target_acceleration = [0.0]
    return Profile(parameters, _unit(limits))


def brake(state: tuple[float, float, float], limits: Limits) -> Profile:
    """From a state (s, velocity, acceleration) to rest, wherever on the path that is."""
    parameters = _parameters(state, limits)
    parameters.control_interface = ControlInterface.Velocity
    parameters.target_velocity = [0.0]
    parameters.target_acceleration = [0.0]
    return Profile(parameters, _unit(limits))
