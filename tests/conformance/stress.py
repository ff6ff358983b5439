"""Much at once: preemptions, malformed goals in flight; what a node may use of memory and threads meanwhile."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Protocol

import numpy as np

from heptarm.ros.interface.action import MAX_GOALS
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal
from tests.conformance.case import REST, TOUCH, goal, last, point, rests, step, succeeds, swing
from tests.conformance.client import Client, SentGoal
from tests.conformance.refusals import REFUSALS
from tests.long import LONG

#: Malformed goals that are sent before those that count, so that every code path has its memory.
WARM_UP = 60
#: Largest growth of the memory by malformed goals [bytes], and per goal: less than one goal takes in Python.
GROWTH, GROWTH_EACH = 12e6, 500.0
#: Threads that a node may have more than before: executors make theirs when they need them, and keep them.
THREADS = MAX_GOALS + 8


class StressedClient(Client, Protocol):
    """A client that sends several goals at once."""

    def send_all(self, goals: list[TrajectoryGoal]) -> list[SentGoal]:
        """Send goals without waiting between them; wait until each is accepted or rejected."""
        ...


def status(pid: int, name: str) -> int:
    """An entry of the status of a process: "VmRSS" [kB], "Threads"."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(f"{name}:")).split()[1])


def preempted_often(client: Client, *, count: int = 50, seconds: float = 2.5) -> None:
    """Each goal takes the place of the one before: every end has a name, and only the last one succeeds."""
    here = rests(client)
    path = swing(client)
    sent = []
    for k in range(count):
        time = 1.0 if k == count - 1 else 30.0
        there = here + path * (0.5 if k == count - 1 else (-1) ** k)
        sent.append(client.send(goal(client, point(time, there, dq=REST))))
        assert sent[-1].accepted
        client.sleep(seconds / count)
    ends = [client.result(one) for one in sent]
    for ended in ends[:-1]:
        assert ended.outcome in client.preempted and ended.code is ErrorCode.INVALID_GOAL, ended
        assert ended.text
    assert ends[-1].outcome is GoalOutcome.SUCCEEDED, ends[-1]
    assert np.abs(client.place().q - here - path / 2).max() < TOUCH


def preempted_without_growth(client: Client, pid: int, *, count: int, seconds: float) -> None:
    """Preemptions leave no threads behind, and with LONG=1 no memory."""
    threads = status(pid, "Threads")
    if LONG:
        preempted_often(client)  # every code path has its memory then
    before = status(pid, "VmRSS")
    preempted_often(client, count=count, seconds=seconds)
    assert status(pid, "Threads") <= threads + THREADS
    grown = 1024 * (status(pid, "VmRSS") - before)
    assert not LONG or grown < GROWTH + GROWTH_EACH * count, f"the memory has grown by {grown / 1e6:.1f} MB"


def refused_in_flight(client: StressedClient, pid: int, *, count: int, at_once: int = 20) -> None:
    """Malformed goals of all kinds, many at once: each is rejected, and the memory of the node stays as it is."""
    wanted = step(client)
    names = itertools.cycle(name for name in REFUSALS if name != "several_degrees_of_freedom")

    def send(number: int) -> None:
        for _ in range(0, number, at_once):
            batch = [REFUSALS[next(names)].change(client, wanted) for _ in range(at_once)]
            assert not any(one.accepted for one in client.send_all(batch))

    send(WARM_UP)
    before, threads = status(pid, "VmRSS"), status(pid, "Threads")
    send(count)
    grown = 1024 * (status(pid, "VmRSS") - before)
    assert grown < GROWTH + GROWTH_EACH * count, f"the memory has grown by {grown / 1e6:.1f} MB"
    assert status(pid, "Threads") <= threads + THREADS
    valid = step(client)
    succeeds(client, valid)
    assert np.abs(client.place().q - last(valid, client)).max() < TOUCH
