"""A servo stream at 200 Hz through the whole stack, beside a bare send of as many bytes as rarely."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, Placement, by_turns, pin
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.wire import messages

#: Of servo motions over all blocks of both placements; fewer are for a quick check.
SECONDS = float(os.environ.get("BENCH_SECONDS", "60"))
RATE = 200.0
AMPLITUDE = np.array([0, 0, 0, 0, 0, 0.15, 0.3])
READER = """
import socket
with socket.create_server(("127.0.0.1", 0)) as server:
    print(server.getsockname()[1], flush=True)
    peer = server.accept()[0]
while peer.recv(4096):
    pass
"""


class Stream:
    """Servo motions, block by block, and what the cabinet counted of them."""

    def __init__(self, arm: ha.Arm, seconds: float) -> None:
        self._arm, self._seconds = arm, seconds
        self.lags: list[float] = []
        self.ages: list[tuple[float, float]] = []
        self.trips = self.late_ticks = self.sent = self.received = self.applied = 0

    def block(self) -> list[float]:
        """Duration of each `set` of a motion [us]."""
        arm, costs = self._arm, []
        sv = arm.servo("joint", rate=RATE, speed=1.0, acceleration=1.0, watchdog=0.1)
        try:
            with sv:
                while sv.tick() and sv.t < self._seconds:
                    goal = sv.start.q + AMPLITUDE * np.sin(sv.t)
                    begin = time.perf_counter_ns()
                    sv.set(goal)
                    costs.append((time.perf_counter_ns() - begin) / 1e3)
                    self.lags.append(float(np.abs(arm.state.q - goal).max()))
        except ha.Starved:  # what was measured until then counts
            self.trips += 1
        stats = sv.stats
        self.ages.append((stats.age_median, stats.age_p99))
        self.late_ticks += stats.late_ticks
        self.sent += stats.sent
        self.received += stats.received
        self.applied += stats.applied
        return costs


@benchmark("servo")
def servo() -> Iterator[Figure]:
    """A servo at 200 Hz: cost of `set` beside a bare send, watchdog trips, age of targets when applied, lag."""
    seconds = SECONDS / BLOCKS / 2
    with Cabinet() as cabinet, reader() as (process, raw), ha.connect(cabinet.target) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
        stream = Stream(arm, seconds)

        def place(placement: Placement) -> None:
            pin(cabinet.process.pid, placement.far)
            pin(process, placement.far)

        found = by_turns(stream.block, lambda: bare(arm, raw, seconds), place)
    noisy = any(one.is_noisy for comparison in found for one in comparison.noise)
    for comparison in found:
        yield comparison.figure("servo_set", 50, "us", limit=2.0)
        yield comparison.figure("servo_set_p99", 99, "us")
    counts = {
        "sent": stream.sent,
        "received": stream.received,
        "applied": stream.applied,
        "late_ticks": stream.late_ticks,
    }
    yield Figure("servo_watchdog_trips", stream.trips, "count", limit=0, disturbed=noisy, detail=counts)
    age_median, age_p99 = np.nanmedian(stream.ages, axis=0) * 1e3
    yield Figure(
        "servo_age", float(age_median), "ms", limit=3.0, disturbed=noisy, detail={"p99": float(age_p99)}
    )
    lags = np.array(stream.lags) * 1e3
    yield Figure("servo_lag", float(lags.mean()), "mrad", detail={"max": round(float(lags.max()), 2)})


def bare(arm: ha.Arm, raw: socket.socket, seconds: float) -> list[float]:
    """Duration of a bare send of as many bytes, at the same rate in the same loop [us]."""
    payload = bytes(messages.HEADER.size + messages.ServoJoints.LAYOUT.size)
    start = arm.state.q
    costs = []
    due = began = time.perf_counter()
    while due - began < seconds:
        due += 1.0 / RATE
        time.sleep(max(0.0, due - time.perf_counter()))
        goal = start + AMPLITUDE * np.sin(due - began)
        begin = time.perf_counter_ns()
        raw.sendall(payload)
        costs.append((time.perf_counter_ns() - begin) / 1e3)
        np.abs(arm.state.q - goal).max()
    return costs


@contextlib.contextmanager
def reader() -> Iterator[tuple[int, socket.socket]]:
    """The id of a process that only reads, and a connection to it."""
    with subprocess.Popen([sys.executable, "-c", READER], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        with socket.create_connection(("127.0.0.1", int(process.stdout.readline()))) as raw:
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            yield process.pid, raw
