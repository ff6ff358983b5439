"""What a cabinet does not carry out: commands beyond the axes' limits, and jumps.

Position limits are the robot's. A command that lies further from the one before than the axes could go in the time
between the two is an illegal axis delta. Both end the motion, as on a cabinet, which publishes neither its margins nor
its texts; the margins here are heptarm's own.
"""

from __future__ import annotations

import numpy as np

from heptarm.fri.messages import CommandMode
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri.setpoint import OVERSPEED
from heptarm.virtual.tick import TICK

#: Under a torque overlay the position only bends a spring, and public clients put it 0.1 rad beside the measured one.
COMPLIANT_DELTA = 0.12
#: A wrench beyond these cannot be meant [N, Nm].
FORCE, MOMENT = 500.0, 200.0

_WRENCH = np.array((FORCE,) * 3 + (MOMENT,) * 3)


class Limits:
    """The limits of a robot's commands in one mode."""

    def __init__(self, robot: RobotModel, mode: CommandMode) -> None:
        self._robot = robot
        self._leap = OVERSPEED * robot.dq_max * TICK
        self._least_delta = COMPLIANT_DELTA if mode is CommandMode.TORQUE else 0.0

    def position(self, q: Array, before: Array, ticks: int) -> str:
        """What is wrong with a joint position, shape (7,) [rad], `ticks` after the one before; empty if nothing."""
        robot = self._robot
        if not np.isfinite(q).all():
            return f"Illegal axis position: A{_first(~np.isfinite(q))} is no finite number"
        outside = (q < robot.q_min) | (q > robot.q_max)
        if outside.any():
            axis = _first(outside)
            value, low, high = np.degrees((q[axis - 1], robot.q_min[axis - 1], robot.q_max[axis - 1]))
            return f"Illegal axis position: A{axis} at {value:.2f} deg; {low:.0f} to {high:.0f} deg are legal"
        legal = np.maximum(self._leap * ticks, self._least_delta)
        delta = np.abs(q - before)
        if (delta > legal).any():
            axis = _first(delta > legal)
            moved, most = np.degrees((delta[axis - 1], legal[axis - 1]))
            return f"Illegal axis delta: A{axis} by {moved:.3f} deg in {ticks} ms; {most:.3f} deg are legal"
        return ""

    def torque(self, tau: Array) -> str:
        """What is wrong with superposed torques, shape (7,) [Nm]; empty if nothing."""
        wrong = ~(np.abs(tau) <= self._robot.tau_max)
        if wrong.any():
            axis = _first(wrong)
            return f"Illegal torque: A{axis} {tau[axis - 1]:g} Nm; {self._robot.tau_max[axis - 1]:g} Nm are legal"
        return ""

    def wrench(self, wrench: Array) -> str:
        """What is wrong with a superposed wrench, shape (6,) [N, Nm]; empty if nothing."""
        wrong = ~(np.abs(wrench) <= _WRENCH)
        if wrong.any():
            return f"Illegal wrench: {wrench.tolist()}; {FORCE:g} N and {MOMENT:g} Nm are legal"
        return ""


def _first(wrong: np.ndarray) -> int:
    """Number of the first axis concerned, from 1."""
    return int(wrong.argmax()) + 1
