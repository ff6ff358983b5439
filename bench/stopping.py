"""B19: stops at random instants of every kind of motion, on the plant with its dynamics."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.registry import Figure, benchmark
from heptarm.virtual.plant import Plant
from heptarm.virtual.safety import Demand
from tests.virtual.driving import READY
from tests.virtual.ideal import KINDS, stopping_time

INSTANTS = 200
#: Every stop gets this much beyond its deceleration limit's time for the joints to settle behind their set-points [s].
SETTLING = 0.1
#: How far a servo motion is sent from its start [rad]; farther, the arm runs into the floor or itself at times.
REACH = 0.4
#: At rest [rad/s].
REST = 0.01


@benchmark("stopping", "B19")
def stopping() -> Iterator[Figure]:
    """200 stops of each kind at random instants of each kind of motion: the share that rest in time, and the times."""
    for how in ("path", "fast", "emergency"):
        for kind in KINDS:
            random = np.random.default_rng(19)
            times, in_time = [], 0
            for _ in range(INSTANTS):
                time, allowed = _stop(kind, how, random)
                times.append(time)
                in_time += time <= allowed
            detail = {
                "median_ms": round(float(np.median(times)) * 1e3, 1),
                "max_ms": round(max(times) * 1e3, 1),
            }
            share = 100.0 * in_time / INSTANTS
            yield Figure(f"stop_{how}_{kind}", "B19", share, "%", limit=100.0, least=True, detail=detail)


def _stop(kind: str, how: str, random: np.random.Generator) -> tuple[float, float]:
    """One stop: how long the arm takes to rest, and how long it may [s]."""
    plant, order = Plant("iiwa14", q=READY), KINDS[kind]
    plant.submit(order)
    plant.tick()
    if order.is_servo:
        plant.ring.post(order.id, np.array(READY) + random.uniform(-REACH, REACH, 7))
    plant.step(int(random.integers(1, 700)))
    allowed = stopping_time(plant, how) + SETTLING
    if how == "emergency":
        plant.safety.demand(Demand.EMERGENCY_STOP)
    else:
        (plant.stop_fast if how == "fast" else plant.stop)()
    ticks = last = 0
    while ticks < 50 or ticks - last < 50:  # until it has rested for a while
        plant.tick()
        ticks += 1
        if float(np.abs(plant.snapshot.dq).max()) > REST:
            last = ticks
    return last * 1e-3, allowed
