"""A12: a thousand states a second while the arm moves, and what a tick of the plant costs meanwhile."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS

#: A shorter run for a first look; the promise is for 60 s.
SECONDS = float(os.environ.get("BENCH_SECONDS", "60"))


@benchmark("state_push", "A12")
def state_push() -> Iterator[Figure]:
    """State push at 1 kHz: delivery, order, consistency, age, and the plant's tick."""
    stamps: list[int] = []
    ages: list[float] = []
    kept: list[tuple[np.ndarray, Pose]] = []
    with Cabinet() as cabinet, ha.connect(cabinet.target, state_rate=1000) as arm:
        arm.speed = 0.3
        there, back = (
            ha.ptp(ha.deg(30, 40, 10, -70, 20, 60, 30)),
            ha.ptp(ha.deg(-30, 20, -10, -100, -20, 50, -30)),
        )
        arm.start([there, back] * int(SECONDS))  # longer than the run; closing stops it
        stream = arm.states(duration=SECONDS, size=20_000)
        for state in stream:
            ages.append(state.age)
            stamps.append(state.stamp)
            if len(stamps) % 10 == 0:
                kept.append((state.q, state.pose))
        lost = stream.lost
        stats = cabinet.stats()
    times = np.array(stamps)
    expected = (times[-1] - times[0]) / 1e6 + 1
    age_us = np.array(ages) * 1e6
    robot = ROBOTS["iiwa14"]
    torn = sum(float(np.abs(forward(robot, q)[:3, 3] - pose.xyz).max()) > 1e-9 for q, pose in kept)
    detail = {"states": len(stamps), "expected": int(expected), "dropped_by_client": lost, "seconds": SECONDS}
    yield Figure(
        "push_delivered",
        "A12",
        len(np.unique(times)) / expected,
        "share",
        limit=0.999,
        least=True,
        detail=detail,
    )
    yield Figure("push_out_of_order", "A12", int((np.diff(times) <= 0).sum()), "states", limit=0)
    yield Figure("push_torn", "A12", torn, "states", limit=0, detail={"checked": len(kept)})
    yield Figure("push_age_median", "A12", float(np.median(age_us)), "us", limit=500)
    yield Figure("push_age_p99", "A12", float(np.percentile(age_us, 99)), "us", limit=2000)
    lateness = {"lateness_us": stats["lateness_us"], "rebased": stats["rebased"], "refused": stats["refused"]}
    yield Figure("tick_median", "A12", stats["tick_us"]["p50"], "us", limit=150, detail=lateness)
    yield Figure("tick_p99", "A12", stats["tick_us"]["p99"], "us", limit=500)
