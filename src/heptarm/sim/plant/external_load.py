"""External load of the arm: pushes, contacts, a viewer's mouse; and the wrench at the flange."""

from __future__ import annotations

from math import inf

import mujoco
import numpy as np

from heptarm.sim.plant.arm_vectors import ArmVectors
from heptarm.values.checks import Array

#: Damping of the least squares near singularities.
_DAMPED = 1e-6 * np.eye(6)


class ExternalLoad:
    """External load of a simulated arm.

    Args:
        model: MuJoCo's model; its first seven joints are the arm's.
        data: its state.
        arm: vectors of the arm.

    Attributes:
        torque: external load acting on the joints, shape (7,) [Nm].
        wrench: force and torque acting on the flange, base axes, shape (6,) [N, Nm].

    The arrays stay the same.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, arm: ArmVectors) -> None:
        self._model, self._data = model, data
        self._site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange")
        self._jp = np.zeros((3, model.nv))
        self._jr = np.zeros((3, model.nv))
        self._applied = arm.applied
        self._push: Array | None = None
        self._until = inf
        self.torque, self.wrench = arm.load, arm.wrench
        self._jacobian = np.zeros((6, 7))

    @property
    def is_pushed(self) -> bool:
        """Whether a push has to be applied, or ended, in the next tick."""
        return self._push is not None

    def push(self, wrench: Array, until: float) -> None:
        """Push the flange with a force and a torque, base axes, shape (6,), until a plant time [s]."""
        self._push, self._until = wrench, until

    def apply(self, time: float) -> None:
        """Before the dynamics of a tick: convert a push to joint torques."""
        if self._push is None:
            return
        if time >= self._until or not self._push.any():
            self._push = None
            self._applied[:] = 0.0
            return
        mujoco.mj_jacSite(self._model, self._data, self._jp, self._jr, self._site)
        self._applied[:] = self._jp[:, :7].T @ self._push[:3] + self._jr[:, :7].T @ self._push[3:]

    def resolve(self, *, is_loaded: bool) -> None:
        """The wrench of the torques; zero without any load."""
        if not (is_loaded and self.torque.any()):
            self.wrench[:] = 0.0
            return
        mujoco.mj_jacSite(self._model, self._data, self._jp, self._jr, self._site)
        self._jacobian[:3], self._jacobian[3:] = self._jp[:, :7], self._jr[:, :7]
        j = self._jacobian
        self.wrench[:] = np.linalg.solve(j @ j.T + _DAMPED, j @ self.torque)
