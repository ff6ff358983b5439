"""Private simulators start and end with their arm."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from tests.arm.programs import end, script

HOME = deg(0, 30, 0, -90, 0, 60, 0)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().split(") ")[1][0] != "Z"


def gone(pid: int, seconds: float = 20.0) -> bool:
    deadline = time.monotonic() + seconds
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not alive(pid)


def test_a_private_simulator_comes_and_goes_with_its_arm(private_target: str) -> None:
    threads = set(threading.enumerate())
    with ha.connect(private_target, watchdog=5.0, timeout=30.0) as arm:
        assert arm.connection.cabinet is not None
        pid = arm.connection.cabinet.pid
        assert alive(pid) and arm.is_virtual and arm.robot.name == "iiwa14"
        assert arm.move(ptp(deg(60, 30, 0, -90, 0, 60, 0), speed=0.1)).arrived
        arm.wait_until(lambda _: 2.5 < arm.connection.link.offset.rate < 6.0, timeout=60.0)
        assert -2.0 < np.median([state.age for state in arm.states(duration=0.3)]) < 2.0
    assert gone(pid)
    left = {thread.name for thread in set(threading.enumerate()) - threads if thread.is_alive()}
    assert "heptarm-link" not in left


def test_a_private_simulator_ends_with_a_killed_program(private_target: str, tmp_path: Path) -> None:
    process, said = script(tmp_path, private_target)
    pid = int(said)
    assert alive(pid)
    process.kill()
    end(process)
    assert gone(pid)


def test_a_simulator_that_dies_is_a_lost_connection(private_target: str) -> None:
    arm = ha.connect(private_target, watchdog=5.0, timeout=30.0)
    assert arm.connection.cabinet is not None
    handle = arm.start(ptp(deg(60, 30, 0, -90, 0, 60, 0), speed=0.05))
    os.kill(arm.connection.cabinet.pid, signal.SIGKILL)
    with pytest.raises(ha.ConnectionLost):
        handle.wait(timeout=20.0)
    with pytest.raises(ha.ConnectionLost):
        arm.move(ptp(HOME))
    arm.close()


def test_a_simulator_that_does_not_start_reports_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("JAVA_HOME", "/nonexistent")
    monkeypatch.setenv("PYTHONPATH", "/nonexistent")
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(ha.ConnectFailed, match="did not start"):
        ha.connect("sim://iiwa14")
