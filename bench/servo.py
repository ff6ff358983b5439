"""B17: a servo stream at 200 Hz through the whole stack."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.process import Cabinet
from bench.registry import Figure, benchmark

SECONDS, RATE = 60.0, 200.0
SWING = np.array([0, 0, 0, 0, 0, 0.15, 0.3])


@benchmark("servo", "B17")
def servo() -> Iterator[Figure]:
    """200 Hz for 60 s: cost of set, age of targets when applied, gaps, lag on the path."""
    lags = []
    with Cabinet() as cabinet, ha.connect(cabinet.target) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
        with arm.servo("joint", rate=RATE, speed=1.0, acceleration=1.0, watchdog=0.1) as sv:
            while sv.tick() and sv.t < SECONDS:
                goal = sv.start.q + SWING * np.sin(sv.t)
                sv.set(goal)
                lags.append(np.abs(arm.state.q - goal).max())
        stats = sv.stats
    detail = {
        "seconds": SECONDS,
        "sent": stats.sent,
        "rate_hz": round(stats.rate, 2),
        "late_ticks": stats.late_ticks,
        "received": stats.received,
        "applied": stats.applied,
    }
    yield Figure("servo_set_median", "B17", stats.set_median * 1e6, "us", limit=40.0, detail=detail)
    yield Figure("servo_set_p99", "B17", stats.set_p99 * 1e6, "us")
    yield Figure("servo_age_median", "B17", stats.age_median * 1e3, "ms", limit=3.0)
    yield Figure("servo_age_p99", "B17", stats.age_p99 * 1e3, "ms")
    yield Figure("servo_watchdog_trips", "B17", float(stats.late), "count", limit=0.0)
    yield Figure(
        "servo_lag", "B17", float(np.mean(lags)) * 1e3, "mrad", detail={"max": round(max(lags) * 1e3, 2)}
    )
