"""The virtual cabinet keeps its size, whatever it is asked to do."""

from __future__ import annotations

import subprocess
import sys

import pytest

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.trust.soak import soak

pytestmark = pytest.mark.alone


def test_calls_from_java_to_python_leave_nothing_behind() -> None:
    """JPype 1.7 made a type of 1.6 kB for the Java objects of each such call, which nothing could free."""
    weight = ha.Tool("weight", mass=1.0, com=(0.0, 0.0, 0.05))
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=10.0, timeout=60.0) as arm:

        def call() -> None:
            """Sixty calls and more: loads, motions, and their ends."""
            for _ in range(20):
                with arm.tool(weight):
                    arm.move(ha.hold(0.002))

        for _ in range(2):  # classes are loaded
            cabinet.stats()
            call()
        before = cabinet.stats()["memory"]
        call()
        after = cabinet.stats()["memory"]
    assert after["types"] <= before["types"]  # those that nobody uses are freed at any time
    assert after["objects"] - before["objects"] < 50
    assert after["java_threads"] <= before["java_threads"]


#: Eight clients of one process see the same stop twice, after one that has seen one: what the last two cost [MB].
_WITNESSES = """
import gc, os, sys, time
import heptarm as ha
from pathlib import Path

def resident():
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

def seen_by(arms):
    files = [arm.connection.capture("stop") for arm in arms]
    assert all(file is not None and file() is not None for file in files)
    time.sleep(1.0)  # later than this it is another stop

arms = [ha.connect(sys.argv[1], control=False, state_rate=200, timeout=60.0) for _ in range(8)]
for arm in arms:
    while len(arm.connection.kept_samples()) < 100:
        time.sleep(0.02)
    arm.subscribe(rate=1.0)  # what is kept grows no more
seen_by(arms[:1])
before = resident()
for _ in range(2):
    seen_by(arms)
print(resident() - before)
for arm in arms:
    arm.close()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_black_boxes_of_many_clients_share_their_memory() -> None:
    """Each was written by a thread of its own, in an arena of the allocator of its own, which kept what it needed."""
    with Cabinet() as cabinet:
        command = [sys.executable, "-c", _WITNESSES, cabinet.target]
        grown = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120.0).stdout
    assert float(grown) < 6.0  # 2 MB; with a thread for each file it was 13 MB


@pytest.mark.long
def test_a_soak_leaves_nothing_behind_and_loses_nothing() -> None:
    """Three minutes of everything at once. `make soak MINUTES=90` reports the growth exactly."""
    verdict = soak(180.0)
    assert verdict.lost == []
    assert verdict.grown == {}
    assert {"observer", "fri", "fault", "servo", "motions"} <= set(verdict.done)
    # classes are still loaded and heaps still fill in the first minutes; a leak of each call showed 3 MB/min and more
    assert max(verdict.slopes.values()) < 2.0
