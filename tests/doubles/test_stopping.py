"""Stops and errors in a Sunrise application: execution pauses, listeners are called, the operator resumes."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.doubles.test_doubles import HERE, _command, _compile

SAID = (
    "ready = true",
    "an emergency stop pauses = true",
    "releasing it does not move the arm = true",
    "a drive error fails the motion = true",
    "and switches the drives off = true",
    "T2 needs the enabling switch = true",
    "and then moves = true",
    "listeners = [paused, ready false, ready true, resumed, safety NOSTOP, safety STOP0, safety STOP1]",
)
FAULTS = ("emergency_stop@3", "clear@4", "drive_error 2@6.5", "t2@8.5", "enable@9.5")


def test_an_application_lives_through_stops(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Stopping.java", tmp_path)
    said = tmp_path / "said.txt"
    command = _command("sample.Stopping", tmp_path, f"sample.file={said}", speed=1.0)  # an operator has time
    for fault in FAULTS:
        command += ["--fault", fault]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert tuple(said.read_text().splitlines()) == SAID
