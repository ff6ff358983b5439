"""A simulated gripper behind signals of the cabinet: two outputs drive it, two inputs are its end switches.

The actuator gets the lower end of its control range while the gripper closes, and the upper end while it opens. As
with a bistable valve, the last command stays in force when both outputs are off; with both on nothing changes.
"""

from __future__ import annotations

import mujoco
import numpy as np

from heptarm.sim.plant.io_image import IoImage
from heptarm.sim.plant.scene import GRIPPER, PREFIX
from heptarm.values.io import GripperWiring

#: Part of the stroke at each end in which the switch of that end is on.
SWITCHED = 0.03


class SimulatedGripper:
    """A gripper of the scene; it begins open.

    Args:
        model: MuJoCo's model with an actuator `gripper`, which drives slide or hinge joints, by itself or by a tendon.
        data: its state.
        signals: the IO image.
        wiring: names of its signals.

    Raises:
        ValueError: its joints have no range, or its signals do not fit the image.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, signals: IoImage, wiring: GripperWiring
    ) -> None:
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + GRIPPER)
        joints = driven_joints(model)
        low, high = model.jnt_range[joints].T
        if not joints or not model.jnt_limited[joints].all():
            raise ValueError(
                "the joints of the actuator `gripper` must have a range: its ends are closed and open"
            )
        self._low, self._stroke = low, high - low
        self._at = [int(model.jnt_qposadr[joint]) for joint in joints]
        self._control = data.ctrl[index : index + 1]
        self._closing, self._opening = model.actuator_ctrlrange[index].tolist()
        self._position = data.qpos
        self._signals = signals
        self._open = signals.place(wiring.open, is_output=True)
        self._close = signals.place(wiring.close, is_output=True)
        self._is_open = signals.place(wiring.is_open, is_output=False)
        self._is_closed = signals.place(wiring.is_closed, is_output=False)
        data.qpos[self._at] = high
        self._control[:] = self._opening

    @property
    def opening(self) -> float:
        """Part of its stroke by which it is open, 0 to 1."""
        return float(np.mean((self._position[self._at] - self._low) / self._stroke))

    def tick(self) -> None:
        """Read the outputs, drive the actuator, set the inputs; called in each tick before the dynamics."""
        values = self._signals.values
        opens, closes = values[self._open] != 0.0, values[self._close] != 0.0
        if opens != closes:
            self._control[:] = self._opening if opens else self._closing
        opening = self.opening
        values[self._is_open] = float(opening > 1.0 - SWITCHED)
        values[self._is_closed] = float(opening < SWITCHED)


def has_gripper(model: mujoco.MjModel) -> bool:
    """Whether the scene of a model has a gripper."""
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + GRIPPER) >= 0)


def driven_joints(model: mujoco.MjModel) -> list[int]:
    """Joints that the gripper of the scene drives, by itself or by a tendon; the upper end of their range is open.

    Raises:
        ValueError: its actuator drives something else.
    """
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + GRIPPER)
    target = int(model.actuator_trnid[actuator, 0])
    if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT:
        return [target]
    if model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_TENDON:
        raise ValueError("the actuator `gripper` must drive a joint or a tendon of joints")
    first = int(model.tendon_adr[target])
    return [int(wrapped) for wrapped in model.wrap_objid[first : first + int(model.tendon_num[target])]]
