"""The virtual cabinet's plant as an engine: the arm at 1 kHz, with the servo and the control laws of deployment.

It is independent of the training simulator, so good results here show that a policy does not exploit it. Each arm
takes about a millisecond for a decision of 33.
"""

from __future__ import annotations

import numpy as np

from heptarm.planning.motion import TICK
from heptarm.planning.seam import JointDynamics, ServoSmart, ServoTiming
from heptarm.rl.sim.episodes import Index
from heptarm.rl.sim.simulation import GRAVITY, IMPEDANCE_DAMPING
from heptarm.rl.task import ReachTask
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance

_SERVO = 1


class PlantEngine:
    """Several plants; same methods as `heptarm.rl.sim.batch.Engine`.

    Args:
        task: the task.
        envs: number of arms.
        threads: not used.

    Attributes:
        q: measured positions, shape (envs, 7) [rad].
        dq: measured velocities, shape (envs, 7) [rad/s].
        plants: the plants.
    """

    #: Fraction of the axes' largest speed, acceleration and jerk that the servo uses.
    fraction = 1.0

    def __init__(self, task: ReachTask, *, envs: int, threads: int = 1) -> None:
        self.plants: list[Plant] = []
        self.q, self.dq = np.zeros((envs, 7)), np.zeros((envs, 7))
        self._name = task.robot
        self._period = 1.0 / task.rate
        self._time = np.zeros(envs)  # target time of each plant [s]
        self._stiffness: Array | None = None
        self._payload = np.zeros(envs)
        self.place(np.arange(envs), np.tile(np.asarray(task.home), (envs, 1)))

    def payload(self, mass: Array) -> None:
        """Attach unknown masses to the flanges, shape (envs,) [kg]."""
        self._payload = np.asarray(mass, dtype=np.float64)
        for plant, weight in zip(self.plants, self._payload, strict=True):
            plant.apply_wrench((0.0, 0.0, -GRAVITY * float(weight)))

    def stiffness(self, values: Array) -> None:
        """Control the arms by joint impedance of these stiffnesses, shape (envs,) [Nm/rad]."""
        self._stiffness = np.asarray(values, dtype=np.float64)
        self.place(np.arange(len(self.plants)), self.q.copy())

    def bandwidth(self, which: Index, values: Array) -> None:
        """No effect: the plant's servo has its own bandwidth."""

    def place(self, which: Index, q: Array) -> None:
        """Put some arms at rest at joint positions, shape (n, 7) [rad]; each is a new plant."""
        for index, start in zip(which.tolist(), q, strict=True):
            plant = Plant(self._name, q=tuple(start.tolist()))
            if self._payload[index]:
                plant.apply_wrench((0.0, 0.0, -GRAVITY * float(self._payload[index])))
            mode, fraction = None, (self.fraction,) * 7
            if self._stiffness is not None:
                mode = JointImpedance(float(self._stiffness[index]), damping=IMPEDANCE_DAMPING)
            motion = ServoSmart(
                timing=ServoTiming(), dynamics=JointDynamics(velocity=fraction, acceleration=fraction)
            )
            plant.submit(MotionCommand(_SERVO, motion, mode=mode))
            self.plants[index : index + 1] = [plant]
            self._time[index] = 0.0
            self.q[index], self.dq[index] = start, 0.0

    def step(self, command: Array) -> None:
        """Simulate one decision with commanded joint positions, shape (envs, 7) [rad]."""
        self._time += self._period
        for index, plant in enumerate(self.plants):
            plant.shared.post(_SERVO, command[index])
            plant.step(round(self._time[index] / TICK) - plant.tick_count)
            state = plant.snapshot
            self.q[index], self.dq[index] = state.q, state.dq
