"""How much faster than real time the simulator runs when nothing paces it."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.planning.motion import TICK
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.sim.runtime.realtime_loop import AT_ONCE
from tests.sim import motions

#: Joint positions between which the arm moves [rad]; a motion takes 1.5 s.
HERE, THERE = ha.deg(-50, 30, -20, -75, 10, 52, -60), ha.deg(50, 45, 20, -40, -30, 20, 60)
#: Motions of a block, of the whole stack and of the plant alone.
MOTIONS, ALONE = 60, 40
#: Limits of simulated time per time.
STACK_LIMIT, PLANT_LIMIT = 60.0, 60.0


@benchmark("unpaced")
def unpaced() -> Iterator[Figure]:
    """Simulated time per time during motions, without pacing: through client, cabinet and plant; the plant alone."""
    plant = Plant("iiwa14", q=tuple(HERE.tolist()))
    with Noise() as alone_noise, _without_collections():
        alone = [_plant(plant) for _ in range(BLOCKS + 1)][1:]
    with Cabinet("--speed", "0") as cabinet, ha.connect(cabinet.target, watchdog=10.0, state_rate=10) as arm:
        _whole(arm)
        with Noise(measured=(cabinet.process.pid,)) as stack_noise:
            stack = [_whole(arm) for _ in range(BLOCKS)]
    noisy = alone_noise.is_noisy or stack_noise.is_noisy
    for name, found, limit in (("unpaced_stack", stack, STACK_LIMIT), ("unpaced_plant", alone, PLANT_LIMIT)):
        detail = {"blocks": np.round(found, 1).tolist()}
        yield Figure(
            name, float(np.median(found)), "x", limit=limit, at_least=True, disturbed=noisy, detail=detail
        )


@contextmanager
def _without_collections() -> Iterator[None]:
    """The simulator's own loop collects no garbage during its ticks either."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _whole(arm: ha.Arm) -> float:
    """Simulated time per time of motions that the client orders."""
    first, begin = arm.state.stamp, time.perf_counter()
    arm.move([ha.ptp(THERE), ha.ptp(HERE)] * (MOTIONS // 2), speed=1.0, timeout=600.0)
    last, end = arm.state.stamp, time.perf_counter()
    return (last - first) * 1e-9 / (end - begin)


def _plant(plant: Plant) -> float:
    """Simulated time per time of the plant's ticks, so many at once as in a cabinet."""
    ticks, begin = 0, time.perf_counter()
    here, there = HERE.tolist(), THERE.tolist()
    for number in range(ALONE):
        plant.submit(MotionCommand(number + 1, motions.ptp(here if number % 2 else there)))
        while not plant.idle:
            ticks += plant.tick(AT_ONCE)
    return ticks * TICK / (time.perf_counter() - begin)
