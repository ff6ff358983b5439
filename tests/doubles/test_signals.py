"""IO groups and user keys of a Sunrise application on the doubles; the operator's commands set inputs."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from tests.doubles.test_doubles import HERE, _command, _compile

SAID = (
    "outputs are read back",
    "bad values and names throw",
    "READY",
    "the button ends a motion",
    "an analog input is what the world makes it",
    "and its release is waited for",
    "a key is pressed and released",
    "ASKED",
    "a dialog is answered",
    "a dialog has buttons",
)


def _until(file: Path, line: str) -> None:
    deadline = time.monotonic() + 60.0
    while line not in (file.read_text() if file.exists() else ""):
        assert time.monotonic() < deadline, f"{line!r} was not said"
        time.sleep(0.05)


def test_signals_and_keys_of_a_sunrise_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Signalling.java", tmp_path)
    said = tmp_path / "said.txt"
    command = [*_command("sample.Signalling", tmp_path, f"sample.file={said}"), "--parent-pipe"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        assert '"ready": true' in process.stdout.readline()
        _until(said, "READY")
        for words, line in (
            ("set MediaFlange.Pressure 6.5", "READY"),
            ("set userbutton true", "analog input"),
            ("set UserButton false", "release is waited for"),
            ("press 1 cell", "pressed and released"),
        ):
            process.stdin.write(f"{words}\n")
            process.stdin.flush()
            assert '"error": ""' in process.stdout.readline()
            _until(said, line)
        _until(said, "ASKED")
        for _ in range(200):  # the dialog comes a moment later
            process.stdin.write("answer 1\n")
            process.stdin.flush()
            reply = process.stdout.readline()
            if not reply or '"error": ""' in reply:  # none: the application ends with its last answer
                break
            time.sleep(0.05)
        assert process.wait(timeout=30) == 0
    assert said.read_text().splitlines() == [f"{one} = true" for one in SAID]
