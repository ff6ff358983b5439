"""B17: a servo stream at 200 Hz through the whole stack, and a bare send as rarely."""

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
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from heptarm.wire import messages

#: A shorter run for a first look; the promise is for 60 s.
SECONDS = float(os.environ.get("BENCH_SECONDS", "60"))
RATE = 200.0
SWING = np.array([0, 0, 0, 0, 0, 0.15, 0.3])
READER = """
import socket
with socket.create_server(("127.0.0.1", 0)) as server:
    print(server.getsockname()[1], flush=True)
    peer = server.accept()[0]
while peer.recv(4096):
    pass
"""


@benchmark("servo", "B17")
def servo() -> Iterator[Figure]:
    """200 Hz for 60 s: cost of set, age of targets when applied, gaps, lag on the path."""
    lags: list[float] = []
    costs: list[int] = []
    with Cabinet() as cabinet, reader() as raw, ha.connect(cabinet.target) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
        floor = bare(arm, raw, SECONDS / 6)
        with arm.servo("joint", rate=RATE, speed=1.0, acceleration=1.0, watchdog=0.1) as sv:
            while sv.tick() and sv.t < SECONDS:
                goal = sv.start.q + SWING * np.sin(sv.t)
                begin = time.perf_counter_ns()
                sv.set(goal)
                costs.append(time.perf_counter_ns() - begin)
                lags.append(np.abs(arm.state.q - goal).max())
        stats = sv.stats
        floor += bare(arm, raw, SECONDS / 6)
    detail = {
        "seconds": SECONDS,
        "sent": stats.sent,
        "rate_hz": round(stats.rate, 2),
        "late_ticks": stats.late_ticks,
        "received": stats.received,
        "applied": stats.applied,
    }
    set_median, set_p99 = np.percentile(costs, [50, 99]) / 1e3
    floor_median, floor_p99 = np.percentile(floor, [50, 99]) / 1e3
    beside = {"p99_us": round(float(floor_p99), 1), "set_over_floor": round(float(set_median / floor_median), 2)}
    yield Figure("servo_set_median", "B17", float(set_median), "us", limit=40.0, detail=detail)
    yield Figure("servo_set_floor", "B17", float(floor_median), "us", detail=beside)
    yield Figure("servo_set_p99", "B17", float(set_p99), "us")
    yield Figure("servo_age_median", "B17", stats.age_median * 1e3, "ms", limit=3.0)
    yield Figure("servo_age_p99", "B17", stats.age_p99 * 1e3, "ms")
    yield Figure("servo_watchdog_trips", "B17", float(stats.late), "count", limit=0.0)
    yield Figure(
        "servo_lag", "B17", float(np.mean(lags)) * 1e3, "mrad", detail={"max": round(max(lags) * 1e3, 2)}
    )


def bare(arm: ha.Arm, raw: socket.socket, seconds: float) -> list[int]:
    """What sending as many octets costs where nothing else is done [ns]: as rarely, in the same loop."""
    octets = bytes(messages.HEADER.size + messages.ServoJoints.LAYOUT.size)
    start = arm.state.q
    costs = []
    due = began = time.perf_counter()
    while due - began < seconds:
        due += 1.0 / RATE
        time.sleep(max(0.0, due - time.perf_counter()))
        goal = start + SWING * np.sin(due - began)
        begin = time.perf_counter_ns()
        raw.sendall(octets)
        costs.append(time.perf_counter_ns() - begin)
        np.abs(arm.state.q - goal).max()
    return costs


@contextlib.contextmanager
def reader() -> Iterator[socket.socket]:
    """A connection to a process that does nothing but read."""
    with subprocess.Popen([sys.executable, "-c", READER], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        with socket.create_connection(("127.0.0.1", int(process.stdout.readline()))) as raw:
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            yield raw
