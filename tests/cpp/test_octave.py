"""The example for MATLAB and Octave, compiled and run by the real Octave: `apt install octave-dev`."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.running import sim
from tests.retry import retry, silent

ROOT = Path(__file__).resolve().parents[2]
MATLAB = ROOT / "examples" / "matlab"
FLAGS = ("-std=c++17", "-pthread", f"-I{ROOT / 'cpp' / 'include'}")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example with its compiled function."""
    compiler = shutil.which("mkoctfile")
    if compiler is None:
        pytest.skip("no Octave with its headers here: the function for MATLAB and Octave is not tested")
    folder = tmp_path_factory.mktemp("octave")
    for source in MATLAB.iterdir():
        shutil.copy(source, folder)
    command = [compiler, "--mex", *FLAGS, "heptarm_mex.cpp"]
    subprocess.run(command, cwd=folder, check=True, timeout=800)
    return folder


@pytest.fixture(scope="module")
def target() -> Iterator[str]:
    with sim("--speed", "4") as ready:
        yield f"localhost:{ready['port']}"


def octave(folder: Path, target: str, *program: str) -> str:
    done = retry(
        lambda: subprocess.run(
            ["octave-cli", "--quiet", *program],
            cwd=folder,
            env=os.environ | {"HEPTARM_TARGET": target},
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        ),
        silent,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_octave_moves_the_arm_and_reads_where_it_is(folder: Path, target: str) -> None:
    said = octave(folder, target, "first_motion.m")
    assert "LBR iiwa 14 R820" in said and "down by 100.0 mm" in said
    assert "refused: " in said and "A2 must be in [-120, 120] deg" in said


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ('heptarm_mex("q")', "there is no connection"),
        ("heptarm_mex()", "the command must be a text"),
        ('heptarm_mex("fly")', "the command must be connect, ptp"),
        ('heptarm_mex("connect", "localhost:9")', "localhost:9"),
        ('heptarm_mex("connect", 3)', "the address must be a text"),
    ],
)
def test_a_wrong_call_is_an_error_of_octave(folder: Path, target: str, call: str, words: str) -> None:
    said = octave(folder, target, "--eval", f"try; {call}; catch e; disp(e.message); end")
    assert words in said


def test_wrong_numbers_are_refused_before_they_are_sent(folder: Path, target: str) -> None:
    calls = (
        'heptarm_mex("ptp", [1 2 3], 0.5)',
        'heptarm_mex("ptp", zeros(1, 7), "fast")',
        'heptarm_mex("ptp", NaN(1, 7), 0.5)',
        'heptarm_mex("lin_rel", [0 0 i], "base", 0.2)',
    )
    tried = "".join(f"try; {call}; disp('passed'); catch e; disp(e.message); end;" for call in calls)
    said = octave(folder, target, "--eval", f'heptarm_mex("connect", "{target}"); {tried}').splitlines()
    assert len(said) == len(calls) and "passed" not in said
    assert "q [rad] must be 7 real numbers" in said[0] and "the speed must be 1 real numbers" in said[1]
    assert "the offset [m] must be 3 real numbers" in said[3]
