"""Steps a bare MuJoCo arm with a control law: no plant, no Java, no clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from heptarm.model.kinematics import forward
from heptarm.sim.control_laws.cartesian_impedance import CartesianImpedanceLaw, FlangeKinematics
from heptarm.sim.control_laws.laws import MeasuredState
from heptarm.sim.plant.world import specification
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from heptarm.values.robot import robot

#: An arm that is nowhere near a singularity, its axes askew to the base's.
ASKEW = (0.2, 0.6, -0.3, -1.3, 0.4, 0.9, 0.5)
#: The hand half a metre up, pointing down.
DOWN = (0.0, 0.5, 0.0, -1.3, 0.0, 1.3416, 0.0)

Travel = Callable[[float], Any]


class Arm:
    """An iiwa 14 on a law; `extra` goes into the model's world."""

    def __init__(
        self,
        mode: CartesianImpedance | SineImpedance,
        *,
        q: Any = ASKEW,
        tcp: Pose | None = None,
        axes: Any = None,
        extra: str = "",
        tail: str = "",
        model: str = "iiwa14",
    ) -> None:
        self.robot = robot(model)
        text = specification(model).to_xml()
        text = text.replace("</worldbody>", extra + "</worldbody>").replace("</mujoco>", tail + "</mujoco>")
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = q
        mujoco.mj_forward(self.model, self.data)
        self.flange = FlangeKinematics(self.model, self.data)
        self.tcp = Pose.at() if tcp is None else tcp
        self.law = CartesianImpedanceLaw(
            mode, self.robot, self.flange, tcp=self.tcp.array.tolist(), axes=axes
        )
        d, nv = self.data, self.model.nv
        self.mass = np.zeros((nv, nv))
        self.start = np.array(q, dtype=np.float64)
        self.sensed = MeasuredState(
            d.qpos[:7],
            d.qvel[:7],
            self.mass[:7, :7],
            d.qfrc_bias[:7],
            d.qfrc_passive[:7],
            self.start,
            self.start,
            self.start,
        )
        self.push = np.zeros(6)  # on the motion frame, base axes
        self.time = 0.0
        self.torque = np.zeros(7)

    def step(self, seconds: float, travel: Travel | None = None) -> list[Array]:
        """Run for a time while the set-point follows its path; deviations of every tick."""
        seen = []
        for _ in range(round(seconds * 1000)):
            self.tick(travel)
            seen.append(self.law.deviation)
        return seen

    def tick(self, travel: Travel | None = None) -> None:
        """One millisecond."""
        m, d, sensed = self.model, self.data, self.sensed
        if travel is not None:
            sensed.before, sensed.now, sensed.after = (
                np.asarray(travel(self.time + shift), dtype=np.float64) for shift in (-1e-3, 0.0, 1e-3)
            )
        mujoco.mj_step1(m, d)
        mujoco.mj_fullM(m, d, self.mass)
        self.torque = np.clip(self.law.torque(sensed), -self.robot.tau_max, self.robot.tau_max)
        d.ctrl[:7] = self.torque
        lever = self.flange.rotation @ self.tcp.xyz
        jacobian = self.flange.jacobian
        d.qfrc_applied[:7] = jacobian[:3].T @ self.push[:3]
        d.qfrc_applied[:7] += jacobian[3:].T @ (self.push[3:] + np.cross(lever, self.push[:3]))
        mujoco.mj_step2(m, d)
        self.time += 1e-3

    @property
    def pose(self) -> Pose:
        """Of the motion frame."""
        return Pose.from_matrix(forward(self.robot, self.data.qpos[:7])) @ self.tcp

    @property
    def wanted(self) -> Pose:
        """The set-point's pose."""
        return Pose.from_matrix(forward(self.robot, self.sensed.now)) @ self.tcp

    @property
    def quick(self) -> float:
        """The fastest joint's speed [rad/s]."""
        return float(np.abs(self.data.qvel[:7]).max())
