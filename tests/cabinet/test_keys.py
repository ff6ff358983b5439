"""The smartPAD's keys, on the whole virtual cabinet."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import classes
from tests.cabinet.peer import Peer, ptp, run

STOP, RELEASE = 0, 1


@pytest.fixture
def virtual(tmp_path: Path) -> Iterator[tuple[int, Path]]:
    """Port of a virtual cabinet, and the file that names the keys for its operator to press."""
    keys = tmp_path / "keys"
    folder = classes("java_keys").rpartition(":")[2]
    command = [sys.executable, "-m", "heptarm.sim.runtime.cabinet", "--port", "0", "--parent-pipe"]
    command += [
        "--application",
        "heptarm.keys.Operator",
        "--classpath",
        folder,
        "--data",
        f"operator.file={keys}",
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.stdin is not None
        reported = keys.with_suffix(".port")
        deadline = time.monotonic() + 60.0
        while not reported.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        yield int(reported.read_text()), keys
        process.stdin.close()
        assert process.wait(timeout=30) == 0


def test_a_person_at_the_smartpad_stops_and_takes_control_away(virtual: tuple[int, Path]) -> None:
    port, keys = virtual
    with Peer(port, name="first") as peer:
        peer.take_control()
        peer.ask(wire.SetOverride(value=0.3))
        accepted = peer.ask(run(ptp(1.5)))
        peer.wait_for(wire.MotionStarted, lambda e: e.id == accepted.id)
        keys.write_text(f"{STOP}\n")
        end = peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)
        assert end.cause == wire.Cause.STOPPED
        assert "smartPAD" in end.text
        assert abs(end.q[0]) < 1.4

        accepted = peer.ask(run(ptp(1.5)))  # control did not change
        peer.wait_for(wire.MotionStarted, lambda e: e.id == accepted.id)
        keys.write_text(f"{STOP}\n{RELEASE}\n")
        assert peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id).cause == wire.Cause.STOPPED
        assert "smartPAD" in peer.wait_for(wire.ControlChanged, lambda e: e.controller == "").text
        assert peer.ask(run(ptp(0.0))).code == Code.NOT_IN_CONTROL
