"""Vectors of the simulated arm, of which MuJoCo, the tick in C and the parts of the plant all use the same memory."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from heptarm.values.checks import Array

AXES = 7


@dataclass(frozen=True, slots=True, eq=False)
class ArmVectors:
    """What is known of the arm in a tick; the arrays stay the same, their shape is (7,) unless said otherwise.

    MuJoCo's names end each line of what are views of its state.

    Attributes:
        q: true positions [rad]: qpos.
        dq: velocities [rad/s]: qvel.
        acceleration: [rad/s²]: qacc.
        bias: Coriolis, centrifugal and gravity torques [Nm]: qfrc_bias.
        passive: friction torques [Nm]: qfrc_passive.
        applied: torques of a push [Nm]: qfrc_applied.
        constraint: torques of contacts and limits [Nm]: qfrc_constraint.
        pulled: forces and torques on each body of the world, shape (bodies, 6) [N, Nm]: xfrc_applied.
        actuators: torques of the motors [Nm]: ctrl.
        mass: inertia matrix of the world with rotors, shape (nv, nv) [kg m²]; not kept up to date in plain ticks.
        armature: inertia of the rotors [kg m²].
        shown: positions that the sensors show [rad]; `q` itself where these are ideal.
        torque: torques of the motors as far as these can and friction lets them [Nm].
        tau_cmd: torques that the control law commands [Nm].
        tau: torques at the sensors [Nm].
        load: external load acting on the joints [Nm].
        wrench: external force and torque acting on the flange, base axes, shape (6,) [N, Nm].
    """

    q: Array
    dq: Array
    acceleration: Array
    bias: Array
    passive: Array
    applied: Array
    constraint: Array
    pulled: Array
    actuators: Array
    mass: Array
    armature: Array
    shown: Array
    torque: Array
    tau_cmd: Array
    tau: Array
    load: Array
    wrench: Array

    @classmethod
    def of(cls, model: mujoco.MjModel, data: mujoco.MjData, *, has_errors: bool) -> ArmVectors:
        """Those of a world, whose first seven joints are the arm's.

        Args:
            model: MuJoCo's model.
            data: its state.
            has_errors: whether the sensors show something else than the true positions.
        """
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        q = data.qpos[:AXES]
        return cls(
            q=q,
            dq=data.qvel[:AXES],
            acceleration=data.qacc[:AXES],
            bias=data.qfrc_bias[:AXES],
            passive=data.qfrc_passive[:AXES],
            applied=data.qfrc_applied[:AXES],
            constraint=data.qfrc_constraint[:AXES],
            pulled=data.xfrc_applied,
            actuators=data.ctrl[:AXES],
            mass=mass,
            armature=model.dof_armature[:AXES].copy(),
            shown=q.copy() if has_errors else q,
            torque=np.zeros(AXES),
            tau_cmd=np.zeros(AXES),
            tau=np.zeros(AXES),
            load=np.zeros(AXES),
            wrench=np.zeros(6),
        )
