"""`heptarm sim --count`: several virtual cabinets that start and end together."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import heptarm as ha
from tests.cli.running import HEPTARM, refused, run
from tests.interrupts import ctrl_c_interrupts


@contextmanager
def fleet(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`heptarm sim --json --count 2`; ended as by Ctrl-C if it still runs."""
    command = [*HEPTARM, "sim", "--json", "--count", "2", *arguments]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    with process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(timeout=60)


def _line(process: subprocess.Popen[str]) -> dict[str, Any]:
    assert process.stdout is not None
    return dict(json.loads(process.stdout.readline()))


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_both_accept_clients_and_typed_words_name_one_of_them() -> None:
    with fleet("--port", "0") as process:
        ready = [_line(process), _line(process)]
        assert [one["cabinet"] for one in ready] == [1, 2] and ready[0]["port"] != ready[1]["port"]
        assert process.stdin is not None
        process.stdin.write("2 emergency_stop\n3 emergency_stop\nt1\n")
        process.stdin.flush()
        said = [_line(process) for _ in range(4)]
        assert {"operator": "emergency_stop", "error": "", "shown": "", "cabinet": 2} in said
        assert any("there is no cabinet 3" in one["error"] for one in said)
        assert sorted(one["cabinet"] for one in said if one["operator"] == "t1") == [1, 2]
        with (
            ha.connect(ready[0]["target"], control=False, timeout=30.0) as first,
            ha.connect(ready[1]["target"], control=False, timeout=30.0) as second,
        ):
            second.wait_until(lambda s: s.safety.emergency_stop, timeout=30.0)
            first.wait_until(lambda s: s.safety.mode.value == "t1", timeout=30.0)
            assert not first.state.safety.emergency_stop
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
        assert not any(_runs(one["pid"]) for one in ready)


def test_the_end_of_one_ends_the_other() -> None:
    with fleet("--port", "0") as process:
        ready = [_line(process), _line(process)]
        os.kill(ready[0]["pid"], signal.SIGKILL)
        assert process.wait(timeout=60) != 0
        assert not _runs(ready[1]["pid"])


def test_ports_follow_each_other_and_a_port_in_use_ends_both() -> None:
    with socket.socket() as blocker:
        blocker.bind(("127.0.0.1", 0))
        blocker.listen()
        port = blocker.getsockname()[1]
        done = run("sim", "--count", "2", "--port", str(port - 1))
    assert done.returncode != 0 and f"virtual cabinet 2 does not start on 127.0.0.1:{port}" in done.stderr


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--count", "0"), "--count must be in [1, 64], got 0"),
        (("--count", "3", "--port", "65534"), "--count must be in [1, 2], got 3"),
        (("--port", "99999"), "--port must be in [0, 65535], got 99999"),
        (("--view", "--view-port", "-1"), "--view-port must be in [0, 65535], got -1"),
        (("--speed", "-1"), "--speed must be 0 or in [0.01, 1000], got -1"),
        (("extra",), "unexpected: extra (heptarm sim --help)"),
        (("--count", "2", "--view"), "--view cannot be used with --count"),
        (("--count", "2", "--fri", "1.15"), "--count cannot be used with heptarm sim fri"),
    ],
)
def test_refuses(words: tuple[str, ...], text: str) -> None:
    done = refused("sim", *words)
    assert done.returncode != 0 and text in done.stderr
