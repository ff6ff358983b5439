"""The controlling client is killed during a motion."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise

TIMES = 20
WATCHDOG = 0.5

_CLIENT = """
import sys, time, heptarm as ha
arm = ha.connect(sys.argv[1])
arm.start(ha.ptp([float(sys.argv[2]), 0.5, 0, -1.2, 0, 0.9, 0.2]), speed=0.2)
print("moving", flush=True)
time.sleep(60)
"""


@benchmark("lost_client")
def lost_client() -> Iterator[Figure]:
    """Time from SIGKILL of the controller in mid-motion to rest, the worst of 20; then a new client takes control."""
    random = np.random.default_rng(2)
    times = []
    taken = 0
    with (
        Noise() as noise,
        Cabinet() as cabinet,
        ha.connect(cabinet.target, control=False, state_rate=500) as observer,
    ):
        for index in range(TIMES):
            goal = 1.2 if index % 2 else -1.2
            client = subprocess.Popen(
                [sys.executable, "-c", _CLIENT, cabinet.target, str(goal)],
                stdout=subprocess.PIPE,
                text=True,
            )
            assert client.stdout is not None
            client.stdout.readline()
            observer.wait_until(lambda s: float(np.abs(s.dq).max()) > 0.1, timeout=10)
            time.sleep(random.uniform(0.0, 0.5))
            killed = time.monotonic()
            os.kill(client.pid, signal.SIGKILL)
            client.wait()
            observer.wait_until(
                lambda s: s.motion is not None and not s.motion.active and float(np.abs(s.dq).max()) < 5e-3,
                timeout=10,
            )
            times.append(time.monotonic() - killed)
            with ha.connect(cabinet.target) as arm:
                arm.move(ha.lin_rel(z=0.01 if index % 2 else -0.01, frame="base"))
                taken += 1
    detail = {"times": TIMES, "median": round(float(np.median(times)), 3)}
    yield Figure(
        "lost_client_rest",
        max(times),
        "s",
        limit=0.5 + WATCHDOG,
        disturbed=noise.is_noisy,
        detail=detail,
    )
    yield Figure("lost_client_retaken", taken, "count", limit=TIMES, at_least=True)
