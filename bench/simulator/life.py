"""Start-up, memory, and processes left behind."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise

_OWNER = """
import sys, time, heptarm as ha
arm = ha.connect("sim://iiwa14")
arm.start(ha.ptp([1.0, 0.5, 0, -1.2, 0, 0.9, 0.2]), speed=0.1)
print("moving", flush=True)
time.sleep(60)
"""


@benchmark("start_up")
def start_up() -> Iterator[Figure]:
    """Time from the command until a virtual cabinet accepts clients, the worst of 5; and its memory."""
    times, memory, noisy = [], [], False
    for _ in range(5):
        with Noise() as noise, Cabinet() as cabinet:
            times.append(cabinet.ready_after)
            with ha.connect(cabinet.target, state_rate=1000) as arm:
                arm.move([ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), ha.lin_rel(z=-0.1, frame="base")])
            memory.append(cabinet.memory())
        noisy = noisy or noise.is_noisy
    median = round(float(np.median(times)), 2)
    yield Figure("start_up", max(times), "s", limit=4.0, disturbed=noisy, detail={"median": median})
    yield Figure("memory", max(memory), "MB", limit=350)


@benchmark("leftovers")
def leftovers() -> Iterator[Figure]:
    """Processes left after a virtual cabinet was ended, killed, or lost its owner by SIGKILL; 3 of each."""
    left = 0
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL) * 3:
        with Cabinet() as cabinet:
            group = cabinet.process.pid
            cabinet.end(number)
            left += len(_children_of(group))
    for _ in range(3):
        owner = subprocess.Popen([sys.executable, "-c", _OWNER], stdout=subprocess.PIPE, text=True)
        assert owner.stdout is not None
        owner.stdout.readline()
        cabinets = _children_of(owner.pid)
        owner.kill()
        owner.wait()
        left += sum(not _gone(pid) for pid in cabinets) + (not cabinets)
    yield Figure("leftovers", left, "count", limit=0)


def _children_of(pid: int) -> list[int]:
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(entry.parent.name))
    return found


def _gone(pid: int, patience: float = 3.0) -> bool:
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False
