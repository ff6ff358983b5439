"""Policies trained on five seeds, and steps per second of training and of simulation alone."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from math import inf
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm.rl.evaluate import evaluate
from heptarm.rl.sim.batch import BatchReach
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.randomisation import Randomisation
from heptarm.rl.task import ReachTask

if TYPE_CHECKING:
    from heptarm.rl.train.recipe import Recipe

#: Number of trained seeds; fewer, such as BENCH_SEEDS=1, for a quick check.
SEEDS = range(int(os.environ.get("BENCH_SEEDS", "5")))
TARGETS = 1000
#: Late and compliant, on the plant: two decisions are 67 ms.
HARD = Randomisation(latency=(2, 2), stiffness=(300.0, 300.0))
ON_PLANT = 20


def _train(name: str, recipes: list[Recipe], limit: float) -> Iterator[Figure]:
    """Figures of one kind of training over all seeds: the worst counts."""
    from heptarm.rl.sim.plant_engine import PlantEngine
    from heptarm.rl.train.train import train

    means, p95s, walls, hard, hits = [], [], [], [], []
    for recipe in recipes:
        trained = train(recipe)
        report = evaluate(trained.policy, TARGETS)
        means.append(report.mean)
        p95s.append(report.p95)
        hits.append(report.success_rate)
        walls.append(trained.seconds)
        hard.append(evaluate(trained.policy, ON_PLANT, engine=PlantEngine, randomisation=HARD).mean)
    millimetres = [round(1e3 * value, 2) for value in means]
    detail = {
        "steps": trained.steps,
        "mean_mm": millimetres,
        "p95_mm": [round(1e3 * value, 2) for value in p95s],
        "within_35_mm": [round(value, 4) for value in hits],
        "wall_s": [round(value, 1) for value in walls],
    }
    yield Figure(f"{name}_error", max(means), "m", limit=limit, detail=detail)
    yield Figure(f"{name}_wall", median(walls), "s")
    late = {"latency_ms": 67, "stiffness": 300, "mean_mm": [round(1e3 * value, 2) for value in hard]}
    yield Figure(f"{name}_compliant_late_error", max(hard), "m", detail=late)


@benchmark("rl_exact")
def rl_exact() -> Iterator[Figure]:
    """The paper's state, action and reward, 2.2 million steps, five seeds: mean final error on 1,000 targets."""
    from heptarm.rl.train.recipe import Recipe

    yield from _train("reach_exact", [Recipe.exact(seed=seed) for seed in SEEDS], 0.010)


@benchmark("rl_robust")
def rl_robust() -> Iterator[Figure]:
    """The same with strong randomisation and an action cost: for late networks and compliant arms."""
    from heptarm.rl.train.recipe import Recipe

    yield from _train("reach_robust", [Recipe(seed=seed) for seed in SEEDS[:2]], 0.010)


@benchmark("rl_feature")
def rl_feature() -> Iterator[Figure]:
    """With the kinematic feature, 1.3 million steps, strong randomisation, five seeds."""
    from heptarm.rl.train.recipe import Recipe

    task = ReachTask(feature="kinematic")
    yield from _train("reach_feature", [Recipe(task, seed=seed) for seed in SEEDS], 0.004)


@benchmark("rl_speed")
def rl_speed() -> Iterator[Figure]:
    """Environment steps per second: training, simulation alone on one thread and two, one decision."""
    from heptarm.rl.train.recipe import Recipe
    from heptarm.rl.train.train import train

    recipe = Recipe(steps=250_000)
    trained = train(recipe)
    updates = np.diff([row.seconds for row in trained.history[2:]])  # the first warm up
    per_update = recipe.settings.envs * recipe.settings.horizon
    rate = per_update / float(np.median(updates))
    yield Figure("train_steps", rate, "steps/s")
    for threads in (2, 1):
        arms = BatchReach(ReachTask(), BatchSettings(envs=512, threads=threads))
        action = np.random.default_rng(0).uniform(-1, 1, (512, 7))
        times = []
        for _ in range(150):
            begin = time.perf_counter()
            arms.step(action)
            times.append(time.perf_counter() - begin)
        yield Figure(
            f"simulation_steps_{'two_threads' if threads == 2 else 'one_thread'}",
            512 / float(np.median(times)),
            "steps/s",
            detail={"self_collision": True},
        )
    observation, best = np.zeros(17), inf
    for _ in range(5):
        begin = time.perf_counter()
        for _ in range(2000):
            trained.policy(observation)
        best = min(best, (time.perf_counter() - begin) / 2000)
    yield Figure("policy_decision", best * 1e6, "us")
