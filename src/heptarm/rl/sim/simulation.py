"""The simulated arm of training: the included model with full dynamics and the plant's servo.

The plant closes its loop every millisecond in Python; for training its servos become MuJoCo actuators, so
that a decision of 1/30 s is four steps inside the engine. Each has a low-pass filter that
models the servo's interpolation. Gravity counts as compensated, so it is switched off; what the controller
does not know (a payload) acts as an external force.
"""

from __future__ import annotations

from math import isfinite
from typing import Any

import mujoco
import numpy as np

from heptarm.rl.task import ReachTask
from heptarm.sim.plant.world import specification
from heptarm.values.checks import Array

#: Steps of the engine in a decision. Of position-controlled arms under random actions, four deviate by 0.2 mm (root
#: mean square) from 64, eight by 0.1 mm; both are equally near to the plant.
SUBSTEPS = 4
#: Damping ratio of joint impedance.
IMPEDANCE_DAMPING = 0.7
GRAVITY = 9.81


def build(task: ReachTask) -> Any:
    """The engine's model of a task: the shipped MJCF with servos instead of motors.

    Returns:
        An `mujoco.MjModel`; its seven controls are commanded joints [rad].
    """
    spec = specification(task.robot)
    stiffness, damping = gains(mass(task))
    for index, servo in enumerate(spec.actuators):
        servo.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        servo.dynprm[0] = 1.0 / 20.0
        servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        servo.gainprm[0] = stiffness[index]
        servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        servo.biasprm[:3] = [0.0, -stiffness[index], -damping[index]]
        servo.forcerange, servo.forcelimited = servo.ctrlrange, 1
        servo.ctrllimited = 0
    spec.option.timestep = 1.0 / task.rate / SUBSTEPS
    spec.option.gravity = [0.0, 0.0, 0.0]
    return spec.compile()


#: Position control while training: bandwidth [rad/s] and damping ratio of each joint. Without contacts the elastic
#: joints of the virtual cabinet follow their set-points as closely.
BANDWIDTH = 90.0
DAMPING = 1.0


def mass(task: ReachTask) -> Array:
    """Inertia that each joint moves at the task's home, shape (7,) [kg m²]."""
    model = specification(task.robot).compile()
    data = mujoco.MjData(model)
    data.qpos[:7] = task.home
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return np.diag(full)[:7].copy()


def gains(inertia: Array, stiffness: Array | None = None) -> tuple[Array, Array]:
    """Stiffness [Nm/rad] and damping [Nms/rad] of the joints, shape (..., 7).

    Args:
        inertia: of the joints, shape (7,) [kg m²].
        stiffness: of joint impedance, shape (...,) [Nm/rad]; None or inf: position control.
    """
    stiff, damp = BANDWIDTH**2 * inertia, 2 * DAMPING * BANDWIDTH * inertia
    if stiffness is None:
        return stiff, damp
    wanted = np.asarray(stiffness)[..., None]
    free = np.isfinite(wanted)
    compliant = np.where(free, wanted, 1.0)
    return (
        np.where(free, compliant, stiff),
        np.where(free, 2 * IMPEDANCE_DAMPING * np.sqrt(compliant * inertia), damp),
    )


def is_compliant(bounds: tuple[float, float]) -> bool:
    """Whether a range of stiffness asks for joint impedance."""
    return isfinite(bounds[1])
