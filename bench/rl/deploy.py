"""Policies on an arm through the whole stack, beside the optimum within the limits of the arm."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.rl.oracle import Oracle
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.deploy import DeploySettings, deploy
from heptarm.rl.deploy_contact import ContactSettings, deploy_contact
from heptarm.rl.evaluate import held_back
from heptarm.rl.policy import shipped, shipped_contact
from heptarm.rl.report import EpisodeReport
from heptarm.rl.station import held_peg
from heptarm.values.mode.impedance import JointImpedance

EPISODES, SPEED, SOON, LATER = 200, 4.0, 1.5, 1.8
#: Pegs; fewer, such as BENCH_INSERTIONS=5, for a quick check.
INSERTIONS = int(os.environ.get("BENCH_INSERTIONS", "100"))
PLAIN = DeploySettings(homing=0.6)
HARD = DeploySettings(homing=0.6, mode=JointImpedance(300.0), latency=0.06)


@benchmark("rl_deploy")
def rl_deploy() -> Iterator[Figure]:
    """200 episodes each: position control, and joint impedance 300 Nm/rad with 60 ms latency; an oracle beside them."""
    task = shipped().task
    targets = held_back(task, EPISODES, seed=9)
    with Cabinet("--speed", str(SPEED)) as cabinet, ha.connect(cabinet.target) as arm:
        oracle = Oracle(task)
        fewest = np.array([oracle.solve(target)[1] for target in targets]) / task.rate
        for name, settings in (("", PLAIN), ("_compliant_late", HARD)):
            best = deploy(arm, oracle, targets, settings=settings)
            yield Figure(
                f"rl_oracle{name}_within_1.5_s",
                best.reached_within(SOON),
                "fraction",
                detail={"full_speed_bound": round(float((fewest <= SOON).mean()), 3)},
            )
            for kind, feature, limit in (("paper", False, 12.0), ("feature", True, 5.0)):
                report = deploy(arm, shipped(feature=feature), targets, settings=settings)
                yield from _figures(f"rl_deploy_{kind}{name}", report, limit, best.reached_within(SOON))


def _figures(name: str, report: EpisodeReport, limit: float, attainable: float) -> Iterator[Figure]:
    detail = {
        "median_mm": round(1e3 * report.median, 2),
        "p95_mm": round(1e3 * report.p95, 2),
        **report.facts,
    }
    yield Figure(f"{name}_mean", 1e3 * report.mean, "mm", limit=limit, detail=detail)
    yield Figure(f"{name}_success", report.success_rate, "fraction", limit=0.99, at_least=True)
    reached = report.time_to_reach
    spread = {"p95_s": round(float(np.percentile(reached, 95)), 3), "worst_s": round(float(reached.max()), 3)}
    yield Figure(f"{name}_reach", float(np.median(reached)), "s", limit=SOON, detail=spread)
    yield Figure(
        f"{name}_within_1.5_s",
        report.reached_within(SOON),
        "fraction",
        reference=attainable,
        limit=0.97,
        at_least=True,
        detail={"promised": 0.99, "within_1.8_s": report.reached_within(LATER)},
    )


@benchmark("rl_insert")
def rl_insert() -> Iterator[Figure]:
    """A peg inserted 100 times through the whole stack: noisy sensors, 20 ms latency, unseen holes, 8 s each."""
    yield from _inserted("rl_insert", ContactSettings(latency=0.02, seconds=8.0, stale=2.0))


@benchmark("rl_insert_16_s")
def rl_insert_longer() -> Iterator[Figure]:
    """The same holes with the time that a deployment gives, twice that of training."""
    yield from _inserted("rl_insert_16_s", ContactSettings(latency=0.02, stale=2.0))


@benchmark("rl_insert_fri")
def rl_insert_fri() -> Iterator[Figure]:
    """The same by torques over FRI, 500 times a second."""
    yield from _inserted("rl_insert_fri", ContactSettings(through="fri", latency=0.02, stale=2.0))


def _inserted(name: str, settings: ContactSettings) -> Iterator[Figure]:
    policy = shipped_contact(PegInHole)
    errors = held_back(policy.task, INSERTIONS, seed=101)
    with (
        Cabinet("--scene", "peg-in-hole", "--sensors", "noisy:1") as cabinet,
        ha.connect(cabinet.target, watchdog=5.0) as arm,
        held_peg(arm) as hole,
    ):
        origins = [policy.task.presumed(hole, error) for error in errors]
        report = deploy_contact(arm, policy, origins, errors, settings=settings)
    success, time, force = report.success_rate, report.time_to_reach, report.peak_force
    yield Figure(f"{name}_success", success, "fraction", limit=0.9, at_least=True, detail=report.facts)
    yield Figure(f"{name}_time", float(np.median(time)), "s")
    yield Figure(f"{name}_peak_force", float(force.max()), "N", limit=30.0)
