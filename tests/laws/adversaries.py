"""Laws that try to break the arm, and torque sessions on the simulated plant: only the guard is between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.torque_guard import TorqueGuard
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.planning.seam import Hold
from heptarm.sim.control_laws.laws import Superposition
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.sensor_errors import SensorErrors
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.robot import Body, robot
from tests.oracles.fri.joint_guard import JointGuard

Floats = npt.NDArray[np.float64]
#: Torques [Nm] of measured positions [rad], velocities [rad/s] and the time [s]; NaN and infinity are allowed.
Adversary = Callable[[Floats, Floats, float], Floats]


def adversary(rng: np.random.Generator) -> tuple[str, Adversary]:
    """A law with random gains, wrong signs or no bounds, and its name."""
    gain = 10.0 ** rng.uniform(0.0, 4.0, 7) * rng.choice((-1.0, 1.0), 7)
    goal = rng.uniform(-2.5, 2.5, 7)
    rate = 10.0 ** rng.uniform(-1.0, 2.0)

    def spring(q: Floats, dq: Floats, t: float) -> Floats:
        return np.asarray(gain * (goal - q) - 0.05 * gain * dq)

    def runaway(q: Floats, dq: Floats, t: float) -> Floats:
        return np.asarray(np.abs(gain) * dq + rng.uniform(-1.0, 1.0, 7))

    def constant(q: Floats, dq: Floats, t: float) -> Floats:
        return np.asarray(np.sign(gain) * 1e12)

    def square(q: Floats, dq: Floats, t: float) -> Floats:
        return np.asarray(np.abs(gain) * np.sign(np.sin(rate * t + goal)))

    def noise(q: Floats, dq: Floats, t: float) -> Floats:
        return np.asarray(gain * rng.standard_normal(7))

    def broken(q: Floats, dq: Floats, t: float) -> Floats:
        return np.where(rng.random(7) < 0.3, rng.choice((np.nan, np.inf, -np.inf, 1e308), 7), gain)

    def one_axis(q: Floats, dq: Floats, t: float) -> Floats:
        return np.where(np.arange(7) == int(abs(goal[0]) * 2.8), gain, 0.0)

    laws = (spring, runaway, constant, square, noise, broken, one_axis)
    chosen = laws[int(rng.integers(len(laws)))]
    return chosen.__name__, chosen


@dataclass
class Trial:
    """A session of a law that commands torques, or a wrench; what the plant saw.

    Attributes:
        seed: of the law, the posture, the stiffness, the period and the load.
        is_guarded: whether the guard of the motion is in force.
        by_wrench: the law commands a wrench, and the arm is compliant about its flange.
        is_ending: whether the session lets the arm brake in the second half.
    """

    seed: int
    is_guarded: bool = True
    is_ending: bool = False
    by_wrench: bool = False
    speed: Floats = field(default_factory=lambda: np.zeros(7))  # largest fractions of the robot's speeds
    nearest: float = np.inf  # to a position limit [rad]
    final_speed: Floats = field(default_factory=lambda: np.zeros(7))
    final_effort: Floats = field(default_factory=lambda: np.zeros(7))  # that the law has sent last [Nm, N]
    error: str = ""
    name: str = ""

    def run(self, seconds: float) -> Trial:
        rng = np.random.default_rng(self.seed)
        model = str(rng.choice(("iiwa14", "iiwa7")))
        arm, (self.name, law) = robot(model), adversary(rng)
        period, stiffness = int(rng.choice((1, 2, 5))), float(rng.choice((0.0, 0.0, 0.0, 50.0, 300.0)))
        errors = SensorErrors(arm, self.seed) if rng.random() < 0.5 else None
        start = rng.uniform(0.9 * arm.q_min, 0.9 * arm.q_max)
        plant = Plant(model, q=tuple(start.tolist()), errors=errors)
        plant.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # a clash turns an axis by itself
        load = Body(float(rng.uniform(0.0, 0.3 * float(rng.choice((1.0, 30.0))))), np.array((0.0, 0.0, 0.08)))
        plant.set_load_data(load)
        known = load if load.mass > 0.3 else None  # a light one that nobody declared
        self.name = (
            f"{self.seed}: {model}, {self.name}, {period} ms, {stiffness:g} Nm/rad, {load.mass:.2f} kg, "
            f"{'ideal' if errors is None else 'noisy'} sensors"
        )
        limits = Limits.of(arm)
        joints, guard = JointGuard(limits), TorqueGuard(limits, rigid_bodies(arm, known, rotor=ROTOR))
        dt = period * 1e-3
        joints.start(start.tolist(), [0.0] * 7, period=dt)
        guard.start()
        mode = CartesianImpedance(stiffness=(stiffness,) * 6) if self.by_wrench else JointImpedance(stiffness)
        plant.submit(MotionCommand(1, Hold(duration=nan), mode=mode))
        plant.step(50)
        size = 6 if self.by_wrench else 7
        limited, guarded = (
            (joints.force, guard.limit_wrench) if self.by_wrench else (joints.torque, guard.limit)
        )
        set_point, effort, waiting = plant.snapshot.q_cmd, np.zeros(size), np.zeros(size)
        before = plant.snapshot.q
        low, high = arm.q_min, arm.q_max
        for k in range(round(seconds * 1e3)):
            if k % period == 0:  # the answer acts one period after its message
                effort = waiting
                q = plant.snapshot.q
                dq, before = (q - before) / dt, q
                with np.errstate(all="ignore"):
                    target = limited(law(q, dq, k * 1e-3)[:size].tolist())
                braking = self.is_ending and k > 500 * seconds
                if self.is_guarded:
                    target = guarded(target, q=q, dq=dq, period=dt, is_braking=braking)
                waiting = np.array(target)
            plant.overlay(
                Superposition(set_point, wrench=effort)
                if self.by_wrench
                else Superposition(set_point, tau=effort)
            )
            plant.tick()
            self.speed = np.maximum(self.speed, np.abs(plant.data.qvel[:7]) / arm.dq_max)
            here = plant.data.qpos[:7]
            self.nearest = min(self.nearest, float(np.minimum(here - low, high - here).min()))
            if StopRequest.DRIVE_ERROR in plant.safety.stop_requests:
                self.error = "drive error"
                break
        self.final_speed, self.final_effort = plant.data.qvel[:7].copy(), effort
        return self
