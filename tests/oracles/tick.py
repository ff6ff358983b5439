"""The arithmetic of a tick of the plant in Python: what `native/tick.c` is compared with.

`position_torque` is the law of position control, `PythonTick` the other functions, with the methods of `NativeTick`. It
leaves every tick to `Plant`, which then takes the way of those that are not plain.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, StateWords
from heptarm.sim.control_laws.laws import GAINS, MASS_DAMPING, STIFFNESS_DAMPING, MeasuredState
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.plant.arm_vectors import ArmVectors
from heptarm.sim.plant.native import ELSEWHERE
from heptarm.sim.plant.shared_state import SharedState
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel
from tests.oracles.inverse_kinematics import status_of
from tests.oracles.kinematics import flange


def position_torque(sensed: MeasuredState, gains: Array = GAINS) -> Array:
    """Torques of position control without a preload, shape (7,) [Nm]."""
    error = sensed.now - sensed.q
    slip = (sensed.after - sensed.before) * 500.0 - sensed.dq
    acceleration = (sensed.after - 2 * sensed.now + sensed.before) * 1e6
    acceleration += MASS_DAMPING * slip
    torque: Array = sensed.mass @ acceleration + sensed.bias - sensed.passive
    torque += gains[:7] * (error + STIFFNESS_DAMPING * slip)
    return torque


class PythonTick:
    """See `NativeTick`."""

    left, is_awaited = ELSEWHERE, False

    def __init__(
        self,
        robot: RobotModel,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        shared: SharedState,
        arm: ArmVectors,
        *,
        gains: Array,
        ranges: Array | None,
    ) -> None:
        self._robot, self._shared, self._arm, self._gains = robot, shared, arm, gains

    def believe(self, mass: Array, bias: Array, *, is_misjudged: bool) -> None:
        """See `NativeTick.believe`."""
        self._mass, self._bias, self._is_misjudged = mass, bias, is_misjudged

    def tick(self, *_: Any, **__: Any) -> int:
        """Leave all of it."""
        return ELSEWHERE

    def prepare(self, *_: Any, **__: Any) -> None:
        """Prepare nothing: `follow` does no tick."""

    def follow(self, *_: Any) -> int:
        """Follow no table."""
        self.left = 0  # the next tick has not begun
        return 0

    def command(self, points: SetPoints) -> None:
        """See `NativeTick.command`."""
        arm = self._arm
        sensed = MeasuredState(arm.q, arm.dq, self._mass, self._bias, arm.passive, *points)
        arm.torque[:] = position_torque(sensed, self._gains)
        self.drive()

    def drive(self) -> None:
        """See `NativeTick.drive`."""
        arm, most = self._arm, self._robot.tau_max
        arm.torque[:] = np.maximum(np.minimum(arm.torque, most), -most)
        arm.tau_cmd[:] = arm.actuators[:] = arm.torque

    def sense(self) -> bool:
        """See `NativeTick.sense`."""
        arm = self._arm
        arm.tau[:] = arm.torque - arm.armature * arm.acceleration + arm.passive
        if self._is_misjudged or arm.pulled.any():
            arm.load[:] = self._mass @ arm.acceleration + self._bias - arm.passive - arm.torque
        else:
            arm.load[:] = arm.applied + arm.constraint
        return bool(arm.load.any())

    def strained(self, after: Array, *, is_stiff: bool) -> bool:
        """Leave it to `DriveMonitor.check`."""
        return True

    def write(
        self, tick: int, after: Array, *, words: tuple[int, int, int], times: tuple[float, float]
    ) -> None:
        """See `NativeTick.write`."""
        slot, arm = tick % SLOTS, self._arm
        whole, reals, q = self._shared.ints[slot], self._shared.floats[slot], arm.shown.tolist()
        whole[StateWords.SEQ], whole[StateWords.TIME] = 2 * tick + 1, tick * TICK_NS
        reals[StateWords.Q], reals[StateWords.Q_CMD], reals[StateWords.DQ] = q, after, arm.dq
        reals[StateWords.TAU], reals[StateWords.TAU_CMD] = arm.tau, arm.tau_cmd
        reals[StateWords.TAU_EXT], reals[StateWords.WRENCH] = arm.load, arm.wrench
        columns, place = flange(self._robot, q)
        reals[StateWords.POSE] = (*place, *_quaternion(*columns))
        whole[StateWords.FLAGS], whole[StateWords.MODE], whole[StateWords.ORDER] = words
        reals[StateWords.PROGRESS], reals[StateWords.REMAINING] = times
        reals[StateWords.E1], whole[StateWords.STATUS] = q[2], status_of(self._robot, q)
        whole[StateWords.TURN] = sum((v < 0) << i for i, v in enumerate(q))

    def publish(self, tick: int) -> bool:
        """See `NativeTick.publish`."""
        header = self._shared.header
        self._shared.ints[tick % SLOTS, StateWords.SEQ] = 2 * tick + 2
        header[HeaderWords.NEWEST] = tick
        return bool(tick * TICK_NS >= header[HeaderWords.WAKE])


def _quaternion(x: tuple[float, ...], y: tuple[float, ...], z: tuple[float, ...]) -> tuple[float, ...]:
    """Quaternion x y z w, w >= 0, of the columns of a rotation, computed from its largest component."""
    xx, yy, zz = x[0], y[1], z[2]
    w = xx + yy + zz
    if w >= xx and w >= yy and w >= zz:
        q = (y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + w)
    elif xx >= yy and xx >= zz:
        q = (1.0 + xx - yy - zz, x[1] + y[0], x[2] + z[0], y[2] - z[1])
    elif yy >= zz:
        q = (x[1] + y[0], 1.0 + yy - xx - zz, y[2] + z[1], z[0] - x[2])
    else:
        q = (x[2] + z[0], y[2] + z[1], 1.0 + zz - xx - yy, x[1] - y[0])
    n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) ** -0.5
    n = -n if q[3] < 0 else n
    return q[0] * n, q[1] * n, q[2] * n, q[3] * n
