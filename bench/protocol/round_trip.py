"""A request through the whole API beside a raw echo of as many bytes between the same two languages."""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import heptarm as ha
from bench.measure.blocks import Comparison, Placement, by_turns, pin
from bench.measure.cabinet import Cabinet
from bench.measure.compiler import compiled
from bench.measure.figure import Figure, benchmark
from bench.protocol.bare_client import BareClient
from heptarm.wire import messages
from heptarm.wire.messages import TAG

#: Requests of a block, back to back; and with a pause of so many seconds before each.
REQUESTS, PAUSED, PAUSE = 4000, 200, 0.005
#: Pre-shared key of the session that has one.
KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"
#: Largest ratio to a raw echo, and with a key.
LIMIT, KEY_LIMIT = 1.5, 1.8
#: Limit of the ratio of the C++ client to the Python API.
CPP_LIMIT = 1.2


@benchmark("round_trip")
def round_trip() -> Iterator[Figure]:
    """Round trip of a request, Python API to application and back, beside a raw echo: back to back, with pauses."""
    with Cabinet() as cabinet, ha.connect(cabinet.target) as arm, _raw_echo() as echo:
        for name, count, pause in (("", REQUESTS, 0.0), ("_paused", PAUSED, PAUSE)):
            for found in _beside_echo(cabinet, lambda: arm.set_override(1.0), echo, count, pause):
                limit = None if pause else LIMIT
                yield found.figure(f"round_trip{name}", 50, "us", limit=limit, scale=1e6)
                yield found.figure(f"round_trip{name}_p99", 99, "us", scale=1e6)


@benchmark("round_trip_bare")
def round_trip_bare() -> Iterator[Figure]:
    """Round trip of a request by the least Python that speaks the protocol, beside a raw echo."""
    with Cabinet() as cabinet, _raw_echo() as echo, closing(BareClient(cabinet.port)) as client:
        for found in _beside_echo(cabinet, lambda: client.set_override(1.0), echo, REQUESTS, 0.0):
            yield found.figure("round_trip_bare", 50, "us", scale=1e6)


class _Echo:
    """A raw echo of as many bytes as a request has.

    Args:
        port: of the echo in Java.
        process: its process.
        more: bytes beyond those of a request without a key.
    """

    def __init__(self, port: int, process: int, more: int) -> None:
        self.process = process
        size = messages.HEADER.size + len(messages.SetOverride(value=1.0).encode()) + more
        self._payload = b"\x5a" * size
        self._socket = socket.create_connection(("127.0.0.1", port))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __call__(self) -> None:
        self._socket.sendall(self._payload)
        missing = len(self._payload)
        while missing:
            missing -= len(self._socket.recv(missing))

    def close(self) -> None:
        self._socket.close()


@contextmanager
def _raw_echo(more: int = 0) -> Iterator[_Echo]:
    with subprocess.Popen(
        ["java", "-Xmx32m", "-XX:+UseSerialGC", str(Path(__file__).parents[1] / "java" / "Echo.java")],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            with closing(_Echo(int(process.stdout.readline()), process.pid, more)) as echo:
                yield echo
        finally:
            process.kill()


def _beside_echo(
    cabinet: Cabinet, request: Callable[[], object], echo: _Echo, count: int, pause: float
) -> Iterator[Comparison]:
    def place(placement: Placement) -> None:
        pin(cabinet.process.pid, placement.far)
        pin(echo.process, placement.far)

    yield from by_turns(lambda: _times(request, count, pause), lambda: _times(echo, count, pause), place)


def _times(call: Callable[[], object], count: int, pause: float) -> list[float]:
    """Duration of each call [s]."""
    times = []
    for _ in range(count):
        if pause:
            time.sleep(pause)
        begin = time.perf_counter_ns()
        call()
        times.append((time.perf_counter_ns() - begin) * 1e-9)
    return times


@benchmark("round_trip_with_key")
def round_trip_with_key() -> Iterator[Figure]:
    """Round trip of a request in a session with a key, beside a raw echo."""
    with (
        Cabinet("--data", f"heptarm.key={KEY}") as cabinet,
        ha.connect(cabinet.target, key=KEY) as arm,
        _raw_echo(TAG) as echo,
    ):
        for found in _beside_echo(cabinet, lambda: arm.set_override(1.0), echo, REQUESTS, 0.0):
            yield found.figure("round_trip_key", 50, "us", limit=KEY_LIMIT, scale=1e6)


@benchmark("round_trip_cpp")
def round_trip_cpp() -> Iterator[Figure]:
    """Round trip of a request by the C++ client, beside the Python API."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Cabinet() as cabinet,
        Cabinet() as other,
        ha.connect(other.target) as arm,
        subprocess.Popen(
            [str(compiled(Path(__file__).with_suffix(".cpp"), Path(folder))), f"127.0.0.1:{cabinet.port}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as program,
    ):
        assert program.stdin is not None and program.stdout is not None
        if program.stdout.readline() != "ready\n":
            raise RuntimeError("the C++ client did not connect")

        def place(placement: Placement) -> None:
            pin(cabinet.process.pid, placement.far)
            pin(other.process.pid, placement.far)
            pin(program.pid, placement.near)

        def from_cpp() -> list[float]:
            assert program.stdin is not None and program.stdout is not None
            program.stdin.write(f"{REQUESTS}\n")
            program.stdin.flush()
            return [int(word) * 1e-9 for word in program.stdout.readline().split()]

        for found in by_turns(from_cpp, lambda: _times(lambda: arm.set_override(1.0), REQUESTS, 0.0), place):
            yield found.figure("round_trip_cpp", 50, "us", limit=CPP_LIMIT, scale=1e6)
            yield found.figure("round_trip_cpp_p99", 99, "us", scale=1e6)
        program.stdin.close()
