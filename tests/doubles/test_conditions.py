"""Conditions of a Sunrise application on the doubles: they break motions, fire triggers, notify observers."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.doubles.test_doubles import HERE, _command, _compile

BREAKING = (
    "a line down stops on the table and returns",
    "it reports which condition fired",
    "the table pushes back",
    "a condition that holds at the start ends the motion at once",
    "without a firing there is no info",
    "the observer heard both edges",
    "a removed one hears nothing",
    "a trigger calls back on the way",
    "and the motion arrives",
    "30 mm before the end",
    "waiting in vain",
    "waiting for what holds",
    "an observer receives what holds when it is enabled",
    "bad values are refused",
)


def test_conditions_of_a_sunrise_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Breaking.java", tmp_path)
    said = tmp_path / "said.txt"
    command = _command("sample.Breaking", tmp_path, f"sample.file={said}")
    done = subprocess.run(
        [*command, "--box", "0.6,0,0.15,0.4,0.6,0.3"], capture_output=True, text=True, timeout=90, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in BREAKING]


TRIGGERING = (
    "triggers of a batch's motions go off in order",
    "the container knows",
    "a listener receives segments",
    "the motion is the spline",
    "break conditions of a part are refused",
)


@pytest.mark.long  # the same doubles as in tests/arm/test_triggers.py
def test_triggers_of_motions_in_batches_and_of_segments(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Triggering.java", tmp_path)
    said = tmp_path / "said.txt"
    command = _command("sample.Triggering", tmp_path, f"sample.file={said}")
    done = subprocess.run(command, capture_output=True, text=True, timeout=90, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in TRIGGERING]
