"""The true payload on the flange, and the load data of the controller.

Where both agree, only the torques change. Where they differ, the controller's model is wrong by the difference: it
takes the unknown weight for an external force, as a robot does.

The true payload is the declared one, unless it was set separately. A tool of the scene is a true load, too, whose
weight and inertia MuJoCo knows and the controller does not: load data have to be declared for it, as on a robot.
"""

from __future__ import annotations

from copy import copy

import mujoco
import numpy as np

from heptarm.errors import HeptarmError
from heptarm.values.checks import Array
from heptarm.values.robot import Body, symmetric

#: No load at all.
NOTHING = Body(0.0, np.zeros(3))


def parse_payload(text: str) -> Body:
    """A payload from "MASS" or "MASS,X,Y,Z": mass [kg] and centre of mass in the flange frame [m].

    Raises:
        ValueError: the text describes no payload.
    """
    try:
        mass, *com = (float(part) for part in text.split(","))
        return Body(mass, np.array(com or (0.0, 0.0, 0.0)))
    except (ValueError, HeptarmError) as error:
        raise ValueError(f"payload must be MASS or MASS,X,Y,Z in kg and m, got {text!r}: {error}") from None


class _LastLink:
    """The last link of a model, to which loads are added."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._scratch: mujoco.MjData | None = None
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange")
        self._body = int(model.site_bodyid[site])
        self._at = model.site_pos[site].copy()
        self._turn = _matrix(model.site_quat[site])
        axes = _matrix(model.body_iquat[self._body])
        self._mass = float(model.body_mass[self._body])
        self._com = model.body_ipos[self._body].copy()
        self._inertia = axes @ np.diag(model.body_inertia[self._body]) @ axes.T

    def carry(self, load: Body) -> None:
        """Replace the load on the link."""
        model = self._model
        com = self._at + self._turn @ load.com
        mass = self._mass + load.mass
        centre = (self._mass * self._com + load.mass * com) / mass
        inertia = self._inertia + _shift(self._mass, self._com - centre)
        inertia += self._turn @ symmetric(load.inertia) @ self._turn.T + _shift(load.mass, com - centre)
        moments, axes = np.linalg.eigh(inertia)
        if np.linalg.det(axes) < 0:
            axes[:, 0] = -axes[:, 0]
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, axes.ravel())
        model.body_mass[self._body] = mass
        model.body_ipos[self._body] = centre
        model.body_inertia[self._body] = moments
        model.body_iquat[self._body] = quat
        if self._scratch is None:  # not the plant's, whose posture would change
            self._scratch = mujoco.MjData(model)
        mujoco.mj_setConst(model, self._scratch)


class LoadedModel:
    """An arm with a load on its flange, without contacts: what a controller computes with.

    Args:
        model: of the arm, which this changes.

    Attributes:
        mass: inertia matrix, shape (7, 7) [kg m²].
        bias: Coriolis, centrifugal and gravity torques, shape (7,) [Nm].

    Both are valid after `follow`.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._link = model, _LastLink(model)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._scratch: mujoco.MjData | None = None
        self._full = np.zeros((model.nv, model.nv))
        self.mass, self.bias = self._full[:7, :7], np.zeros(7)

    def carry(self, load: Body) -> None:
        """Replace the load, in the flange frame."""
        self._link.carry(load)
        if self._scratch is None:
            self._scratch = mujoco.MjData(self._model)
            self.bias = self._scratch.qfrc_bias[:7]

    def follow(self, world: mujoco.MjData) -> None:
        """Take over the posture and the velocities of the world's arm."""
        model, data = self._model, self._scratch
        assert data is not None
        data.qpos[:] = world.qpos[: model.nq]
        data.qvel[:] = world.qvel[: model.nv]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, self._full)


class PayloadModel:
    """Payload of the simulated arm; used by the thread that ticks the plant.

    Args:
        model: MuJoCo's model of the world; its first seven joints are the arm's.
        data: its state.
        mass: inertia matrix of the world, shape (nv, nv), which the plant keeps up to date [kg m²].
        bare: model of the arm alone, if a tool of the scene is on its flange; None: the flange is empty.

    Attributes:
        mass: inertia matrix of the controller's model, shape (7, 7) [kg m²].
        bias: Coriolis, centrifugal and gravity torques of that model, shape (7,) [Nm].
        differs: whether the controller's load data differ from the true payload.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        mass: Array,
        bare: mujoco.MjModel | None = None,
    ) -> None:
        self._data, self._world_mass = data, mass
        self._has_tool = bare is not None
        self._true_link = _LastLink(model)
        self._believed = LoadedModel(copy(model) if bare is None else bare)
        self._declared = self._hanging = NOTHING
        self._pinned: Body | None = None
        self._settle()

    def _agree(self) -> None:
        self.differs = False
        self.mass, self.bias = self._world_mass[:7, :7], self._data.qfrc_bias[:7]

    def declare(self, load: Body) -> None:
        """Set the load data of the controller."""
        self._declared = load
        self._settle()

    def set_true(self, load: Body | None) -> None:
        """Set the true payload independently of the load data; None: the declared one."""
        self._pinned = load
        self._settle()

    def _settle(self) -> None:
        hanging = self._pinned
        if hanging is None:
            hanging = NOTHING if self._has_tool else self._declared
        if hanging != self._hanging:
            self._hanging = hanging
            self._true_link.carry(hanging)
        if hanging == self._declared and not self._has_tool:
            self._agree()
            return
        self._believed.carry(self._declared)
        self.differs = True
        self.mass, self.bias = self._believed.mass, self._believed.bias

    def believe(self) -> None:
        """Update the controller's model for the present posture; needed in each tick in which it differs."""
        self._believed.follow(self._data)


def _matrix(quat: Array) -> Array:
    """Rotation of MuJoCo's quaternion w x y z, shape (3, 3)."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _shift(mass: float, by: Array) -> Array:
    """Inertia of a point of mass about another point, shape (3, 3)."""
    return mass * (float(by @ by) * np.eye(3) - np.outer(by, by))
