"""Errors of the simulated sensors and friction of the joints: noise, offset, gain and resolution, the same for a seed.

They act where they do on a robot. The torque sensors are on the link side of the gears, and what the controller derives
from them has their errors: the external torques, the wrench, and every condition on these. The position control of the
motors closes its own loops, much faster than the cabinet reads it, and is not disturbed. Friction acts on the motor's
side of the sensor; the controller compensates most of it, the rest is left here.

What is published and what is assumed is in docs/explanation/fidelity.md.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from heptarm.planning.motion import TICK
from heptarm.values.checks import Array
from heptarm.values.fitted_arm import FittedArm
from heptarm.values.robot import Friction, RobotModel

#: Errors of gain and offset of a torque sensor as fractions of reading and highest torque: within the 2 % of KUKA's
#: brochure, for a robot whose sensors were referenced lately.
GAIN, OFFSET = 0.01, 0.005
#: Standard deviation of a torque sensor's noise, as a fraction of the axis' highest torque, and its resolution [Nm].
TORQUE_NOISE, TORQUE_STEP = 0.0004, 0.01
#: Standard deviation and resolution of a measured position [rad].
POSITION_NOISE, POSITION_STEP = 1e-5, 2.0 * np.pi / 2**19
#: Friction that the controller does not compensate, as a fraction of the axis' highest torque, and the speed below
#: which it decreases to zero [rad/s].
FRICTION, STICTION_SPEED = 0.0015, 0.02

#: Quantities of a fitted arm that act here.
_OF_SENSORS = ("coulomb", "torque_offset", "torque_gain", "torque_noise", "position_noise", "state_delay")


def parse_sensors(text: str) -> int | None:
    """The seed of "noisy" or "noisy:SEED"; None for "ideal".

    Raises:
        ValueError: the text is neither.
    """
    kind, colon, seed = text.partition(":")
    if text == "ideal":
        return None
    if kind == "noisy" and (not colon or (seed.isascii() and seed.isdigit())):
        return int(seed or 0)
    raise ValueError(f"sensors must be ideal, noisy or noisy:SEED with a whole number from 0, got {text!r}")


def sensor_errors(robot: RobotModel, text: str, fitted: FittedArm | None = None) -> SensorErrors | None:
    """The errors of `parse_sensors`, and those of a fitted arm; None for ideal sensors without friction.

    Raises:
        ValueError: the text is neither "ideal" nor "noisy" nor "noisy:SEED".
    """
    seed = parse_sensors(text)
    if fitted is not None and any(name in fitted for name in _OF_SENSORS):
        return SensorErrors(robot, seed or 0, fitted=fitted, is_ideal=seed is None)
    return None if seed is None else SensorErrors(robot, seed)


@dataclass(slots=True)
class SensorReading:
    """What the sensors show in a tick, arrays of shape (7,).

    Attributes:
        q: positions [rad].
        tau: torques [Nm].
        load: external torques that follow from these [Nm].
    """

    q: Array
    tau: Array
    load: Array


class SensorErrors:
    """Errors of a robot's sensors and friction of its joints.

    Args:
        robot: its highest torques scale the errors.
        seed: gain and offset are drawn from it, and the noise of every tick.
        fitted: an arm whose measured numbers take the place of what is drawn.
        is_ideal: what the arm does not have is ideal, instead of drawn.
    """

    def __init__(
        self, robot: RobotModel, seed: int, *, fitted: FittedArm | None = None, is_ideal: bool = False
    ) -> None:
        self._random = np.random.default_rng(seed)
        most, size = robot.tau_max, 0.0 if is_ideal else 1.0
        gain, offset = self._random.uniform(-GAIN, GAIN, 7), self._random.uniform(-OFFSET, OFFSET, 7) * most
        known = FittedArm(robot.name) if fitted is None else fitted
        self._gain = known.value("torque_gain", size * gain)
        self._offset = known.value("torque_offset", size * offset)
        position = known.value("position_noise", size * POSITION_NOISE)
        self._scale = np.concatenate([position, known.value("torque_noise", size * TORQUE_NOISE * most)])
        # a measured noise has the resolution in it
        self._q_step = 0.0 if is_ideal or "position_noise" in known else POSITION_STEP
        self._tau_step = 0.0 if is_ideal or "torque_noise" in known else TORQUE_STEP
        drawn = Friction(coulomb=size * FRICTION * most, transition=STICTION_SPEED)
        self._friction = known.friction or drawn
        late = round(float(known.value("state_delay", 0.0)[0]) / TICK)
        self._late: deque[SensorReading] = deque(maxlen=late + 1)

    def friction(self, dq: Array) -> Array:
        """Friction against the motors at joint velocities of shape (7,) [rad/s], shape (7,) [Nm]."""
        return self._friction.at(dq)

    def read(self, q: Array, tau: Array, load: Array) -> SensorReading:
        """What the sensors show; called once per tick.

        Args:
            q: true positions, shape (7,) [rad].
            tau: true torques at the sensors, shape (7,) [Nm].
            load: true external torques, shape (7,) [Nm].
        """
        noise = self._scale * self._random.standard_normal(14)
        shown_q = _rounded(q + noise[:7], self._q_step)
        shown = _rounded(tau + self._gain * tau + self._offset + noise[7:], self._tau_step)
        self._late.append(SensorReading(shown_q, shown, load - (shown - tau)))
        return self._late[0]


def _rounded(values: Array, step: float) -> Array:
    """Values to a resolution; 0: they stay."""
    return np.round(values / step) * step if step else values
