"""Batched simulation of the included model with full dynamics; `mujoco.batch` steps it on a few threads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, MissingExtra, ShapeError
from heptarm.rl.sim import simulation
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.task import ReachTask
from heptarm.values.checks import Array

#: Numbers of arms.
Index: TypeAlias = npt.NDArray[np.integer[Any]]


@dataclass(frozen=True, slots=True)
class Step:
    """Result of one decision of all arms.

    Attributes:
        observation: what each sees now, after a new episode began where one ended, shape (envs, n).
        reward: shape (envs,).
        tip: where the flange is after the decision, shape (envs, 3) [m].
        distance: from there to the target, shape (envs,) [m].
        done: which episodes ended, all of them by their length, shape (envs,).
        final: what those saw last, shape (done.sum(), n).
        force: on the tip at the end of the decision, without errors of sensors, shape (envs,) [N]; 0 where a task has
            no contacts.
    """

    observation: Array
    reward: Array
    tip: Array
    distance: Array
    done: npt.NDArray[np.bool_]
    final: Array
    force: Array | float = 0.0


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


class BatchReach:
    """The task on many simulated arms; episodes that end restart by themselves.

    Args:
        task: the task.
        envs: number of arms.
        randomisation: what differs between them.
        seed: of everything drawn; the same seed gives the same run.
        threads: of the simulation.
        starts: "staggered": the first episodes begin somewhere in their time, so that not all end together;
            "together": all begin at 0.
        engine: class of the simulation, `Engine` or one with its methods.

    Raises:
        LimitError: no arms, or no threads.
        MissingExtra: the installed MuJoCo is too old.
    """

    def __init__(
        self,
        task: ReachTask,
        *,
        envs: int = 512,
        randomisation: Randomisation = NONE,
        seed: int | np.random.SeedSequence = 0,
        threads: int = 2,
        starts: str = "staggered",
        engine: Any = Engine,
    ) -> None:
        for name, value in (("envs", envs), ("threads", threads)):
            if value < 1:
                raise LimitError(
                    f"{name} must be at least 1, got {value}", code=2, parameter=name, value=value
                )
        if starts not in ("staggered", "together"):
            raise CommandRejected(f"starts must be 'staggered' or 'together', got {starts!r}", value=starts)
        self.task, self.envs, self.randomisation = task, envs, randomisation
        self._random = np.random.default_rng(seed)
        self.engine = engine(task, envs=envs, threads=threads)
        self._all = np.arange(envs)
        if randomisation.payload[1] > 0:
            self.engine.payload(randomisation.draw_payload(self._random, envs))
        if simulation.is_compliant(randomisation.stiffness):
            self.engine.stiffness(randomisation.draw_stiffness(self._random, envs))
        self._staggered = starts == "staggered"
        self.target = np.zeros((envs, 3))
        self.command = np.zeros((envs, 7))
        self.held = np.zeros((envs, 3, 3)) if task.action == "cartesian" else None
        self.age = np.zeros(envs, dtype=np.int64)
        self._latency = np.zeros(envs, dtype=np.int64)
        self._late = np.zeros((randomisation.latency[1] + 1, envs, 7))  # commands, the newest first
        self._noise = np.ones((envs, 7))
        self.reset()

    @property
    def q(self) -> Array:
        """Measured positions, shape (envs, 7) [rad]."""
        result: Array = np.asarray(self.engine.q)
        return result

    def reset(self, targets: npt.ArrayLike | None = None, *, seed: int | None = None) -> Array:
        """Start an episode of every arm.

        Args:
            targets: shape (envs, 3) [m]; None: drawn.
            seed: draw from here on by this seed; None: go on drawing.

        Returns:
            The observations, shape (envs, n).

        Raises:
            ShapeError: targets of another shape, or not finite.
        """
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._begin(self._all)
        if self._staggered:
            self.age[:] = self._random.integers(0, self.task.steps, self.envs)
        if targets is not None:
            given = np.asarray(targets, dtype=np.float64)
            if given.shape != (self.envs, 3) or not np.isfinite(given).all():
                raise ShapeError(
                    f"targets must have shape {(self.envs, 3)} and be finite, got shape {given.shape}",
                    parameter="targets",
                )
            self.target[:] = given
        return self.observe()

    def _begin(self, which: Index) -> None:
        count = len(which)
        draw, task = self.randomisation, self.task
        q = task.starts(self._random, count)
        self.target[which] = task.targets(self._random, count)
        self.command[which] = q
        self._late[:, which] = q
        self.age[which] = 0
        self._latency[which] = draw.draw_latency(self._random, count)
        self.engine.bandwidth(which, draw.draw_bandwidth(self._random, count))
        self.engine.place(which, q)
        if self.held is not None:
            self.held[which] = task.hold(q)

    def observe(self) -> Array:
        """The current observations, shape (envs, n)."""
        return self.task.observe(self.engine.q, self.engine.dq * self._noise, self.target)

    def step(self, action: npt.ArrayLike) -> Step:
        """One decision of every arm.

        Args:
            action: shape (envs, actions), clipped to +-1.

        Raises:
            ShapeError: another shape, or not finite.
        """
        task, engine = self.task, self.engine
        given = np.asarray(action, dtype=np.float64)
        if given.shape != (self.envs, task.action_size) or not np.isfinite(given).all():
            raise ShapeError(
                f"action must have shape {(self.envs, task.action_size)} and be finite, got shape {given.shape}",
                parameter="action",
            )
        self.command = task.advance(self.command, engine.q, given, self.held)
        if len(self._late) > 1:
            self._late[1:] = self._late[:-1]
        self._late[0] = self.command
        engine.step(self._late[self._latency, self._all])
        noise = self.randomisation.velocity_noise
        if noise:
            self._noise = self._random.uniform(1.0 - noise, 1.0 + noise, (self.envs, 7))
        tip = task.tip(engine.q)
        distance = task.distance(tip, self.target)
        self.age += 1
        observation = self.observe()
        done = self.age >= task.steps
        final = observation[done]
        if done.any():
            which = np.flatnonzero(done)
            self._begin(which)
            observation[done] = task.observe(engine.q[which], engine.dq[which], self.target[which])
        return Step(observation, task.reward(distance), tip, distance, done, final)

    # ------------------------------------------------------------------------------ interrupted training

    def save(self) -> dict[str, Any]:
        """The complete state, to resume later: arrays and one text."""
        arrays = {
            "target": self.target,
            "command": self.command,
            "age": self.age,
            "latency": self._latency,
            "late": self._late,
            "noise": self._noise,
        }
        if self.held is not None:
            arrays["held"] = self.held
        return {
            **{name: np.array(rows) for name, rows in arrays.items()},
            **{f"engine.{name}": rows for name, rows in self.engine.save().items()},
            "random": json.dumps(self._random.bit_generator.state),
        }

    def load(self, entries: dict[str, Any]) -> None:
        """Restore what `save` returned, of a simulation with the same arguments.

        Raises:
            ShapeError: it had another number of arms.
        """
        if np.shape(entries["target"]) != self.target.shape:
            raise ShapeError(
                f"the saved simulation must have {self.envs} arms, got {len(entries['target'])} arms"
            )
        self.target[:], self.age[:] = entries["target"], entries["age"]
        self.command = np.array(entries["command"])
        self._latency[:], self._late[:] = entries["latency"], entries["late"]
        self._noise = np.array(entries["noise"])
        if self.held is not None:
            self.held[:] = entries["held"]
        prefix = "engine."
        self.engine.load({k[len(prefix) :]: v for k, v in entries.items() if k.startswith(prefix)})
        self._random.bit_generator.state = json.loads(entries["random"])
