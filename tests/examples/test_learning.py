"""The examples of other libraries for learning run as their own tutorials are written, where they are installed."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "learning"
#: Each file, what it needs, and how little it learns here.
LIBRARIES = {"with_sb3": ("stable_baselines3", 300), "with_skrl": ("skrl", 40), "with_rsl_rl": ("rsl_rl", 2)}
#: Those that are run elsewhere: in tests/rl/test_jobs.py, and below.
SCRIPTS = ("pick_place", "push")


def test_every_example_is_known() -> None:
    assert {file.stem for file in FOLDER.glob("*.py")} == {*LIBRARIES, *SCRIPTS}


@pytest.mark.long
@pytest.mark.parametrize("name", LIBRARIES)
def test_a_library_learns_with_the_tasks(name: str) -> None:
    library, steps = LIBRARIES[name]
    if find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    done = subprocess.run(
        [sys.executable, str(FOLDER / f"{name}.py")],
        env={**os.environ, "STEPS": str(steps)},
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert "action: [" in done.stdout


@pytest.mark.long
@pytest.mark.slow
def test_the_included_policy_pushes_a_puck_on_the_virtual_arm() -> None:
    done = subprocess.run(
        [sys.executable, str(FOLDER / "push.py"), "4"],
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.splitlines()[-1].split()[0]) >= 2, done.stdout
