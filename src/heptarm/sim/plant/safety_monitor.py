"""Simulated safety functions that depend on the load: limits of external torques, and of the mass of a workpiece.

The safety controller computes the external torques by itself, with the load that it counts: the tools, and the safety
workpiece if there is one. It does not know what else the application has attached. So a workpiece that is lifted
without being the safety workpiece looks like a collision, and one that was put down but is still selected does, too.

None of them is on by default. What is known of a real cabinet is in docs/explanation/fidelity.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import mujoco
import numpy as np

from heptarm.sim.plant.payload import NOTHING, LoadedModel
from heptarm.values.checks import Array
from heptarm.values.robot import Body

#: An external torque beyond the limit that ends sooner does not stop the arm [ticks].
LASTING = 5


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """What a safety configuration allows.

    Attributes:
        torque: largest external torque of an axis while a motion runs [Nm].
        workpiece: mass of the heaviest safety workpiece [kg].
    """

    torque: float = inf
    workpiece: float = inf


#: No limits at all.
UNLIMITED = SafetyLimits()


def parse_safety(text: str) -> SafetyLimits:
    """The limits of "TORQUE" or "TORQUE,MASS" [Nm, kg]; an empty text has none, and inf is none.

    Raises:
        ValueError: the text describes no limits.
    """
    if not text:
        return UNLIMITED
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or not all(number > 0.0 for number in numbers):
        raise ValueError(f"safety must be TORQUE or TORQUE,MASS above 0 in Nm and kg, got {text!r}")
    return SafetyLimits(*numbers)


class ExternalTorqueMonitor:
    """Monitors the external torques that the safety controller computes.

    Args:
        arm: model of the arm alone; the monitor changes it.
        limits: of the safety configuration.
    """

    def __init__(self, arm: mujoco.MjModel, limits: SafetyLimits) -> None:
        self._limit = limits.torque
        self._counted = LoadedModel(arm)
        self._counted.carry(NOTHING)
        self._lasted = 0

    def count(self, load: Body) -> None:
        """Set the load that the safety controller counts, in the flange frame."""
        self._counted.carry(load)

    def follow(self, data: mujoco.MjData) -> None:
        """Before the dynamics of a tick: the model at the posture of the world."""
        self._counted.follow(data)

    def check(self, external: Array, mass: Array, bias: Array, acceleration: Array) -> str:
        """After the dynamics of a tick: why the arm is stopped; "" while it is not.

        Args:
            external: external torques as the motion controller computes them, shape (7,) [Nm].
            mass: inertia matrix of that controller's model, shape (7, 7) [kg m²].
            bias: its Coriolis, centrifugal and gravity torques, shape (7,) [Nm].
            acceleration: of the joints, shape (7,) [rad/s²].
        """
        seen = external + (self._counted.mass - mass) @ acceleration + (self._counted.bias - bias)
        axis = int(np.abs(seen).argmax())
        if not abs(seen[axis]) > self._limit:
            self._lasted = 0
            return ""
        self._lasted += 1
        if self._lasted < LASTING:
            return ""
        self._lasted = 0
        return (
            f"safety function: external torque of A{axis + 1} is {abs(seen[axis]):.0f} Nm, "
            f"limit {self._limit:g} Nm"
        )
