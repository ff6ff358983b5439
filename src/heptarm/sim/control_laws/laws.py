"""Control laws: from set-points and the measured state to torques.

Position control is a computed-torque law whose feedback is as compliant as the joints of a robot: gear and torque
sensor of each axis are a spring between the motor, which follows the set-point, and the link. Impedance laws make the
arm more compliant: a spring and a damper to the set-point, in addition to the torques for gravity and the commanded
motion.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from math import exp
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from heptarm._library import library
from heptarm.planning.motion import TICK
from heptarm.values.checks import Array, frozen
from heptarm.values.robot import RobotModel

#: Stiffness of the axes in position control [Nm/rad]: the elasticity of the joint in series with the controller's.
#: The order of 10 kNm/rad is that of DLR's publications on the LWR's joints, the value of each axis is assumed: see
#: docs/explanation/fidelity.md.
STIFFNESS = frozen([15000.0, 15000.0, 10000.0, 10000.0, 7500.0, 5000.0, 5000.0])
#: Damping of position control, in proportion to the inertia matrix [1/s] and to the stiffness [s] (Rayleigh): the modes
#: of the arm have damping ratios of 0.6 to 1, and the law is stable at 1 ms in every posture.
MASS_DAMPING = 90.0
STIFFNESS_DAMPING = 0.004


def position_gains(stiffness: Array) -> Array:
    """Gains of position control for `ht_position` of tick.c: stiffness, shape (7,) [Nm/rad], and damping."""
    return frozen([*stiffness, MASS_DAMPING, STIFFNESS_DAMPING])


#: Those of the assumed stiffness.
GAINS = position_gains(STIFFNESS)
#: Time constant with which a preload fades when the brakes have opened [s].
PRELOAD_FADING = 0.1
#: Least damping of a joint, also of one without stiffness [Nm s/rad].
LEAST_DAMPER = 0.5
#: Duration of a stiffness change while a law is in force [s].
RAMP = 0.05
#: Guiding by hand: highest speed of the tool frame, along [m/s] and about axes [rad/s], and of an axis as a fraction of
#: its maximum. Sunrise's own bounds are unknown; see docs/explanation/fidelity.md.
GUIDED, GUIDED_AXIS = (0.25, 1.0), 0.5
#: Fraction of such a bound at which braking begins, and the decay rate of velocities above that [1/s].
BRAKING, STRICT = 0.8, 1000.0
#: A joint of less stiffness can be guided by hand [Nm/rad], and its velocity decays at this rate [1/s].
LEAST_STIFFNESS, CALM = 5.0, 10.0


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
        is_missing: the client owes its load: position control brakes the arm where it is, and holds it.
    """

    q: Array
    tau: Array | None = None
    wrench: Array | None = None
    is_missing: bool = False


class FlangeMotion(Protocol):
    """Where the flange is and how it moves with the joints, after `update`.

    Attributes:
        rotation: of the flange in the base, shape (3, 3).
        jacobian: of the flange, base axes, shape (6, 7).
    """

    rotation: Array
    jacobian: Array

    def update(self) -> None:
        """Compute them for the present positions."""


class ControlLaw(Protocol):
    """A control law in force."""

    #: Whether the arm tracks its set-points closely, so that a motion can wait for its arrival.
    is_stiff: bool

    @property
    def is_plain(self) -> bool:
        """Whether it is position control, without preload."""

    @property
    def stays(self) -> bool:
        """Whether a motion must not end yet."""

    @property
    def violation(self) -> str:
        """Text of the exceeded limit that stops the motion; "" while there is none."""

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""


@functools.cache
def _position_law() -> Any:
    """`ht_position` of tick.c, whose ticks use the same law.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """
    function = library(holds_gil=True).ht_position
    address = ctypes.c_void_p
    function.argtypes, function.restype = (address, address, address, ctypes.c_int64), None
    return function


