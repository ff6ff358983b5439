"""Control laws: from set-points and the measured state to torques.

Position control is a computed-torque law that tracks tightly. Impedance laws let the arm yield: a spring and a
damper to the set-point, on top of what gravity and the commanded motion need.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from heptarm.values.arrays import Array
from heptarm.virtual.tick import TICK

#: Bandwidth of the position controller [rad/s] and its damping ratio.
BANDWIDTH = 90.0
DAMPING = 1.0
#: Integral action: what a lasting load would bend the arm by is taken back, up to this angle [rad].
INTEGRAL = 0.2 * BANDWIDTH
INTEGRAL_REACH = 0.01
#: No joint moves freer than with this much damping [Nm s/rad], not even one without stiffness.
LEAST_DAMPER = 0.5
#: Stiffness that changes while a law is in force does so within this time [s].
RAMP = 0.05



@dataclass(slots=True)
class Sensed:
    """What a law works on, in one tick; arrays are views that the plant keeps up to date.

    Attributes:
        q: measured positions, shape (7,) [rad].
        dq: measured velocities [rad/s].
        mass: inertia matrix with rotors, shape (7, 7) [kg m²].
        bias: Coriolis, centrifugal and gravity torques [Nm].
        passive: what friction gives [Nm].
        before: set-point of the last tick [rad], then of this and of the next one.
        is_overlaid: the set-points are an FRI client's; an impedance law then follows them by its spring alone.
    """

    q: Array
    dq: Array
    mass: Array
    bias: Array
    passive: Array
    before: Array
    now: Array
    after: Array
    is_overlaid: bool = False


class Law(Protocol):
    """A control law in force."""

    #: Whether the arm follows its set-points stiffly, so that a motion can wait for its arrival.
    is_stiff: bool

    @property
    def stays(self) -> bool:
        """Whether a motion must not end yet."""

    @property
    def violation(self) -> str:
        """Which limit that stops the motion is exceeded, in words; "" while none is."""

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""


class PositionLaw:
    """Stiff position control.

    Args:
        lasting: what its integral action begins with, shape (7,) [rad]; None: nothing.
    """

    is_stiff = True
    stays = False
    violation = ""

    def __init__(self, lasting: Array | None = None) -> None:
        self._lasting = np.zeros(7) if lasting is None else lasting

    @classmethod
    def that_goes_on(cls, torque: Array, sensed: Sensed) -> PositionLaw:
        """The law that gives the torques [Nm] which another gives now, with the arm at rest at its set-point."""
        wanted = np.linalg.solve(sensed.mass, torque - sensed.bias + sensed.passive)
        return cls(np.asarray(wanted / BANDWIDTH**2, dtype=np.float64))

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        wanted = (sensed.after - 2 * sensed.now + sensed.before) * 1e6
        error = sensed.now - sensed.q
        self._lasting += INTEGRAL * TICK * error
        np.minimum(self._lasting, INTEGRAL_REACH, out=self._lasting)  # np.clip takes three times as long
        np.maximum(self._lasting, -INTEGRAL_REACH, out=self._lasting)
        wanted += BANDWIDTH * BANDWIDTH * (error + self._lasting)
        wanted += 2 * DAMPING * BANDWIDTH * ((sensed.after - sensed.before) * 500.0 - sensed.dq)
        return sensed.mass @ wanted + sensed.bias - sensed.passive


class JointSpring:
    """Joint impedance: a spring and a damper in every joint.

    The damping ratio is that of each joint by itself, with the inertia that it moves at its present posture:
    d = 2 ζ √(k m).

    Args:
        stiffness: shape (7,) [Nm/rad].
        damping: ratio, shape (7,).
    """

    is_stiff = False
    stays = False
    violation = ""

    def __init__(self, stiffness: Array, damping: Array) -> None:
        self._stiffness = self._from = self._goal = stiffness
        self._damping = damping
        self._ramp = RAMP

    def change(self, stiffness: Array, damping: Array) -> None:
        """Take other values; the stiffness changes on a short ramp."""
        self._from, self._goal, self._damping, self._ramp = self._stiffness, stiffness, damping, 0.0

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        if self._ramp < RAMP:
            self._ramp += TICK
            share = min(1.0, self._ramp / RAMP)
            self._stiffness = self._from + share * (self._goal - self._from)
        damper = 2.0 * self._damping * np.sqrt(self._stiffness * sensed.mass.diagonal())
        np.maximum(damper, LEAST_DAMPER, out=damper)
        torque = sensed.bias - sensed.passive + self._stiffness * (sensed.now - sensed.q) - damper * sensed.dq
        if (
            not sensed.is_overlaid
        ):  # a client's set-points may jump, and the arm shall not be thrown after them
            torque += sensed.mass @ ((sensed.after - 2 * sensed.now + sensed.before) * 1e6)
            torque += damper * ((sensed.after - sensed.before) * 500.0)
        return torque
