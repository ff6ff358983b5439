"""Real-time priority of a virtual cabinet: of its loop, and of the threads that serve the clients."""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path

import pytest

import heptarm as ha
from bench.measure.cabinet import Cabinet
from heptarm.sim.runtime.cabinet import REAL_TIME_THREADS

pytestmark = pytest.mark.skipif(not hasattr(os, "SCHED_FIFO"), reason="asks Linux")

#: Longest time of this machine for a change of priorities [s].
PATIENCE = 20.0


def policies(cabinet: Cabinet) -> set[int]:
    """Of the threads that serve clients."""
    found = set()
    for task in Path(f"/proc/{cabinet.process.pid}/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended
            if (task / "comm").read_text().startswith(tuple(REAL_TIME_THREADS)):
                found.add(os.sched_getscheduler(int(task.name)))
    return found


def become(cabinet: Cabinet, wanted: set[int]) -> bool:
    """Whether all of them get this policy."""
    deadline = time.monotonic() + PATIENCE
    while policies(cabinet) != wanted and time.monotonic() < deadline:
        time.sleep(0.05)
    return policies(cabinet) == wanted


def test_threads_that_serve_clients_have_it_while_the_loop_has_it() -> None:
    with Cabinet(real_time="fri") as cabinet, ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        assert become(cabinet, {os.SCHED_BATCH})
        with arm.fri("monitor"):
            served = become(cabinet, {os.SCHED_FIFO})
            if any("priority refused" in one for one in cabinet.stats()["refused"]):
                pytest.skip("this system refuses it")
            assert served
        assert become(cabinet, {os.SCHED_BATCH})


def test_a_cabinet_that_must_not_ask_for_it_has_none() -> None:
    with Cabinet(real_time="off") as cabinet, ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        arm.wait_until(lambda state: state.stamp > 500_000_000, timeout=PATIENCE)
        assert policies(cabinet) == {os.SCHED_BATCH}
