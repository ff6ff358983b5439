"""Reply latency of the FRI client beside a bare UDP echo in C, with the user's process idle and busy."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bench.measure.blocks import BLOCKS, Comparison, Placement, pin, placed, placements
from bench.measure.compiler import compiled
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.fri.loop.client import Client
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import SessionState
from heptarm.fri.protocol.version import Version
from heptarm.io.compiled import SWITCH

#: Over all blocks of a placement; fewer are for a quick check.
CYCLES = int(os.environ.get("BENCH_CYCLES", "25000"))
_SOURCES = Path(__file__).parent
_JOINTS = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
#: Counts as the latency of a missing reply [us].
_NONE = 1000.0
_LIMITS = (("", 50.0, 1.35), ("_p99", 99.0, 1.5))


@benchmark("fri_loop")
def fri_loop() -> Iterator[Figure]:
    """Reply latency at 1 kHz, the client's and a C echo's cycle by cycle: user idle, user busy, pure Python."""
    with tempfile.TemporaryDirectory() as name, placed():
        folder = Path(name)
        for program in ("echo", "sender"):
            compiled(_SOURCES / f"{program}.c", folder)
        (folder / "datagrams").write_bytes(_datagrams())
        for label, busy in (("idle", False), ("busy", True)):
            for found, detail in _compare(folder, CYCLES // BLOCKS, busy=busy):
                for what, percentile, limit in _LIMITS:
                    yield found.figure(
                        f"fri_reply_{label}{what}", percentile, "us", limit=limit, detail=detail
                    )
        os.environ[SWITCH] = "1"
        try:
            for found, detail in _compare(folder, CYCLES // BLOCKS // 5, busy=False):
                yield found.figure("fri_reply_python", 50.0, "us", detail=detail)
        finally:
            del os.environ[SWITCH]


def _compare(folder: Path, cycles: int, *, busy: bool) -> list[tuple[Comparison, dict[str, Any]]]:
    """Latencies of client and echo under each placement, and facts of the last block."""
    comparisons = [Comparison(placement, cap=_NONE) for placement in placements()]
    facts: list[dict[str, Any]] = [{} for _ in comparisons]
    for _ in range(BLOCKS):
        for number, found in enumerate(comparisons):
            with Noise() as noise:
                replies, echoes, facts[number] = _run(folder, cycles, found.placement, busy=busy)
            found.add(np.nan_to_num(replies, nan=_NONE), np.nan_to_num(echoes, nan=_NONE), noise)
    return list(zip(comparisons, facts, strict=True))


def _run(
    folder: Path, cycles: int, placement: Placement, *, busy: bool
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Latencies of the client and of the echo [us], NaN where no reply came within half a millisecond."""
    (near,), (far,) = placement.near, placement.far
    pin(os.getpid(), placement.near)
    results = folder / "results"
    with contextlib.ExitStack() as stack:
        port = _free_port()
        echo = subprocess.Popen(
            [str(folder / "echo"), str(port), str(near)], stdout=subprocess.PIPE, text=True
        )
        stack.callback(echo.wait)
        stack.callback(echo.kill)
        assert echo.stdout is not None
        if echo.stdout.readline() != "ready\n":
            raise RuntimeError("the echo did not start")
        client = stack.enter_context(Client(0, cpu=near))
        words = (client.port, port, far, cycles, folder / "datagrams", results)
        sender = subprocess.Popen([str(folder / "sender"), *map(str, words)])
        stack.callback(sender.kill)
        if busy:
            stop = threading.Event()
            user = threading.Thread(target=_be_busy, args=(client, stop))
            user.start()
            stack.callback(user.join)
            stack.callback(stop.set)
        if sender.wait(cycles * 1e-3 + 60.0):
            raise RuntimeError("the sender failed")
        stats, refused, native = client.stats, client.refused, client.is_native
    found = np.fromfile(results).reshape(-1, 2)
    replies, echoes = found[:, 0], found[:, 1]
    detail = {
        "cycles_of_a_block": cycles,
        "native": native,
        "unanswered": int(np.isnan(replies).sum()),
        "echo_unanswered": int(np.isnan(echoes).sum()),
        "own_latency_us": [round(value * 1e6, 1) for value in stats.latency],
        "commanded": stats.commanded,
        "refused": refused,
    }
    return replies, echoes, detail


def _be_busy(client: Client, stop: threading.Event) -> None:
    """Keep a whole processor busy, as a user's process may, and send a command now and then."""
    while not stop.is_set():
        for _ in range(20_000):
            pass
        client.command(q=_JOINTS)


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _datagrams() -> bytes:
    """One message of each state, with counters of five bytes that the sender overwrites."""
    made = b""
    robot = m.RobotInfo(
        7, m.Safety.NORMAL_OPERATION, (m.DriveState.ACTIVE,) * 7, m.OperationMode.AUT, m.ControlMode.POSITION
    )
    monitor = m.MonitorData(
        q=_JOINTS,
        tau=_JOINTS,
        q_cmd=_JOINTS,
        tau_cmd=_JOINTS,
        tau_ext=_JOINTS,
        stamp=m.TimeStamp(1_700_000_000, 123_456_789),
    )
    for state in (
        SessionState.MONITORING_READY,
        SessionState.COMMANDING_WAIT,
        SessionState.COMMANDING_ACTIVE,
    ):
        link = m.ConnectionInfo(state, m.Quality.EXCELLENT, 1, 1)
        ipo = None
        if state >= SessionState.COMMANDING_WAIT:
            ipo = m.IpoData(
                q=_JOINTS, command_mode=m.CommandMode.POSITION, overlay=m.Overlay.JOINT, tracking=1.0
            )
        datagram = codec.encode_monitoring(
            m.Monitoring(m.Header(300_000_000, 300_000_000), robot, monitor, link, ipo), Version.V1_15
        )
        made += struct.pack("=I", len(datagram)) + datagram
    return made
