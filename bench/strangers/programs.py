"""The projects of examples/sunrise: how many compile, start and end as they should, and how long that takes."""

from __future__ import annotations

import math
import socket
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.errors import HeptarmError
from heptarm.sim.runtime.application import compile_application
from tests.strangers.driving import DRIVERS, SUNRISE, free_port, running

#: Requests of one measurement of round trips.
_REQUESTS = 2000
#: Bytes of a request for the joints.
_REQUEST = b"joints\n"


@benchmark("programs_compiled")
def programs_compiled() -> Iterator[Figure]:
    """Fraction of the projects that compile against the doubles, and the time that the slowest takes."""
    times, compiled, disturbed = {}, 0, False
    for name in DRIVERS:
        with Noise() as noise, tempfile.TemporaryDirectory() as out:
            began = time.monotonic()
            try:
                compile_application(SUNRISE / name, Path(out))
                compiled += 1
            except HeptarmError as error:
                print(error)
            times[name] = time.monotonic() - began
        disturbed = disturbed or noise.is_noisy
    detail = {name: round(seconds, 2) for name, seconds in times.items()}
    yield Figure("programs_compiled", compiled / len(DRIVERS), "fraction", limit=1.0, at_least=True)
    yield Figure(
        "programs_compile_time", max(times.values()), "s", limit=10.0, disturbed=disturbed, detail=detail
    )


@benchmark("programs_driven")
def programs_driven() -> Iterator[Figure]:
    """Fraction of the projects that their clients drive to the end, and the time from the command to `run`."""
    ended, started, detail, disturbed = 0, [], {}, False
    for name, drive in DRIVERS.items():
        with Noise() as noise:
            try:
                done = drive()
                good = done.returncode == 0
            except AssertionError as error:
                print(f"{name}: {error}")
                continue
        disturbed = disturbed or noise.is_noisy
        ended += good
        detail[name] = round(done.seconds, 1)
        if not math.isnan(done.ready_after):
            started.append(done.ready_after)
    yield Figure("programs_ended", ended / len(DRIVERS), "fraction", limit=1.0, at_least=True, detail=detail)
    worst = max(started, default=math.nan)
    median = {"median": round(float(np.median(started)), 2)} if started else {}
    yield Figure("programs_start", worst, "s", limit=15.0, disturbed=disturbed, detail=median)


@benchmark("programs_answer")
def programs_answer() -> Iterator[Figure]:
    """Round trip of a line of text to an application's own TCP server, in real time: median and 99th percentile."""
    port = free_port()
    times = []
    with running("token_server", "--app-data", f"port={port}", speed="1") as cabinet:
        cabinet.until("waiting on port")
        with socket.create_connection(("127.0.0.1", port), timeout=30.0) as pc, pc.makefile("rb") as lines:
            pc.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for _ in range(_REQUESTS):
                began = time.perf_counter_ns()
                pc.sendall(_REQUEST)
                lines.readline()
                times.append((time.perf_counter_ns() - began) * 1e-3)
            pc.sendall(b"bye\n")
            lines.readline()
        cabinet.end()
    yield Figure("programs_answer", float(np.median(times)), "us")
    yield Figure("programs_answer_p99", float(np.percentile(times, 99)), "us")
