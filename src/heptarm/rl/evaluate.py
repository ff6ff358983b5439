"""Evaluation of a policy in simulation: episodes on targets that are not used in training."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError
from heptarm.rl.policy import Policy
from heptarm.rl.report import EpisodeReport
from heptarm.rl.sim.batch import Engine
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.sim.simulate import simulate
from heptarm.rl.tasks import Task
from heptarm.values.checks import Array

#: Keeps held-back targets apart from those of training, whatever the seeds.
_HELD_BACK = 0x4E1D


def held_back(task: Task, count: int, *, seed: int = 0) -> Array:
    """Targets that training never draws, shape (count, n), as the task draws them."""
    return task.targets(np.random.default_rng([_HELD_BACK, seed]), count)


def evaluate(
    policy: Policy[Any] | Callable[[Array], npt.ArrayLike],
    targets: int | npt.ArrayLike = 1000,
    *,
    task: Task | None = None,
    randomisation: Randomisation = NONE,
    seed: int = 0,
    threads: int = 2,
    engine: Any = Engine,
) -> EpisodeReport:
    """Run a policy, one episode per target.

    Args:
        policy: the policy, or any function of observations, shape (n, observations), to actions.
        targets: how many held-back ones, or the targets themselves, as the task draws them.
        task: None: the policy's.
        randomisation: of the simulated robots; those of training are `heptarm.rl.sim.randomisation.LEVELS`.
        seed: of targets and starts.
        threads: of the simulation.
        engine: class of the simulation's engine, as `heptarm.rl.sim.plant_engine.PlantEngine`.

    Raises:
        CommandRejected: a function without its task.
        ShapeError: targets of another shape.
        LimitError: no targets.
    """
    known = policy.task if isinstance(policy, Policy) else task
    if known is None:
        raise CommandRejected("task must be given with a function, which has none", parameter="task")
    task = task or known
    if isinstance(targets, int):
        if targets < 1:
            raise LimitError(f"targets must be at least 1, got {targets}", code=2, parameter="targets")
        goals = held_back(task, targets, seed=seed)
    else:
        goals = np.atleast_2d(np.asarray(targets, dtype=np.float64))
    arms = simulate(
        replace(task, steps=task.steps + 1),  # so that no arm begins again before its last state is read
        BatchSettings(
            envs=len(goals),
            randomisation=randomisation,
            seed=np.random.SeedSequence([_HELD_BACK, seed, 1]),
            threads=threads,
            starts="together",
        ),
        engine=engine,
    )
    observation = arms.reset(goals)
    distances, forces = np.empty((len(goals), task.steps)), np.empty((len(goals), task.steps))
    paths = np.empty((len(goals), task.steps + 1, 3))
    joints = np.empty((len(goals), task.steps + 1, 7))
    paths[:, 0], joints[:, 0] = arms.outcome()[0], arms.q
    for t in range(task.steps):
        step = arms.step(policy(observation))
        observation, distances[:, t], forces[:, t] = step.observation, step.distance, step.force
        paths[:, t + 1], joints[:, t + 1] = step.tip, arms.q
    facts = {"engine": engine.__name__, "randomisation": randomisation.as_dict(), "seed": seed}
    return EpisodeReport(task, goals, distances, paths, joints=joints, forces=forces, facts=facts)
