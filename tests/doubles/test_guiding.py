"""Hand guiding in a Sunrise application; the virtual operator holds the switch and guides the arm."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.doubles.test_doubles import HERE, _command, _compile

SAID = (
    "it ends when the switch is let go = true",
    "the arm was led = true",
    "within its limits = true",
    "the switch is not held any more = true",
    "it waits for the switch = true",
    "and can be cancelled = true",
    "what is behind it follows = true",
    "values that make no sense are refused = true",
)
OPERATOR = ("guide@2.5", "push 20 40 -20 1.5@3", "let_go@5", "guide@10", "let_go@12")


@pytest.mark.long  # the same doubles as in tests/arm/test_guiding.py
def test_an_application_is_led_by_hand(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Guiding.java", tmp_path)
    said = tmp_path / "said.txt"
    command = _command("sample.Guiding", tmp_path, f"sample.file={said}", speed=1.0)  # an operator has time
    for words in OPERATOR:
        command += ["--fault", words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert tuple(said.read_text().splitlines()) == SAID
