"""MuJoCo Warp as an engine: the same arms, tens of thousands at once on an NVIDIA GPU.

It also runs on the CPU, slower than `heptarm.rl.sim.batch.Engine`, which serves to test it. Its numbers are of
single precision. The first step of a process compiles its kernels, up to two minutes; they are kept for the next.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from heptarm.errors import require
from heptarm.rl.sim import simulation
from heptarm.rl.sim.episodes import Index
from heptarm.rl.task import ReachTask
from heptarm.values.checks import Array

#: Capacity for contacts and constraint rows of each arm: seven joint limits, and contacts.
CONTACTS = 8
CONSTRAINTS = 40


class WarpEngine:
    """Arms that follow commanded joint positions; same methods as `heptarm.rl.sim.batch.Engine`.

    Args:
        task: the task.
        envs: number of arms.
        threads: not used.

    Attributes:
        q: measured positions, shape (envs, 7) [rad].
        dq: measured velocities, shape (envs, 7) [rad/s].

    Raises:
        MissingExtra: `mujoco_warp` is not installed.
    """

    def __init__(self, task: ReachTask, *, envs: int, threads: int = 1) -> None:
        self._warp = require("warp", extra="rl-gpu")
        self._mjw = require("mujoco_warp", extra="rl-gpu")
        if self._warp.is_cuda_available():  # each worker of a machine has its own GPU
            own_gpu = int(os.environ.get("LOCAL_RANK", "0")) % self._warp.get_cuda_device_count()
            self._warp.set_device(f"cuda:{own_gpu}")
        import mujoco

        model = simulation.build(task)
        data = mujoco.MjData(model)
        data.qpos[:7] = data.act[:7] = data.ctrl[:7] = task.home
        mujoco.mj_forward(model, data)
        self._inertia = simulation.mass(task)
        own = ("actuator_dynprm", "actuator_gainprm", "actuator_biasprm", "body_mass")
        self._model = self._mjw.put_model(model, batch_sizes=dict.fromkeys(own, envs))
        self._data = self._mjw.put_data(model, data, nworld=envs, naconmax=CONTACTS * envs, njmax=CONSTRAINTS)
        self._rows = {name: getattr(self._data, name) for name in ("qpos", "qvel", "act", "ctrl")}
        self._rows["qacc_warmstart"] = self._data.qacc_warmstart
        self._pull = np.zeros((envs, model.nbody, 6), dtype=np.float32)
        self._filter = self._model.actuator_dynprm.numpy().copy()
        self._graph: Any = None
        self.q, self.dq = np.zeros((envs, 7)), np.zeros((envs, 7))
        self._sense()

    def payload(self, mass: Array) -> None:
        """Attach unknown masses to the flanges, shape (envs,) [kg]; their weight acts as a force."""
        masses = self._model.body_mass.numpy().copy()
        masses[:, -1] += mass
        self._model.body_mass.assign(masses)
        self._mjw.set_const(self._model, self._data)
        self._pull[:, -1, 2] = -simulation.GRAVITY * mass
        self._data.xfrc_applied.assign(self._pull)

    def stiffness(self, values: Array) -> None:
        """Control the arms by joint impedance of these stiffnesses, shape (envs,) [Nm/rad]."""
        stiff, damp = simulation.gains(self._inertia, values)
        gain, bias = (
            array.numpy().copy() for array in (self._model.actuator_gainprm, self._model.actuator_biasprm)
        )
        gain[:, :, 0], bias[:, :, 1], bias[:, :, 2] = stiff, -stiff, -damp
        self._model.actuator_gainprm.assign(gain)
        self._model.actuator_biasprm.assign(bias)

    def bandwidth(self, which: Index, values: Array) -> None:
        """Set the servo's bandwidth of some arms, shape (n,) [rad/s]."""
        self._filter[which, :, 0] = 1.0 / values[:, None]
        self._model.actuator_dynprm.assign(self._filter)

    def place(self, which: Index, q: Array) -> None:
        """Put some arms at rest at joint positions, shape (n, 7) [rad]."""
        for name, rows in self._rows.items():
            host = rows.numpy().copy()
            host[which] = q if name in ("qpos", "act", "ctrl") else 0.0
            rows.assign(host)
        self._sense()

    def step(self, command: Array) -> None:
        """Simulate one decision with commanded joint positions, shape (envs, 7) [rad]."""
        self._data.ctrl.assign(command.astype(np.float32))
        if self._graph is not None:
            self._warp.capture_launch(self._graph)
        else:
            self._substeps()
            if self._warp.get_device().is_cuda:
                # the first pass has compiled every kernel; from now on the GPU repeats it without the host
                with self._warp.ScopedCapture() as capture:
                    self._substeps()
                self._graph = capture.graph
        self._sense()

    def save(self) -> dict[str, Array]:
        """Everything that changes, as copies."""
        entries: dict[str, Array] = {name: np.array(rows.numpy()) for name, rows in self._rows.items()}
        return {**entries, "filter": self._filter.copy()}

    def load(self, entries: dict[str, Array]) -> None:
        """Restore what `save` returned."""
        for name, rows in self._rows.items():
            rows.assign(entries[name])
        self._filter = np.array(entries["filter"])
        self._model.actuator_dynprm.assign(self._filter)
        self._sense()

    def _substeps(self) -> None:
        for _ in range(simulation.SUBSTEPS):
            self._mjw.step(self._model, self._data)

    def _sense(self) -> None:
        self.q[:] = self._rows["qpos"].numpy()
        self.dq[:] = self._rows["qvel"].numpy()
