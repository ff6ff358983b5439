"""What a virtual cabinet costs while its robot rests, and how fast it is awake again."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise

#: Time over which processor time is counted, and time before it to come to rest [s].
SECONDS, SETTLING = 10.0, 3.0
#: Motions that are started from rest, and as many while the plant is awake.
STARTS = 15
_AWAY = ha.deg(0, 0, 0, 2, 0, 0, 0)


def processor_time(process: int) -> float:
    """Processor time of all threads of a process so far [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))


def _usage(cabinet: Cabinet) -> float:
    """Processors that a cabinet uses."""
    begin, used = time.monotonic(), processor_time(cabinet.process.pid)
    time.sleep(SECONDS)
    return (processor_time(cabinet.process.pid) - used) / (time.monotonic() - begin)


@benchmark("idle")
def idle() -> Iterator[Figure]:
    """Processor time of a cabinet at rest: without a client, with one observer; and during a motion."""
    with Cabinet(real_time="fri") as cabinet:
        with Noise() as noise:
            time.sleep(SETTLING)
            yield Figure("idle_alone", _usage(cabinet), "fraction", limit=0.02)
            with ha.connect(cabinet.target, control=False, state_rate=100):
                time.sleep(SETTLING)
                observed = _usage(cabinet)
            with ha.connect(cabinet.target, state_rate=100) as arm:
                arm.start([ha.ptp(_AWAY * 20, speed=0.1), ha.ptp(-_AWAY * 20, speed=0.1)] * 10)
                time.sleep(1.0)
                moving = _usage(cabinet)
                arm.stop()
        stats = cabinet.stats()
    detail = {"others": round(noise.others, 2), "rested": stats["rested"], "ticks": stats["ticks"]}
    yield Figure("idle_observed", observed, "fraction", limit=0.06, detail=detail)
    yield Figure("idle_moving", moving, "fraction")


@benchmark("start_from_rest")
def start_from_rest() -> Iterator[Figure]:
    """Time from a request until the motion has begun: of an arm that rests, and of one that has just moved."""
    with Cabinet(real_time="fri") as cabinet, ha.connect(cabinet.target) as arm, Noise() as noise:
        here = arm.state.q

        def start(number: int) -> float:
            begin = time.perf_counter()
            handle = arm.start(ha.ptp(here + (number % 2) * _AWAY))
            handle.wait_started(10.0)
            delay = time.perf_counter() - begin
            handle.wait()
            return delay

        start(1)
        rested, awake = [], []
        for number in range(STARTS):
            time.sleep(1.2)
            rested.append(start(2 * number))
            awake.append(start(2 * number + 1))
    late = 1e3 * float(np.median(rested) - np.median(awake))
    detail = {
        "rested_ms": [round(1e3 * one, 2) for one in rested],
        "awake_ms": [round(1e3 * one, 2) for one in awake],
    }
    yield Figure("start_from_rest", late, "ms", limit=3.0, disturbed=noise.is_noisy, detail=detail)
