"""E9: policies on an arm through the whole stack, beside what the arm's own limits allow."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from bench.rl_oracle import Oracle
from heptarm.modes import JointImpedance
from heptarm.rl.deploy import Settings, deploy
from heptarm.rl.evaluate import held_back
from heptarm.rl.policy import shipped
from heptarm.rl.report import Report

EPISODES, SPEED, SOON, LATER = 200, 4.0, 1.5, 1.8
PLAIN = Settings(homing=0.6)
HARD = Settings(homing=0.6, mode=JointImpedance(300.0), latency=0.06)


@benchmark("rl_deploy", "E9")
def rl_deploy() -> Iterator[Figure]:
    """200 episodes each: position control, and joint impedance 300 Nm/rad with 60 ms latency; an oracle beside them."""
    task = shipped().task
    targets = held_back(task, EPISODES, seed=9)
    with Cabinet("--speed", str(SPEED)) as cabinet, ha.connect(cabinet.target) as arm:
        oracle = Oracle(task)
        fewest = np.array([oracle.solve(target)[1] for target in targets]) / task.rate
        for name, settings in (("", PLAIN), ("_soft_late", HARD)):
            best = deploy(arm, oracle, targets, settings=settings)
            yield Figure(
                f"rl_oracle{name}_within_1.5_s",
                "E9",
                best.reached_within(SOON),
                "share",
                detail={"full_speed_bound": round(float((fewest <= SOON).mean()), 3)},
            )
            for kind, feature, limit in (("paper", False, 12.0), ("feature", True, 5.0)):
                report = deploy(arm, shipped(feature=feature), targets, settings=settings)
                yield from _figures(f"rl_deploy_{kind}{name}", report, limit, best.reached_within(SOON))


def _figures(name: str, report: Report, limit: float, attainable: float) -> Iterator[Figure]:
    detail = {
        "median_mm": round(1e3 * report.median, 2),
        "p95_mm": round(1e3 * report.p95, 2),
        **report.facts,
    }
    yield Figure(f"{name}_mean", "E9", 1e3 * report.mean, "mm", limit=limit, detail=detail)
    yield Figure(f"{name}_success", "E9", report.success_rate, "share", limit=0.99, least=True)
    reached = report.time_to_reach
    spread = {"p95_s": round(float(np.percentile(reached, 95)), 3), "worst_s": round(float(reached.max()), 3)}
    yield Figure(f"{name}_reach", "E9", float(np.median(reached)), "s", limit=SOON, detail=spread)
    yield Figure(
        f"{name}_within_1.5_s",
        "E9",
        report.reached_within(SOON),
        "share",
        reference=attainable,
        limit=0.97,
        least=True,
        detail={"promised": 0.99, "within_1.8_s": report.reached_within(LATER)},
    )
