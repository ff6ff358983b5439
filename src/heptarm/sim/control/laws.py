"""Control laws: from set-points and the measured state to torques.

Position control is a computed-torque law. Impedance laws make the arm compliant: a spring and a damper to the
set-point, in addition to the torques for gravity and the commanded motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from heptarm.sim.planning.command import TICK
from heptarm.values.arrays import Array

#: Bandwidth of the position controller [rad/s] and its damping ratio.
BANDWIDTH = 90.0
DAMPING = 1.0
#: Integral action compensates the deflection under a constant load, up to this angle [rad].
INTEGRAL = 0.2 * BANDWIDTH
INTEGRAL_REACH = 0.01
#: Least damping of a joint, also of one without stiffness [Nm s/rad].
LEAST_DAMPER = 0.5
#: Duration of a stiffness change while a law is in force [s].
RAMP = 0.05


@dataclass(slots=True)
class MeasuredState:
    """Measured state and set-points of one tick; arrays are views that the plant updates.

    Attributes:
        q: measured positions, shape (7,) [rad].
        dq: measured velocities [rad/s].
        mass: inertia matrix with rotors, shape (7, 7) [kg m²].
        bias: Coriolis, centrifugal and gravity torques [Nm].
        passive: friction torques [Nm].
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


@dataclass(frozen=True, slots=True, eq=False)
class Superposition:
    """Set-point and load of an FRI overlay for the next tick, instead of the interpolator's set-point.

    Attributes:
        q: set-point of the next tick, shape (7,) [rad].
        tau: additional torques, shape (7,) [Nm]; None: none.
        wrench: additional force and torque of the arm at the flange, base axes, shape (6,) [N, Nm]; None: none.
    """

    q: Array
    tau: Array | None = None
    wrench: Array | None = None


class ControlLaw(Protocol):
    """A control law in force."""

    #: Whether the arm tracks its set-points closely, so that a motion can wait for its arrival.
    is_stiff: bool

    @property
    def stays(self) -> bool:
        """Whether a motion must not end yet."""

    @property
    def violation(self) -> str:
        """Text of the exceeded limit that stops the motion; "" while there is none."""

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""


class PositionLaw:
    """Stiff position control.

    Args:
        integral: initial value of the integral action, shape (7,) [rad]; None: zero.
    """

    is_stiff = True
    stays = False
    violation = ""

    def __init__(self, integral: Array | None = None) -> None:
        self._integral = np.zeros(7) if integral is None else integral

    @classmethod
    def continuing(cls, torque: Array, sensed: MeasuredState) -> PositionLaw:
        """The law that continues with the present torques [Nm] of another one; the arm rests at its set-point."""
        acceleration = np.linalg.solve(sensed.mass, torque - sensed.bias + sensed.passive)
        return cls(np.asarray(acceleration / BANDWIDTH**2, dtype=np.float64))

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        acceleration = (sensed.after - 2 * sensed.now + sensed.before) * 1e6
        error = sensed.now - sensed.q
        self._integral += INTEGRAL * TICK * error
        np.minimum(self._integral, INTEGRAL_REACH, out=self._integral)  # np.clip takes three times as long
        np.maximum(self._integral, -INTEGRAL_REACH, out=self._integral)
        acceleration += BANDWIDTH * BANDWIDTH * (error + self._integral)
        acceleration += 2 * DAMPING * BANDWIDTH * ((sensed.after - sensed.before) * 500.0 - sensed.dq)
        return sensed.mass @ acceleration + sensed.bias - sensed.passive


class JointImpedanceLaw:
    """Joint impedance: a spring and a damper in every joint.

    The damping ratio is that of each joint alone, with its inertia at the present posture:
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
        """Change the parameters; the stiffness changes on a short ramp."""
        self._from, self._goal, self._damping, self._ramp = self._stiffness, stiffness, damping, 0.0

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        if self._ramp < RAMP:
            self._ramp += TICK
            fraction = min(1.0, self._ramp / RAMP)
            self._stiffness = self._from + fraction * (self._goal - self._from)
        damper = 2.0 * self._damping * np.sqrt(self._stiffness * sensed.mass.diagonal())
        np.maximum(damper, LEAST_DAMPER, out=damper)
        torque = sensed.bias - sensed.passive + self._stiffness * (sensed.now - sensed.q) - damper * sensed.dq
        if not sensed.is_overlaid:  # no feed-forward of a client's set-points, which may jump
            torque += sensed.mass @ ((sensed.after - 2 * sensed.now + sensed.before) * 1e6)
            torque += damper * ((sensed.after - sensed.before) * 500.0)
        return torque
