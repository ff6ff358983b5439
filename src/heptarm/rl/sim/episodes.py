"""Episodes of many simulated arms, the same for every task: what is drawn, late commands, ends, checkpoints."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.tasks import Task
from heptarm.values.checks import Array, finite_entries, instance, integer, numbers, word

#: Numbers of arms.
Index: TypeAlias = npt.NDArray[np.integer[Any]]
#: Most arms, and threads.
_MANY = 1_000_000
_LARGEST_SEED = 2**63 - 1
#: Selects every arm without a copy.
ALL = slice(None)


@dataclass(frozen=True, slots=True)
class Step:
    """Result of one decision of all arms.

    Attributes:
        observation: what each sees now, after a new episode began where one ended, shape (envs, n).
        reward: shape (envs,).
        tip: where the flange, or the tip of the tool, is after the decision, shape (envs, 3) [m].
        distance: from there to the target, shape (envs,) [m].
        force: on the tip, the mean of the decision without errors of sensors, shape (envs,) [N]; zeros where a task has
            no contacts.
        done: which episodes ended, all of them by their length, shape (envs,).
        final: what those saw last, shape (done.sum(), n).
    """

    observation: Array
    reward: Array
    tip: Array
    distance: Array
    force: Array
    done: npt.NDArray[np.bool_]
    final: Array


@dataclass(frozen=True, slots=True)
class BatchSettings:
    """Settings of many simulated arms, of any task.

    Attributes:
        envs: number of arms.
        randomisation: what differs between them.
        seed: of everything drawn; the same seed gives the same run.
        threads: of the simulation.
        starts: "staggered": the first episodes begin somewhere in their time, so that not all end together;
            "together": all begin at 0.

    Raises:
        LimitError: no arms, or no threads.
        CommandRejected: other starts.
    """

    _: KW_ONLY
    envs: int = 256
    randomisation: Randomisation = NONE
    seed: int | np.random.SeedSequence = 0
    threads: int = 2
    starts: str = "staggered"

    def __post_init__(self) -> None:
        instance(self.randomisation, Randomisation, "randomisation")
        for name in ("envs", "threads"):
            integer(getattr(self, name), name, 1, _MANY)
        if not isinstance(self.seed, np.random.SeedSequence):
            integer(self.seed, "seed", 0, _LARGEST_SEED)
        word(self.starts, "starts", ("staggered", "together"))


class TaskBatch(ABC):
    """A task on many simulated arms; episodes that end restart by themselves.

    A simulation of one task defines how an episode begins, what a command does, and what an arm sees. It calls `reset`
    at the end of its constructor.

    Args:
        task: the task.
        settings: how many arms, and what differs between them.
        sizes: of a target and of a command.

    Attributes:
        target: what the episodes are about, shape (envs, n), as the task draws it.
        command: the last one of each arm, shape (envs, n).
        age: decisions since an episode began, shape (envs,).
    """

    task: Task

    def __init__(self, task: Task, settings: BatchSettings, *, sizes: tuple[int, int]) -> None:
        envs, randomisation = settings.envs, settings.randomisation
        self.task, self.envs, self.randomisation = task, envs, randomisation
        self.target, self.command = (np.zeros((envs, size)) for size in sizes)
        self.age = np.zeros(envs, dtype=np.int64)
        self._random = np.random.default_rng(settings.seed)
        self._all = np.arange(envs)
        self._staggered = settings.starts == "staggered"
        self._latency = np.zeros(envs, dtype=np.int64)
        # commands, the newest first
        self._late = np.zeros((randomisation.latency[1] + 1, *self.command.shape))

    # ------------------------------------------------------------------------------ what a task defines

    @property
    @abstractmethod
    def q(self) -> Array:
        """Measured positions, shape (envs, 7) [rad]."""

    @abstractmethod
    def outcome(self) -> tuple[Array, Array]:
        """Where the flanges or the tips of the tools are, shape (envs, 3), and what is left, shape (envs,) [m]."""

    @abstractmethod
    def observe(self, which: Index | slice = ALL) -> Array:
        """The current observations of all arms or some, shape (envs, n)."""

    @abstractmethod
    def _place(self, which: Index, starts: Array) -> None:
        """Put some arms at rest at what they are commanded first, and draw what else differs from before."""

    @abstractmethod
    def _advance(self, action: Array) -> Array:
        """The next commands, for actions of shape (envs, n)."""

    @abstractmethod
    def _simulate(self, command: Array) -> Array | float:
        """Simulate one decision; return the forces on the tips [N]."""

    @abstractmethod
    def _reward(self, distance: Array) -> Array:
        """Rewards of the last decision, shape (envs,)."""

    def _changing(self) -> dict[str, Any]:
        """The arrays that make up the state of the simulation, by name."""
        return {
            "target": self.target,
            "command": self.command,
            "age": self.age,
            "latency": self._latency,
            "late": self._late,
        }

    def teach(self) -> Array:
        """Actions of a teacher that knows more than a policy, shape (envs, actions).

        Raises:
            CommandRejected: the task has none.
        """
        raise CommandRejected(f"the task {self.task.name} has no teacher", parameter="task")

    # ------------------------------------------------------------------------------ episodes

    def reset(self, targets: npt.ArrayLike | None = None, *, seed: int | None = None) -> Array:
        """Start an episode of every arm.

        Args:
            targets: shape (envs, n), as the task draws them; None: drawn.
            seed: draw from here on by this seed; None: go on drawing.

        Returns:
            The observations, shape (envs, n).

        Raises:
            ShapeError: targets of another shape.
            LimitError: one of them is not finite.
        """
        given = None if targets is None else self._checked(targets, "targets", self.target.shape)
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._begin(self._all, given)
        if self._staggered:
            self.age[:] = self._random.integers(0, self.task.steps, self.envs)
        return self.observe()

    def _begin(self, which: Index, targets: Array | None = None) -> None:
        task, random, count = self.task, self._random, len(which)
        starts, drawn = task.starts(random, count), task.targets(random, count)
        self.target[which] = drawn if targets is None else targets
        self.command[which] = self._late[:, which] = task.begin(starts)
        self.age[which] = 0
        self._latency[which] = self.randomisation.draw_latency(random, count)
        self._place(which, starts)

    def step(self, action: npt.ArrayLike) -> Step:
        """One decision of every arm.

        Args:
            action: shape (envs, actions), clipped to +-1.

        Raises:
            ShapeError: another shape.
            LimitError: not finite.
        """
        given = self._checked(action, "action", (self.envs, self.task.action_size))
        self.command = self._advance(given)
        self._late[1:] = self._late[:-1]
        self._late[0] = self.command
        force = np.broadcast_to(self._simulate(self._late[self._latency, self._all]), self.envs)
        tip, distance = self.outcome()
        reward = self._reward(distance)
        self.age += 1
        observation = self.observe()
        done = self.age >= self.task.steps
        final = observation[done]
        if done.any():
            which = np.flatnonzero(done)
            self._begin(which)
            observation[done] = self.observe(which)
        return Step(observation, reward, tip, distance, force, done, final)

    @staticmethod
    def _checked(value: npt.ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
        given = numbers(value, name)
        # of one arm: without the axis of the arms, as its environment has it
        is_one = shape[0] == 1 and given.ndim == len(shape)
        if given.shape != shape:
            wanted, got = (shape[1:], given.shape[1:]) if is_one else (shape, given.shape)
            raise ShapeError(f"{name} must have shape {wanted}, got {got}", parameter=name)
        finite_entries(given[0] if is_one else given, name)
        return given

    # ------------------------------------------------------------------------------ interrupted training

    def save(self) -> dict[str, Any]:
        """The complete state, to resume later: arrays and one text."""
        arrays = {name: np.array(rows) for name, rows in self._changing().items()}
        return {**arrays, "random": json.dumps(self._random.bit_generator.state)}

    def load(self, entries: dict[str, Any]) -> None:
        """Restore what `save` returned, of a simulation with the same arguments.

        Raises:
            ShapeError: it had another number of arms.
        """
        if np.shape(entries["target"]) != self.target.shape:
            raise ShapeError(
                f"the saved simulation must have {self.envs} arms, got {len(entries['target'])} arms"
            )
        for name, rows in self._changing().items():
            rows[:] = entries[name]
        self._random.bit_generator.state = json.loads(entries["random"])
