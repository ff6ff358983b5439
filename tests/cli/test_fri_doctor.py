"""`heptarm doctor --fri` and `heptarm bench --fri`: each fault is named, with its remedy."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import threading
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import refused, run
from tests.cli.test_fri import controller, free_port
from tests.conftest import RunningCabinet
from tests.retry import retry

SPEED = 1.0  # FRI answers within milliseconds of this machine's time


def verdicts(*arguments: str, fails: bool = False) -> dict[str, dict[str, Any]]:
    def parsed(done: subprocess.CompletedProcess[str]) -> dict[str, dict[str, Any]]:
        return {one["what"]: one for one in map(json.loads, done.stdout.splitlines())}

    def spoilt(done: object) -> str:
        quality = parsed(done).get("FRI quality", {}) if isinstance(done, subprocess.CompletedProcess) else {}
        return f"FRI quality: {quality['found']}" if not fails and quality.get("how") == "bad" else ""

    done = retry(lambda: run("doctor", "--fri", "--json", *arguments), spoilt)
    assert done.returncode == (1 if fails else 0), done.stdout + done.stderr
    return parsed(done)


def test_a_cabinet_with_fri_is_looked_at_without_moving_anything(cabinet: RunningCabinet) -> None:
    found = verdicts("--target", cabinet.target, "--fri-period", "10", "--seconds", "2")
    assert found["FRI command"]["how"] == "ok"
    assert "position, torque, wrench; not offered: pose; signals" in found["FRI command"]["found"]
    assert "FRI 1.14-1.16, every 10 ms" in found["FRI messages"]["found"]
    assert re.search("EXCELLENT|GOOD", found["FRI quality"]["found"])
    assert "ms median" in found["FRI answers"]["found"]
    assert "FRI session" not in found  # which would contain an error


@pytest.mark.long
def test_somebody_elses_application_is_listened_to(tmp_path: Path) -> None:
    port, picture = free_port(), tmp_path / "fri.png"
    with controller(port, "--fri-period", "10", version="2.5"):
        found = verdicts("--listen", "--fri-port", str(port), "--seconds", "2")
        assert "FRI 2.5, every 10 ms" in found["FRI messages"]["found"]
        assert found["FRI command"]["found"].endswith("command: POSITION")
        wrong = verdicts(
            "--listen", "--fri-port", str(port), "--seconds", "1", "--fri-version", "1.15", fails=True
        )
        assert "speaks FRI 2.5" in wrong["FRI messages"]["found"]
        assert "leave --fri-version" in wrong["FRI messages"]["remedy"]
        done = run(
            *("bench", "--fri", "--listen", "--fri-port", str(port), "--duration", "1", "--json"),
            *("--plot", str(picture)),
        )
    reported = json.loads(done.stdout)
    assert reported["messages"] > 10 and reported["period_s"] == 0.01 and reported["latency_s"]["p50"] > 0
    assert 0 < reported["echo_s"]["p50"] <= reported["echo_s"]["p99"] <= reported["echo_s"]["max"] < 1.0
    assert done.returncode == (0 if reported["good"] else 1)
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 20_000


def test_an_application_that_starts_no_overlay_is_reported() -> None:
    port = free_port()
    with controller(port, "--fri-period", "10", "--fri-command", "monitor"):
        found = verdicts("--listen", "--fri-port", str(port), "--seconds", "2")
    assert "nothing can be commanded" in found["FRI command"]["found"]
    assert "FRIJointOverlay" in found["FRI command"]["remedy"]


def test_nothing_arrives() -> None:
    port = free_port()
    found = verdicts("--listen", "--fri-port", str(port), "--seconds", "0.3", fails=True)
    assert found["FRI messages"]["found"] == "nothing has arrived within 0.3 s"
    assert "firewall" in found["FRI messages"]["remedy"] and str(port) in found["FRI messages"]["remedy"]


def test_the_port_is_taken() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("0.0.0.0", 0))
        port = other.getsockname()[1]
        found = verdicts("--listen", "--fri-port", str(port), fails=True)
    assert "cannot be bound" in found["FRI port"]["found"] and "ss -ulpn" in found["FRI port"]["remedy"]


def test_something_else_arrives() -> None:
    port, done = free_port(), threading.Event()

    def chatter() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not done.wait(0.02):
                sender.sendto(b"good morning", ("127.0.0.1", port))

    thread = threading.Thread(target=chatter)
    thread.start()
    try:
        found = verdicts("--listen", "--fri-port", str(port), "--seconds", "1", fails=True)
    finally:
        done.set()
        thread.join()
    assert "none is a message of FRI" in found["FRI messages"]["found"]
    assert "another program sends to this port" in found["FRI messages"]["remedy"]


def test_bench_measures_a_session_of_its_own(cabinet: RunningCabinet) -> None:
    arguments = ("--target", cabinet.target, "--fri-port", "0", "--fri-period", "10", "--duration", "1")
    done = run("bench", "--fri", *arguments, "--fri-command", "position")
    assert done.returncode in (0, 1), done.stderr
    assert "every 10 ms" in done.stdout and "us median" in done.stdout and "verdict" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ((), "--fri"),
        (("--fri", "--duration", "0"), "duration"),
        (("--fri", "--listen", "--fri-version", "1.99"), "must be one of"),
        (("--fri", "--target", "127.0.0.1:9"), "127.0.0.1:9"),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments: tuple[str, ...], why: str) -> None:
    done = refused("bench", *arguments)
    assert done.returncode == 1 and why in done.stderr and "Traceback" not in done.stderr
