"""The peg-in-hole policy, trained on five seeds and judged on holes that no training has seen."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from bench.measure.figure import Figure, benchmark
from bench.rl.training import SEEDS
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.plug_insert import PlugInsert
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.evaluate import evaluate
from heptarm.rl.policy import Policy, shipped_contact
from heptarm.rl.train.recipe import LATE
from heptarm.values.pose import Pose

#: Holes of an evaluation, and the clearance that was not trained [m].
HOLES, TIGHT = 200, 0.2e-3
#: What is promised: processor time of a training [s], fractions of the holes, and the force [N].
PROCESSOR, SUCCESS, TIGHT_SUCCESS, FORCE = 1200.0, 0.95, 0.8, 30.0

#: Tasks beside peg-in-hole whose policies are part of heptarm, and the fraction of targets that they are to reach.
OTHERS: tuple[type[ContactTask], ...] = (PlugInsert, Push)
OTHER_SUCCESS = 0.9


@dataclass(frozen=True, slots=True)
class Elsewhere(PegInHole):
    """The same hole in a fixture that is farther left, higher, and leans by 20 degrees: the arm bends otherwise."""

    origin: ClassVar[Pose] = Pose.of((0.5, 0.3, 0.35), (0.0, 1.0, 0.0, 0.0)) @ Pose.from_rotvec(
        (0.0, 0.0, 0.0), (0.2, 0.28, 0.0)
    )


def judged(policy: Policy[PegInHole]) -> dict[str, Any]:
    """What a policy does with unseen holes: as trained, tighter, and elsewhere."""
    numbers = {name: value for name, value in policy.task.as_dict().items() if name != "name"}
    tasks = {
        "": policy.task,
        "_tight": replace(policy.task, clearance=TIGHT),
        "_elsewhere": Elsewhere.from_dict(numbers),
    }
    found: dict[str, Any] = {}
    for name, task in tasks.items():
        report = evaluate(policy, HOLES, task=task, randomisation=LATE, seed=9)
        found[f"success{name}"] = report.success_rate
        found[f"time{name}"] = float(np.median(report.time_to_reach))
        found[f"force{name}"] = round(float(report.peak_force.max()), 1)
        found[f"above_30_N{name}"] = int((report.peak_force > FORCE).sum())
    return found


def trained(seed: int) -> dict[str, Any]:
    """What a training gives by its seed, and the processor time that it takes [s]."""
    from heptarm.rl.train.recipe import Recipe
    from heptarm.rl.train.train import train

    begun = time.process_time()
    result = train(Recipe.of(PegInHole(), seed=seed))
    seconds = time.process_time() - begun
    return {
        "seed": seed,
        "processor_s": round(seconds),
        "wall_s": round(result.seconds),
        **judged(result.policy),
    }


@benchmark("rl_peg")
def rl_peg() -> Iterator[Figure]:
    """A peg in a hole, trained on five seeds: 200 unseen holes each; the worst seed counts."""
    seeds = [trained(seed) for seed in SEEDS]
    yield from figures("rl_peg", seeds)
    yield Figure("rl_peg_processor", max(one["processor_s"] for one in seeds), "s", limit=PROCESSOR)


@benchmark("rl_peg_included")
def rl_peg_included() -> Iterator[Figure]:
    """The included policy on 200 unseen holes."""
    yield from figures("rl_peg_included", [judged(shipped_contact(PegInHole))])


@benchmark("rl_other_tasks")
def rl_other_tasks() -> Iterator[Figure]:
    """The included policies of other tasks with contacts, on 200 unseen targets each."""
    for kind in OTHERS:
        report = evaluate(shipped_contact(kind), HOLES, randomisation=LATE, seed=9)
        name = f"rl_{kind.name.replace('-', '_')}"
        yield Figure(f"{name}_success", report.success_rate, "fraction", limit=OTHER_SUCCESS, at_least=True)
        yield Figure(f"{name}_time", float(np.median(report.time_to_reach)), "s")
        yield Figure(f"{name}_force", float(report.peak_force.max()), "N")


def figures(name: str, rows: list[dict[str, Any]]) -> Iterator[Figure]:
    """The worst of some policies."""

    def worst(key: str, choose: Any = min) -> float:
        return float(choose(row[key] for row in rows))

    detail = {"policies": rows}
    yield Figure(f"{name}_success", worst("success"), "fraction", limit=SUCCESS, at_least=True, detail=detail)
    yield Figure(f"{name}_tight", worst("success_tight"), "fraction", limit=TIGHT_SUCCESS, at_least=True)
    yield Figure(f"{name}_elsewhere", worst("success_elsewhere"), "fraction", limit=SUCCESS, at_least=True)
    yield Figure(f"{name}_time", worst("time", max), "s")
    yield Figure(f"{name}_force", worst("force", max), "N", limit=FORCE)