class PositionLaw:
    """Position control with elastic joints: M (q̈_d + a ė) + h + K (e + b ė), with e the distance to the set-point.

    The motors follow the set-points; the measured positions are those of the links, which a load deflects from them by
    its torque divided by `STIFFNESS`. Nothing compensates this deflection: the controller knows the gravity of the load
    data, but no external load.

    Args:
        preload: torques beside those of the set-points, shape (7,) [Nm]; None: zero.
        is_locked: the brakes hold the motors, so that the preload stays; otherwise it fades.
        gains: of `position_gains`.
    """

    is_stiff = True
    stays = False
    violation = ""

    def __init__(
        self, preload: Array | None = None, *, is_locked: bool = False, gains: Array = GAINS
    ) -> None:
        self._preload, self._gains, self._gains_at = preload, gains, gains.ctypes.data
        self.is_plain = preload is None
        self._keeps = 1.0 if is_locked else exp(-TICK / PRELOAD_FADING)

    @classmethod
    def locked(cls, torque: Array, sensed: MeasuredState, gains: Array = GAINS) -> PositionLaw:
        """The law of closed brakes: they hold the motors where the present torques [Nm] have wound the joints."""
        return cls(torque - sensed.bias + sensed.passive, is_locked=True, gains=gains)

    def released(self, held: MeasuredState) -> PositionLaw:
        """The law that takes over from closed brakes at the measured positions: without a step, then unwinding.

        Args:
            held: the measured state, with the positions where the brakes hold the motors as set-points.
        """
        return PositionLaw(self.torque(held) - held.bias + held.passive, gains=self._gains)

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        torque = self._undisturbed(sensed)
        if self._preload is not None:
            self._preload = self._keeps * self._preload
            torque += self._preload
        return torque

    def _undisturbed(self, sensed: MeasuredState) -> Array:
        """The torques without a preload."""
        given = np.concatenate(
            (
                sensed.before,
                sensed.now,
                sensed.after,
                sensed.q,
                sensed.dq,
                sensed.bias,
                sensed.passive,
                np.zeros(7),
            )
        )
        mass = sensed.mass
        _position_law()(self._gains_at, given.ctypes.data, mass.ctypes.data, mass.strides[0] // 8)
        torque: Array = given[49:]
        return torque


def braking(dq: Array, ratio: float) -> Array:
    """Acceleration that keeps velocities within a bound, shape (7,) [rad/s²].

    All joints slow down alike, so that the arm keeps its direction and what is held stays held.

    Args:
        dq: velocities, shape (7,) [rad/s].
        ratio: the largest of their ratios to a bound.
    """
    result: Array = -STRICT * (1.0 - BRAKING / max(ratio, BRAKING)) * dq
    return result


def freedom(stiffness: Array, least: Array | float) -> Array:
    """How far directions can be guided by hand: 1 without stiffness, 0 from the least stiffness of a spring on."""
    result: Array = np.maximum(1.0 - stiffness / least, 0.0)
    return result


class JointImpedanceLaw:
    """Joint impedance: a spring and a damper in every joint.

    The damping ratio is that of each joint alone, with its inertia at the present posture:
    d = 2 ζ √(k m).
    A joint without stiffness is guided by hand: its damper is a real one, and its speed is bounded, as is that of the
    tool frame.

    Args:
        robot: the robot.
        flange: of the simulated arm.
        stiffness: shape (7,) [Nm/rad].
        damping: ratio, shape (7,).
        tcp: flange to tool frame, x y z [m].
    """

    is_stiff = False
    is_plain = False
    stays = False
    violation = ""

    def __init__(
        self,
        robot: RobotModel,
        flange: FlangeMotion,
        stiffness: Array,
        damping: Array,
        *,
        tcp: tuple[float, ...],
    ) -> None:
        self._fastest = GUIDED_AXIS * robot.dq_max
        self._flange, self._offset = flange, np.array(tcp)
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
        free = np.zeros(7) if sensed.is_overlaid else freedom(self._stiffness, LEAST_STIFFNESS)
        if free.any():
            np.maximum(damper, CALM * free * sensed.mass.diagonal(), out=damper)
        torque = sensed.bias - sensed.passive + self._stiffness * (sensed.now - sensed.q) - damper * sensed.dq
        if not sensed.is_overlaid:  # no feed-forward of a client's set-points, which may jump
            torque += sensed.mass @ ((sensed.after - 2 * sensed.now + sensed.before) * 1e6)
            torque += damper * ((sensed.after - sensed.before) * 500.0)
        if free.any():
            slip = sensed.dq - (sensed.after - sensed.before) * 500.0
            torque += sensed.mass @ braking(slip, self._too_fast(slip, free > 0.0))
        return torque

    def _too_fast(self, slip: Array, free: npt.NDArray[np.bool_]) -> float:
        """The largest ratio of a speed to its bound: of the axes that are free, and of the tool frame."""
        flange = self._flange
        flange.update()
        twist = flange.jacobian @ slip
        along = twist[:3] + np.cross(twist[3:], flange.rotation @ self._offset)
        fast = np.where(free, np.abs(slip) / self._fastest, 0.0)
        return max(
            float(fast.max()),
            float(np.linalg.norm(along)) / GUIDED[0],
            float(np.linalg.norm(twist[3:])) / GUIDED[1],
        )
