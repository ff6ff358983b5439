"""Where the time of a request goes, from the call in Python to its return."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, pin, placed, placements
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.wire import messages

#: Requests of a block.
REQUESTS = 2000
_ECHO = Path(__file__).parents[1] / "java" / "Echo.java"
#: Parts of a request, and what happens in each.
PARTS = {
    "request_encode": "Python: check the value, make and encode the message",
    "request_path": "kernel: both directions, and waking the threads that sleep; as for a raw echo",
    "request_java": "C: build and check the frames; Java: decode, check the role, act, answer",
    "request_decode": "Python: take the answer, note it in the journal, return",
}


def _watched(arm: ha.Arm, count: int) -> np.ndarray:
    """Duration of the parts of requests, shape (count, 3) [us]: Python before the call of C, the call, Python after."""
    link, clock = arm.connection.link, time.perf_counter_ns
    exchange, began, ended = link._exchange, 0, 0
    assert exchange is not None, "this table needs a connection over TCP"

    def timed(*request: Any) -> Any:
        nonlocal began, ended
        began = clock()
        answer = exchange(*request)
        ended = clock()
        return answer

    rows = []
    with mock.patch.object(link, "_exchange", timed):
        for _ in range(count):
            begin = clock()
            arm.set_override(1.0)
            rows.append((began - begin, ended - began, clock() - ended))
    return np.array(rows) * 1e-3


def _echoed(raw: socket.socket, payload: bytes, count: int) -> np.ndarray:
    """Duration of each echo [us]."""
    times = []
    for _ in range(count):
        begin, missing = time.perf_counter_ns(), len(payload)
        raw.sendall(payload)
        while missing:
            missing -= len(raw.recv(missing))
        times.append(time.perf_counter_ns() - begin)
    return np.array(times) * 1e-3


#: Percentiles of a part's durations: a busy machine changes the first one little.
FASTEST, MEDIAN = 10.0, 50.0


def parts() -> tuple[dict[str, list[tuple[float, float]]], Noise]:
    """Percentiles `FASTEST` and `MEDIAN` of the parts of a request, block by block [us], and how busy others were.

    Both sides are on a processor each if there are two.
    """
    payload = b"\x5a" * (messages.HEADER.size + len(messages.SetOverride(value=1.0).encode()))
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in (*PARTS, "request_whole")}
    placement = placements()[-1]
    with subprocess.Popen(
        ["java", "-Xmx32m", "-XX:+UseSerialGC", str(_ECHO)], stdout=subprocess.PIPE, text=True
    ) as echo:
        try:
            assert echo.stdout is not None
            port = int(echo.stdout.readline())
            with (
                Cabinet() as cabinet,
                ha.connect(cabinet.target, state_rate=0) as arm,
                socket.create_connection(("127.0.0.1", port)) as raw,
                placed(),
                Noise() as noise,
            ):
                raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                pin(os.getpid(), placement.near)
                pin(cabinet.process.pid, placement.far)
                pin(echo.pid, placement.far)
                _watched(arm, REQUESTS)  # warm caches, and the compiler of Java
                _echoed(raw, payload, REQUESTS)
                for _ in range(BLOCKS):
                    rows, echoes = _watched(arm, REQUESTS), _echoed(raw, payload, REQUESTS)
                    path = np.percentile(echoes, (FASTEST, MEDIAN))
                    encode, call, decode = np.percentile(rows, (FASTEST, MEDIAN), axis=0).T
                    for name, values in zip(PARTS, (encode, path, call - path, decode), strict=True):
                        found[name].append(tuple(values.tolist()))
                    whole = np.percentile(rows.sum(axis=1), (FASTEST, MEDIAN))
                    found["request_whole"].append(tuple(whole.tolist()))
        finally:
            echo.kill()
    return found, noise


@benchmark("request_parts")
def request_parts() -> Iterator[Figure]:
    """Where the time of a request goes: encoding, the kernel, C and Java, decoding."""
    found, noise = parts()
    for name, values in found.items():
        fastest, median = np.median(values, axis=0).tolist()
        detail = {"fastest_tenth": round(fastest, 2)}
        yield Figure(name, median, "us", disturbed=noise.is_noisy, detail=detail)
