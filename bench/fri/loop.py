"""C9: how long the FRI client takes to answer, beside a bare UDP echo in C, with the user's process idle and busy."""

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

from bench.compiler import compiled
from bench.registry import Figure, benchmark
from heptarm.fri import codec
from heptarm.fri import messages as m
from heptarm.fri.messages import SessionState
from heptarm.fri.version import Version
from heptarm.rt import Client
from heptarm.rt.native import SWITCH

#: Of each run; the promise is for 50,000, fewer are for a first look.
CYCLES = int(os.environ.get("BENCH_CYCLES", "50000"))
_SOURCES = Path(__file__).with_name("fri")
_JOINTS = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
#: Counts as the latency of a reply that did not come [us].
_NONE = 1000.0
_LIMITS = (("median", 50.0, 1.35), ("p99", 99.0, 1.5))


@benchmark("fri_loop", "C9")
def fri_loop() -> Iterator[Figure]:
    """Reply latency at 1 kHz, the client's and a C echo's by turns in one run: user idle, user busy, pure Python."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for program in ("echo", "sender"):
            compiled(_SOURCES / f"{program}.c", folder)
        (folder / "datagrams").write_bytes(_datagrams())
        for label, busy in (("idle", False), ("busy", True)):
            ours, floor, detail = _run(folder, CYCLES, busy=busy)
            for what, share, limit in _LIMITS:
                yield Figure(
                    f"fri_reply_{label}_{what}",
                    "C9",
                    _percentile(ours, share),
                    "us",
                    limit=limit,
                    reference=_reference(floor, share),
                    detail=detail,
                )
        os.environ[SWITCH] = "1"
        try:
            ours, floor, detail = _run(folder, max(1, CYCLES // 10), busy=False)
        finally:
            del os.environ[SWITCH]
        yield Figure(
            "fri_reply_python_median",
            "C9",
            _percentile(ours, 50.0),
            "us",
            reference=_percentile(floor, 50.0),
            detail=detail,
        )


def _run(folder: Path, cycles: int, *, busy: bool) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Latencies of the client and of the echo [us], NaN where no reply came within half a millisecond."""
    processors = os.sched_getaffinity(0)
    first, last = min(processors), max(processors)
    results = folder / "results"
    with contextlib.ExitStack() as stack:
        port = _free_port()
        echo = subprocess.Popen(
            [str(folder / "echo"), str(port), str(first)], stdout=subprocess.PIPE, text=True
        )
        stack.callback(echo.wait)
        stack.callback(echo.kill)
        assert echo.stdout is not None
        if echo.stdout.readline() != "ready\n":
            raise RuntimeError("the echo did not start")
        client = stack.enter_context(Client(0, cpu=first))
        words = (client.port, port, last, cycles, folder / "datagrams", results)
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
    ours, floor = found[:, 0], found[:, 1]
    detail = {
        "cycles": cycles,
        "native": native,
        "unanswered": int(np.isnan(ours).sum()),
        "echo_unanswered": int(np.isnan(floor).sum()),
        "p99.9_us": [round(_percentile(side, 99.9), 1) for side in (ours, floor)],
        "own_latency_us": [round(value * 1e6, 1) for value in stats.latency],
        "commanded": stats.commanded,
        "refused": refused,
    }
    return ours, floor, detail


def _percentile(values: np.ndarray, share: float) -> float:
    """A reply that did not come counts as the longest."""
    return float(np.percentile(np.nan_to_num(values, nan=_NONE), share))


def _reference(values: np.ndarray, share: float) -> float | None:
    """None where not even the echo answered so many in time: on such a machine nothing is shown, and nothing is ok."""
    found = _percentile(values, share)
    return found if found < _NONE else None


def _be_busy(client: Client, stop: threading.Event) -> None:
    """The user's process: takes a whole processor and gives a command now and then."""
    while not stop.is_set():
        for _ in range(20_000):
            pass
        client.command(q=_JOINTS)


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _datagrams() -> bytes:
    """One message of each state, with counters of five octets that the sender overwrites."""
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
        octets = codec.encode_monitoring(
            m.Monitoring(m.Header(300_000_000, 300_000_000), robot, monitor, link, ipo), Version.V1_15
        )
        made += struct.pack("=I", len(octets)) + octets
    return made
