"""A11: a request through the whole API against a raw echo of the same octets between the same two languages."""

from __future__ import annotations

import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from heptarm.wire import messages

ROUNDS, BLOCK = 40, 100


@benchmark("round_trip", "A11")
def round_trip() -> Iterator[Figure]:
    """Median round trip of a request, Python API to the application and back, against a raw echo."""
    octets = b"\x5a" * (messages.HEADER.size + len(messages.SetOverride(value=1.0).encode()))
    ours: list[int] = []
    floor: list[int] = []
    echo = subprocess.Popen(
        ["java", "-Xmx32m", "-XX:+UseSerialGC", str(Path(__file__).parent / "java" / "Echo.java")],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert echo.stdout is not None
        port = int(echo.stdout.readline())
        with (
            Cabinet() as cabinet,
            ha.connect(cabinet.target) as arm,
            socket.create_connection(("127.0.0.1", port)) as raw,
        ):
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for round_number in range(ROUNDS + 5):
                requests = [_request(arm) for _ in range(BLOCK)]
                echoes = [_echo(raw, octets) for _ in range(BLOCK)]
                if round_number >= 5:  # the first rounds warm up both JVMs
                    ours += requests
                    floor += echoes
    finally:
        echo.kill()
        echo.wait()
    ours_us, floor_us = np.array(ours) / 1e3, np.array(floor) / 1e3
    detail = {
        "p99_us": round(float(np.percentile(ours_us, 99)), 1),
        "echo_p99_us": round(float(np.percentile(floor_us, 99)), 1),
        "requests": len(ours),
    }
    yield Figure(
        "round_trip",
        "A11",
        float(np.median(ours_us)),
        "us",
        reference=float(np.median(floor_us)),
        limit=2.0,
        detail=detail,
    )


def _request(arm: ha.Arm) -> int:
    begin = time.perf_counter_ns()
    arm.set_override(1.0)
    return time.perf_counter_ns() - begin


def _echo(raw: socket.socket, octets: bytes) -> int:
    begin = time.perf_counter_ns()
    raw.sendall(octets)
    left = len(octets)
    while left:
        left -= len(raw.recv(left))
    return time.perf_counter_ns() - begin
