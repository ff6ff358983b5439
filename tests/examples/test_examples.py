"""Every example runs unchanged."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.lending import Lender
from tests.retry import busy, retry
from tests.simulators import FASTER, PATIENT, PATIENT_AND_FASTER

#: Of the virtual cabinet shared by the examples.
SPEED = FASTER
#: These borrow another one, in real time: they look at the clock of this machine, or answer FRI.
REAL_TIME = (
    *("03_async_cancel.py", "06_servo.py", "07_fri.py", "10_recovery.py", "12_straight_servo.py"),
    *("13_hand_guiding.py", "18_teleoperation.py", "21_laws.py", "28_demonstrations.py"),
)
#: These bring a simulator with what they touch.
OWN_SIMULATOR = ("24_tool_shapes.py",)
#: What tests of the same calls show: tests/skills and the scenarios, tests/arm of paths, shapes, several arms, FRI and
#: laws, and tests/calibration.
IN_LONG_RUN = tuple(
    f"{one}.py"
    for one in (
        *("12_straight_servo", "13_hand_guiding", "14_collision_guard", "15_pick_and_place", "16_insertion"),
        *("17_polishing", "18_teleoperation", "20_two_arms", "21_laws", "24_tool_shapes", "25_around_things"),
        *("26_calibrate", "27_learned_insertion", "28_demonstrations"),
    )
)
RUNNER = """
import runpy, sys
del sys.argv[0]  # as if the example had been started by itself
runpy.run_path(sys.argv[0], run_name="__main__")
"""
EXAMPLES = sorted(
    (Path(__file__).parents[2] / "examples").glob("*.py"),
    key=lambda path: (path.name not in REAL_TIME, path.name),
)  # those in real time before the shared one is there, which takes its part of the machine


@pytest.fixture(scope="module")
def lender(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lender]:
    """A virtual cabinet in real time, for one example after the other."""
    with Lender(tmp_path_factory.mktemp("lender") / "socket", 1.0) as lender:
        yield lender


@pytest.mark.parametrize(
    "example",
    [pytest.param(one, marks=[pytest.mark.long] if one.name in IN_LONG_RUN else []) for one in EXAMPLES],
    ids=lambda path: path.name,
)
def test_example(example: Path, request: pytest.FixtureRequest) -> None:
    if example.name in REAL_TIME:
        target, before = "sim://iiwa14", request.getfixturevalue("lender").prelude + PATIENT
    elif example.name in OWN_SIMULATOR:
        target, before = "", PATIENT_AND_FASTER
    else:
        target, before = request.getfixturevalue("cabinet").target, PATIENT_AND_FASTER
    environment = os.environ | ({"HEPTARM_TARGET": target} if target else {})

    def run() -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", before + RUNNER, str(example)],
            capture_output=True,
            text=True,
            timeout=140,
            env=environment,
            check=False,
        )

    done = retry(run, busy)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() and "Traceback" not in done.stderr
