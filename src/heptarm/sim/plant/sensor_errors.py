"""Errors of the simulated sensors and friction of the joints: noise, offset, gain and resolution, the same for a seed.

They act where they do on a robot. The torque sensors are on the link side of the gears, and what the controller derives
from them has their errors: the external torques, the wrench, and every condition on these. The position control of the
motors closes its own loops, much faster than the cabinet reads it, and is not disturbed. Friction acts on the motor's
side of the sensor; the controller compensates most of it, the rest is left here.

What is published and what is assumed is in docs/explanation/fidelity.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

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


def sensor_errors(robot: RobotModel, text: str) -> SensorErrors | None:
    """The errors of `parse_sensors`; None for ideal sensors.

    Raises:
        ValueError: the text is neither "ideal" nor "noisy" nor "noisy:SEED".
    """
    seed = parse_sensors(text)
    return None if seed is None else SensorErrors(robot, seed)


@dataclass(slots=True)
class SensorReading:
    """What the sensors show in a tick, arrays of shape (7,).

    Attributes:
        q: positions [rad].
        tau: torques [Nm].
        tau_error: their error, shown minus true [Nm].
    """

    q: Array
    tau: Array
    tau_error: Array


class SensorErrors:
    """Errors of a robot's sensors and friction of its joints.

    Args:
        robot: its highest torques scale the errors.
        seed: gain and offset are drawn from it, and the noise of every tick.
    """

    def __init__(self, robot: RobotModel, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        most = robot.tau_max
        self._gain = self._random.uniform(-GAIN, GAIN, 7)
        self._offset = self._random.uniform(-OFFSET, OFFSET, 7) * most
        self._scale = np.concatenate([np.full(7, POSITION_NOISE), TORQUE_NOISE * most])
        self._friction = FRICTION * most

    def friction(self, dq: Array) -> Array:
        """Friction against the motors at joint velocities of shape (7,) [rad/s], shape (7,) [Nm]."""
        result: Array = self._friction * np.tanh(dq * (1.0 / STICTION_SPEED))
        return result

    def read(self, q: Array, tau: Array) -> SensorReading:
        """What the sensors show; called once per tick.

        Args:
            q: true positions, shape (7,) [rad].
            tau: true torques at the sensors, shape (7,) [Nm].
        """
        noise = self._scale * self._random.standard_normal(14)
        shown_q = np.round((q + noise[:7]) / POSITION_STEP) * POSITION_STEP
        shown = tau + self._gain * tau + self._offset + noise[7:]
        shown = np.round(shown / TORQUE_STEP) * TORQUE_STEP
        return SensorReading(shown_q, shown, shown - tau)
