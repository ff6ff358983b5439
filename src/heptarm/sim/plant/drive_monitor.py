"""The drives' own supervision: what makes a drive trip, whatever the controller commands.

KUKA publishes ranges of speed, position and torque, but neither the thresholds at which a drive trips nor the texts.
What is known, assumed and unknown is in docs/explanation/fidelity.md.
"""

from __future__ import annotations

import numpy as np

from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: A drive trips at this multiple of the axis' highest speed. FRI clients may command 1.2 times that speed.
SPEED = 1.5
#: Distance beyond the position limit at which a drive trips [rad]; it trips again so much further outside.
BEYOND = np.radians(0.5)
#: Range of a torque sensor, relative to the highest torque of its axis; impacts that end sooner are not seen [ticks].
TORQUE, TORQUE_TICKS = 1.2, 5
#: Largest distance between set-point and measured position in position control [rad]: about where the torque of the
#: last axis is exhausted.
LAG = 0.05


class DriveMonitor:
    """Supervision of the seven drives.

    Args:
        robot: its ranges hold.

    Attributes:
        scales: reciprocals of the ranges of speed, position, torque and lag, shape (4, 7); always the same array.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._reach = np.maximum(robot.q_max, -robot.q_min) + BEYOND
        self.scales = np.array(
            (
                1.0 / (SPEED * robot.dq_max),
                1.0 / self._reach,
                1.0 / (TORQUE * robot.tau_max),
                np.full(7, 1.0 / LAG),
            )
        )
        self._loads = np.zeros((4, 7))
        self._overloaded = 0
        self._outside: Array | None = None  # which axes are outside since their drives tripped

    @property
    def is_strained(self) -> bool:
        """Whether it remembers something: a torque beyond its range, or axes outside their limits."""
        return self._overloaded > 0 or self._outside is not None

    def acknowledge(self, q: Array) -> None:
        """Let axes that are outside their limits stay there until they are back inside; further out they trip again.

        Args:
            q: measured positions, shape (7,) [rad].
        """
        outside = np.abs(q) > self._reach
        self._outside = outside if outside.any() else None
        self.scales[1] = 1.0 / np.where(outside, np.abs(q) + BEYOND, self._reach)
        self._overloaded = 0

    def check(self, dq: Array, q: Array, tau: Array, lag: Array | None) -> str:
        """Why a drive trips in this tick; "" while none does.

        Args:
            dq: measured velocities, shape (7,) [rad/s].
            q: measured positions [rad].
            tau: torques at the sensors [Nm].
            lag: set-point minus measured position [rad]; None: the arm is compliant.
        """
        loads = self._loads
        loads[0], loads[1], loads[2] = dq, q, tau
        loads[3] = 0.0 if lag is None else lag
        loads *= self.scales
        np.abs(loads, out=loads)
        if loads.max() <= 1.0:
            self._overloaded = 0
            if self._outside is not None and not (np.abs(q) > self._reach)[self._outside].any():
                self._outside, self.scales[1] = None, 1.0 / self._reach
            return ""
        speed, position, torque, distance = loads.max(axis=1).tolist()
        self._overloaded = self._overloaded + 1 if torque > 1.0 else 0
        robot = self._robot
        if distance > 1.0 and lag is not None:
            axis = int(loads[3].argmax())
            found, most = np.degrees((lag[axis], LAG))
            return f"drive error in A{axis + 1}: {found:.1f} deg behind its set-point, maximum {most:.1f} deg"
        if speed > 1.0:
            axis = int(loads[0].argmax())
            found, most = np.degrees((dq[axis], robot.dq_max[axis]))
            return f"drive error in A{axis + 1}: velocity {found:.0f} deg/s, maximum {most:.0f} deg/s"
        if position > 1.0:
            axis = int(loads[1].argmax())
            found, low, high = np.degrees((q[axis], robot.q_min[axis], robot.q_max[axis]))
            return f"drive error in A{axis + 1}: position {found:.1f} deg, limits [{low:.0f}, {high:.0f}] deg"
        if self._overloaded >= TORQUE_TICKS:
            axis = int(loads[2].argmax())
            found, most = tau[axis], TORQUE * robot.tau_max[axis]
            return f"drive error in A{axis + 1}: torque {found:.0f} Nm, range of the sensor {most:.0f} Nm"
        return ""
