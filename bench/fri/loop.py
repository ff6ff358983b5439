"""Reply latency of the FRI client and of compiled laws beside a bare UDP echo in C, the user's process idle or busy."""

from __future__ import annotations

import contextlib
import gc
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

from bench.fri.laws import drift
from bench.measure.blocks import BLOCKS, Comparison, Placement, pin, placed, placements
from bench.measure.compiler import compiled
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm import law_from
from heptarm.fri import CompiledLaw, include_dir
from heptarm.fri.loop.client import Client
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import SessionState
from heptarm.fri.protocol.version import Version

#: Over all blocks of a placement; fewer are for a quick check.
CYCLES = int(os.environ.get("BENCH_CYCLES", "25000"))
_SOURCES = Path(__file__).parent
_JOINTS = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
#: Counts as the latency of a missing reply [us].
_NONE = 1000.0
#: How long before a message is due a client polls that does [s].
_POLL = 0.2e-3
#: Largest ratio of a compiled law's median to the echo's.
_LAW_LIMIT = 1.15
_LIMITS = (("", 50.0, 1.15), ("_p99", 99.0, 1.5))


@benchmark("fri_loop")
def fri_loop() -> Iterator[Figure]:
    """Reply latency at 1 kHz, the client's and a C echo's cycle by cycle: user idle, user busy."""
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


@benchmark("fri_laws")
def fri_laws() -> Iterator[Figure]:
    """Reply latency of a law by Numba and one in C, while the user's process computes and collects garbage."""
    with tempfile.TemporaryDirectory() as name, placed():
        folder = Path(name)
        for program in ("echo", "sender"):
            compiled(_SOURCES / f"{program}.c", folder)
        (folder / "datagrams").write_bytes(_datagrams())
        made = folder / "drift.so"
        flags = ("-O2", "-shared", "-fPIC", f"-I{include_dir()}")
        subprocess.run(["cc", *flags, "-o", str(made), str(_SOURCES / "drift.c")], check=True)
        in_c = law_from(made, "step", params=drift.params, memory=drift.memory)
        for label, law in (("numba", drift), ("c", in_c)):
            for found, detail in _compare(folder, CYCLES // BLOCKS, busy=True, law=law):
                yield found.figure(f"fri_law_{label}", 50.0, "us", limit=_LAW_LIMIT, detail=detail)
            for found, detail in _compare(folder, CYCLES // BLOCKS, busy=True, law=law, busy_poll=_POLL):
                yield found.figure(f"fri_law_{label}_polled", 50.0, "us", limit=_LAW_LIMIT, detail=detail)


def _compare(
    folder: Path, cycles: int, *, busy: bool, law: CompiledLaw | None = None, busy_poll: float = 0.0
) -> list[tuple[Comparison, dict[str, Any]]]:
    """Latencies of client and echo under each placement, and facts of the last block.

    A client that polls needs a core of its own, so that it is only measured across two.
    """
    where = [one for one in placements() if one.name == "two_cores" or not busy_poll]
    comparisons = [Comparison(placement, cap=_NONE) for placement in where]
    facts: list[dict[str, Any]] = [{} for _ in comparisons]
    for _ in range(BLOCKS):
        for number, found in enumerate(comparisons):
            with Noise() as noise:
                replies, echoes, facts[number] = _run(
                    folder, cycles, found.placement, busy=busy, law=law, busy_poll=busy_poll
                )
            found.add(np.nan_to_num(replies, nan=_NONE), np.nan_to_num(echoes, nan=_NONE), noise)
    return list(zip(comparisons, facts, strict=True))


def _run(
    folder: Path, cycles: int, placement: Placement, *, busy: bool, law: CompiledLaw | None, busy_poll: float
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
        client = stack.enter_context(Client(0, cpu=near, law=law, busy_poll=busy_poll))
        words = (client.port, port, far, cycles, folder / "datagrams", results)
        sender = subprocess.Popen([str(folder / "sender"), *map(str, words)])
        stack.callback(sender.kill)
        if busy:
            stop = threading.Event()
            work = _be_busy if law is None else _collect_garbage
            user = threading.Thread(target=work, args=(client, stop))
            user.start()
            stack.callback(user.join)
            stack.callback(stop.set)
        if sender.wait(cycles * 1e-3 + 60.0):
            raise RuntimeError("the sender failed")
        stats, refused = client.stats, client.refused
    found = np.fromfile(results).reshape(-1, 2)
    replies, echoes = found[:, 0], found[:, 1]
    detail = {
        "cycles_of_a_block": cycles,
        "unanswered": int(np.isnan(replies).sum()),
        "echo_unanswered": int(np.isnan(echoes).sum()),
        "own_latency_us": [round(value * 1e6, 1) for value in stats.latency],
        "commanded": stats.commanded,
        "calls_of_the_law": client.memory.calls if law is not None else 0,
        "refused": refused,
    }
    return replies, echoes, detail


def _be_busy(client: Client, stop: threading.Event) -> None:
    """Keep a whole processor busy, as a user's process may, and send a command now and then."""
    while not stop.is_set():
        for _ in range(20_000):
            pass
        if client.session is SessionState.COMMANDING_ACTIVE:  # a command counts in a session that was seen
            client.command(q=_JOINTS)


def _collect_garbage(client: Client, stop: threading.Event) -> None:
    """Keep a whole processor busy, collect garbage, change a parameter and read the memory now and then."""
    count = 0
    while not stop.is_set():
        for _ in range(2_000):
            ring: list[object] = [{}]
            ring.append(ring)
        gc.collect()
        count += 1
        client.params.goal = [1e-4 * (count % 2)] * 7
        client.memory.snapshot()


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
