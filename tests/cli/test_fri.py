"""The commands for FRI, as a user types them, on ports that are free."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from heptarm.rt import Client
from tests.cli.running import HEPTARM, run


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def controller(port: int, *arguments: str, version: str = "1.15") -> Iterator[tuple[Any, list[Any]]]:
    """`heptarm sim --fri`; what it prints, at last also how it ended."""
    command = [*HEPTARM, "sim", "--json", "--fri", version, "--fri-client", f"127.0.0.1:{port}"]
    told: list[Any] = []
    with subprocess.Popen(
        [*command, "--fri-port", "0", *arguments], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield json.loads(process.stdout.readline()), told
        finally:
            process.send_signal(signal.SIGINT)
            told.extend(json.loads(line) for line in process.stdout)
            assert process.wait(timeout=30) == 0


def test_a_bare_controller_serves_any_client_and_says_how_it_went() -> None:
    with Client(0, realtime=False) as client:
        with controller(client.port, "--fri-period", "10") as (ready, told):
            assert ready["ready"] and ready["command"] == "position" and ready["port"] != client.port
            begin = client.wait("COMMANDING_ACTIVE", timeout=60.0).q.copy()
            goal = begin + 0.05
            for s in client:
                client.command(q=goal)
                if np.abs(s.q - goal).max() < 2e-3:
                    break
        client.wait("IDLE", timeout=20.0)  # the controller says goodbye
    assert {"event": "StateChanged", "text": "session COMMANDING_WAIT -> COMMANDING_ACTIVE"} in told
    assert told[-1]["ended"] and told[-1]["answers"]["on_time"] > 10 and told[-1]["refused"] == 0


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("--fri", "1.99"), "choose one of"),
        (("--fri", "1.15", "--fri-command", "pose"), "it came with FRI 2.5"),
        (("--fri", "1.15", "--fri-command", "torque", "--fri-period", "10"), "every 10 ms"),
        (("--fri", "1.15", "--fri-period", "2.5"), "whole milliseconds"),
        (("--fri", "1.15", "--fri-client", "here"), "no IPv4 address"),
        (("--fri", "1.15", "--fri-client", "127.0.0.1:x"), "HOST:PORT"),
    ],
)
def test_what_no_cabinet_would_do_is_refused_in_words(arguments: tuple[str, ...], why: str) -> None:
    done = run("sim", *arguments, "--fri-port", "0")
    assert done.returncode == 1 and why in done.stderr and "Traceback" not in done.stderr
