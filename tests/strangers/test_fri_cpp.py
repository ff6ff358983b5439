"""A client of FRI in C++, written without heptarm and without an SDK, commands `heptarm sim fri`.

`LONG=1` runs every period with every command mode and every version, otherwise a few that cover each of them.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.running import HEPTARM
from tests.interrupts import ctrl_c_interrupts

SOURCE = Path(__file__).parents[2] / "examples" / "fri_cpp" / "sine.cpp"
VERSIONS = ("1.11", "1.14", "1.15", "1.16", "2.5", "2.7")
MODES = ("position", "torque", "wrench", "pose")
PERIODS = (1, 2, 5, 10, 100)
#: Time between two messages on the wall [ms]: short periods run slower, so that a busy machine keeps up.
WALL = 4.0
#: Each mode at least once, by three layouts of messages; tests/sim_fri has each version and period.
COVERING = (("1.11", "position", 5), ("1.16", "wrench", 2), ("2.5", "pose", 10), ("2.7", "torque", 5))


def grid() -> list[tuple[str, str, int]]:
    if "LONG" not in os.environ:
        return list(COVERING)
    return [
        (version, mode, period)
        for version in VERSIONS
        for mode in MODES
        for period in PERIODS
        if not (mode == "torque" and period > 5) and not (mode == "pose" and version < "2")
    ]


@pytest.fixture(scope="module")
def sine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++ here: the C++ client is not tested")
    out = tmp_path_factory.mktemp("fri_cpp") / "sine"
    flags = ("-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror")
    subprocess.run([compiler, *flags, "-o", str(out), str(SOURCE)], check=True, timeout=120)
    return out


@contextmanager
def client(sine: Path, version: str, seconds: float) -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """The client on a free port; killed at the end if it still runs."""
    command = [str(sine), "0", version, str(seconds)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.fullmatch(r"waiting on port (\d+)\n", process.stdout.readline())
            assert found is not None
            yield int(found[1]), process
        finally:
            process.kill()


@contextmanager
def controller(port: int, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`heptarm sim fri`, ended as by Ctrl-C."""
    command = [*HEPTARM, "sim", "--fri-client", f"127.0.0.1:{port}", "--fri-port", "0", *arguments]
    with ctrl_c_interrupts():
        started = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    with started as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)


@pytest.mark.parametrize(("version", "mode", "period"), grid())
def test_a_client_that_sets_itself_up_in_monitoring_ready_moves_the_arm(
    sine: Path, version: str, mode: str, period: int
) -> None:
    speed = min(1.0, period / WALL)
    arguments = (
        "--fri",
        version,
        "--fri-command",
        mode,
        "--fri-period",
        str(period),
        "--speed",
        f"{speed:g}",
    )
    with client(sine, version, 1.0) as (port, process), controller(port, *arguments) as cabinet:
        said, failed = process.communicate(timeout=120)
        cabinet.send_signal(signal.SIGINT)
        seen = cabinet.communicate(timeout=60)[0]
    assert process.returncode == 0, (said, failed, seen)
    changes = re.findall(r"changed from (\d) to (\d)", said)
    assert changes[-3:] == [("1", "2"), ("2", "3"), ("3", "4")]
    moved = re.search(r"moved ([\d.]+) rad", said)
    assert moved is not None and 0.01 < float(moved[1]) < 0.3, (said, seen)
    assert cabinet.returncode == 0 and "leaked" not in seen


def test_a_client_of_another_version_is_named(sine: Path) -> None:
    with (
        client(sine, "2.7", 1.0) as (port, _),
        controller(port, "--fri", "1.15", "--fri-period", "10") as cabinet,
    ):
        assert cabinet.stdout is not None
        line = next(one for one in cabinet.stdout if "nothing the client sends" in one)
    assert line == "nothing the client sends can be read as FRI 1.14-1.16; is it built for 2.7?\n"
