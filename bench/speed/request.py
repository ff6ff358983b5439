"""Where the time of a request goes, from the call in Python to its return."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, pin, placed, placements
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.io.tcp import TcpTransport
from heptarm.wire import messages

#: Requests of a block.
REQUESTS = 2000
_ECHO = Path(__file__).parents[1] / "java" / "Echo.java"
#: Parts of a request, and what happens in each.
PARTS = {
    "request_encode": "Python: check the arguments, build the frame",
    "request_send": "Python: `send`, until the kernel returns",
    "request_path": "kernel, and waking the threads that sleep: as for a raw echo",
    "request_java": "Java: read and decode, check the role, act, encode the answer",
    "request_decode": "Python: decode the answer, return",
}


class _Marks:
    """Times at which a request passes the socket [ns]."""

    def __init__(self) -> None:
        self.sending = self.sent = self.received = 0


def _watched(arm: ha.Arm, marks: _Marks, count: int) -> np.ndarray:
    """Duration of the parts of requests, shape (count, 4) [us]: encode, send, wait, decode."""
    send, receive, clock = TcpTransport.send, TcpTransport.receive_into, time.perf_counter_ns

    def timed_send(self: TcpTransport, data: bytes) -> None:
        marks.sending = clock()
        send(self, data)
        marks.sent = clock()

    def timed_receive(self: TcpTransport, buffer: memoryview, *, wait: bool = True) -> int:
        size = receive(self, buffer, wait=wait)
        if size:
            marks.received = clock()
        return size

    rows = []
    with (
        mock.patch.object(TcpTransport, "send", timed_send),
        mock.patch.object(TcpTransport, "receive_into", timed_receive),
    ):
        for _ in range(count):
            begin = clock()
            arm.set_override(1.0)
            end = clock()
            rows.append(
                (
                    marks.sending - begin,
                    marks.sent - marks.sending,
                    marks.received - marks.sent,
                    end - marks.received,
                )
            )
    return np.array(rows) * 1e-3


def _echoed(raw: socket.socket, payload: bytes, count: int) -> np.ndarray:
    """Duration of the wait for each echo, without the `send` [us]."""
    waits = []
    for _ in range(count):
        raw.sendall(payload)
        sent, missing = time.perf_counter_ns(), len(payload)
        while missing:
            missing -= len(raw.recv(missing))
        waits.append(time.perf_counter_ns() - sent)
    return np.array(waits) * 1e-3


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
                _watched(arm, _Marks(), REQUESTS)  # warm caches, and the compiler of Java
                _echoed(raw, payload, REQUESTS)
                for _ in range(BLOCKS):
                    rows, waits = _watched(arm, _Marks(), REQUESTS), _echoed(raw, payload, REQUESTS)
                    path = np.percentile(waits, (FASTEST, MEDIAN))
                    encode, send, wait, decode = np.percentile(rows, (FASTEST, MEDIAN), axis=0).T
                    for name, values in zip(PARTS, (encode, send, path, wait - path, decode), strict=True):
                        found[name].append(tuple(values.tolist()))
                    whole = np.percentile(rows.sum(axis=1), (FASTEST, MEDIAN))
                    found["request_whole"].append(tuple(whole.tolist()))
        finally:
            echo.kill()
    return found, noise


@benchmark("request_parts")
def request_parts() -> Iterator[Figure]:
    """Where the time of a request goes: encoding, sending, the kernel, Java, decoding."""
    found, noise = parts()
    for name, values in found.items():
        fastest, median = np.median(values, axis=0).tolist()
        detail = {"fastest_tenth": round(fastest, 2)}
        yield Figure(name, median, "us", disturbed=noise.is_noisy, detail=detail)
