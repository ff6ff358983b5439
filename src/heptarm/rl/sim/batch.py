"""Batched simulation of the included model with full dynamics; `mujoco.batch` steps it on a few threads."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from heptarm.errors import MissingExtra
from heptarm.rl.sim import simulation
from heptarm.rl.sim.episodes import ALL, BatchSettings, Index, TaskBatch
from heptarm.rl.task import ReachTask
from heptarm.values.checks import Array

#: Of the arrays of an engine in those of a simulation.
_ENGINE = "engine."


class Engine:
    """Arms that follow commanded joint positions: the replaceable engine.

    Args:
        task: the task.
        envs: number of arms.
        threads: of the engine.

    Attributes:
        q: measured positions, shape (envs, 7) [rad].
        dq: measured velocities, shape (envs, 7) [rad/s].
    """

    def __init__(self, task: ReachTask, *, envs: int, threads: int) -> None:
        try:
            from mujoco import batch
        except ImportError as error:
            raise MissingExtra(
                f"training needs mujoco.batch, which MuJoCo {mujoco.__version__} lacks",
                parameter="mujoco",
                hint="pip install 'heptarm[rl]'",
            ) from error
        self._batch = batch.Batch(simulation.build(task), nsim=envs, nthread=threads)
        self._inertia = simulation.mass(task)
        bind = self._batch.bind
        self.q, self.dq = bind("qpos"), bind("qvel")
        self._state = {
            name: bind(name) for name in ("qpos", "qvel", "act", "ctrl", "qacc_warmstart", "xfrc_applied")
        }
        self._filter: Any = None
        self._steps = simulation.SUBSTEPS

    def payload(self, mass: Array) -> None:
        """Attach unknown masses to the flanges, shape (envs,) [kg]; their weight acts as a force."""
        self._batch.expand("body_mass")[:, -1] += mass
        self._batch.set_const()
        self._state["xfrc_applied"][:, -1, 2] = -simulation.GRAVITY * mass

    def stiffness(self, values: Array) -> None:
        """Control the arms by joint impedance of these stiffnesses, shape (envs,) [Nm/rad]."""
        stiff, damp = simulation.gains(self._inertia, values)
        self._batch.expand("actuator_gainprm")[:, :, 0] = stiff
        bias = self._batch.expand("actuator_biasprm")
        bias[:, :, 1], bias[:, :, 2] = -stiff, -damp

    def bandwidth(self, which: Index, values: Array) -> None:
        """Set the servo's bandwidth of some arms, shape (n,) [rad/s]."""
        if self._filter is None:
            self._filter = self._batch.expand("actuator_dynprm")
        self._filter[which, :, 0] = 1.0 / values[:, None]

    def place(self, which: Index, q: Array) -> None:
        """Put some arms at rest at joint positions, shape (n, 7) [rad]."""
        state = self._state
        state["qpos"][which] = state["act"][which] = state["ctrl"][which] = q
        state["qvel"][which] = 0.0
        state["qacc_warmstart"][which] = 0.0

    def step(self, command: Array) -> None:
        """Simulate one decision with commanded joint positions, shape (envs, 7) [rad]."""
        self._state["ctrl"][:] = command
        self._batch.step(nstep=self._steps)

    def save(self) -> dict[str, Array]:
        """Everything that changes, as copies; the drawn robots themselves are in `BatchReach.save`."""
        entries = {name: np.array(rows) for name, rows in self._state.items()}
        if self._filter is not None:
            entries["filter"] = np.array(self._filter[:, :, 0])
        return entries

    def load(self, entries: dict[str, Array]) -> None:
        """Restore what `save` returned."""
        for name, rows in self._state.items():
            rows[:] = entries[name]
        if "filter" in entries:
            self.bandwidth(np.arange(len(self.q)), np.ones(len(self.q)))  # so that the field is there
            self._filter[:, :, 0] = entries["filter"]


class BatchReach(TaskBatch):
    """The reach task on many simulated arms.

    Args:
        task: the task.
        settings: how many arms, and what differs between them.
        engine: class of the simulation, `Engine` or one with its methods.

    Raises:
        MissingExtra: the installed MuJoCo is too old.
    """

    task: ReachTask

    def __init__(
        self,
        task: ReachTask,
        settings: BatchSettings | None = None,
        *,
        engine: Any = Engine,
    ) -> None:
        chosen = settings or BatchSettings()
        envs, randomisation = chosen.envs, chosen.randomisation
        super().__init__(task, chosen, sizes=(3, 7))
        self.engine = engine(task, envs=envs, threads=chosen.threads)
        if randomisation.payload[1] > 0:
            self.engine.payload(randomisation.draw_payload(self._random, envs))
        if simulation.is_compliant(randomisation.stiffness):
            self.engine.stiffness(randomisation.draw_stiffness(self._random, envs))
        self.held = np.zeros((envs, 3, 3)) if task.action == "cartesian" else None
        self._noise = np.ones((envs, 7))
        self.reset()

    @property
    def q(self) -> Array:
        """Measured positions, shape (envs, 7) [rad]."""
        result: Array = np.asarray(self.engine.q)
        return result

    def _place(self, which: Index, starts: Array) -> None:
        self.engine.bandwidth(which, self.randomisation.draw_bandwidth(self._random, len(which)))
        self.engine.place(which, starts)
        if self.held is not None:
            self.held[which] = self.task.hold(starts)

    def observe(self, which: Index | slice = ALL) -> Array:
        """The current observations of all arms or some, shape (envs, n)."""
        engine = self.engine
        return self.task.observe(engine.q[which], engine.dq[which] * self._noise[which], self.target[which])

    def _advance(self, action: Array) -> Array:
        return self.task.advance(self.command, self.engine.q, action, self.held)

    def _simulate(self, command: Array) -> float:
        self.engine.step(command)
        noise = self.randomisation.velocity_noise
        if noise:
            self._noise = self._random.uniform(1.0 - noise, 1.0 + noise, (self.envs, 7))
        return 0.0

    def outcome(self) -> tuple[Array, Array]:
        """Where the flanges are, shape (envs, 3), and their distances from the targets, shape (envs,) [m]."""
        tip = self.task.tip(self.engine.q)
        return tip, self.task.distance(tip, self.target)

    def _reward(self, distance: Array) -> Array:
        return self.task.reward(distance)

    def _changing(self) -> dict[str, Any]:
        held = {} if self.held is None else {"held": self.held}
        return {**super()._changing(), "noise": self._noise, **held}

    def save(self) -> dict[str, Any]:
        """The complete state, to resume later: arrays and one text."""
        return {
            **super().save(),
            **{_ENGINE + name: rows for name, rows in self.engine.save().items()},
        }

    def load(self, entries: dict[str, Any]) -> None:
        """Restore what `save` returned, of a simulation with the same arguments.

        Raises:
            ShapeError: it had another number of arms.
        """
        super().load(entries)
        own = {name.removeprefix(_ENGINE): rows for name, rows in entries.items() if name.startswith(_ENGINE)}
        self.engine.load(own)
