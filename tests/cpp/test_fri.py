"""FRI in C++ over the native loop: an application of the shape of KUKA's SDK, and sessions of an arm."""

from __future__ import annotations

import re
import signal
import subprocess
from pathlib import Path

import pytest

from tests.cli.running import HEPTARM, sim
from tests.cpp.native import PATIENCE, ROOT, compiled, objects
from tests.interrupts import ctrl_c_interrupts
from tests.retry import retry

#: Messages that a client answers with a command.
CYCLES = 300


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return objects(tmp_path_factory.mktemp("fri"))


def driven(program: Path, version: str, command: str, *more: str) -> str:
    """What a client prints that a bare FRI controller sends to."""
    with subprocess.Popen([str(program), "0", *more], stdout=subprocess.PIPE, text=True) as client:
        try:
            assert client.stdout is not None
            port = client.stdout.readline().split()[-1]
            words = ["sim", "fri", version, "--fri-command", command, "--fri-client", f"127.0.0.1:{port}"]
            with ctrl_c_interrupts():
                controller = subprocess.Popen(
                    [*HEPTARM, *words, "--fri-port", "0", "--speed", "0.5"],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                )
            try:
                return client.communicate(timeout=PATIENCE)[0]
            finally:
                controller.send_signal(signal.SIGINT)
                controller.wait(timeout=PATIENCE)
        finally:
            client.kill()


@pytest.mark.parametrize(
    ("version", "command"),
    [
        ("1.15", "position"),
        *(pytest.param(*one, marks=pytest.mark.long) for one in (("1.11", "torque"), ("2.7", "torque"))),
    ],
)
def test_an_application_of_the_shape_of_the_sdk(
    loop: list[str], tmp_path: Path, version: str, command: str
) -> None:
    program = compiled(ROOT / "examples/fri_cpp/sdk_sine.cpp", tmp_path, parts=loop)

    def drive() -> str:
        return driven(program, version, command, str(CYCLES))

    def late(said: str | Exception) -> str:
        # a machine that answers too late ends the session: the client has counted fewer cycles, or lost messages
        is_whole = isinstance(said, str) and f"in {CYCLES} cycles" in said and " 0 lost" in said
        return "" if isinstance(said, Exception) or is_whole else "answers came late"

    said = retry(drive, late)
    for before in range(4):
        assert f"changed from {before} to {before + 1}" in said, said
    found = re.search(r"moved (\S+) rad in (\d+) cycles, monitored (\d+), waited (\d+)", said)
    assert found is not None, said
    moved, cycles, monitored, waited = map(float, found.groups())
    assert cycles == CYCLES and monitored > 0 and waited > 0
    assert moved > 0.035 if command == "torque" else abs(moved - 0.04) < 2e-3, said
    assert "0 malformed" in said


@pytest.mark.long
def test_sessions_of_an_arm(loop: list[str], tmp_path: Path) -> None:
    program = compiled(ROOT / "cpp/examples/fri.cpp", tmp_path, parts=loop)
    with sim() as ready:
        done = subprocess.run(
            [str(program), f"127.0.0.1:{ready['port']}", "127.0.0.1"],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    assert "A4 is at -1.570" in done.stdout
    moved = [float(one) for one in re.findall(r"moved (\S+) rad", done.stdout)]
    assert abs(moved[0] - 0.1) < 1e-3, "the positions are followed"
    assert 0.04 < moved[1] < 0.07, "10 Nm by 200 Nm/rad"


@pytest.mark.long
@pytest.mark.parametrize("version", ["2.5", "2.7"])
def test_poses_of_an_application_of_the_shape_of_the_sdk(
    loop: list[str], tmp_path: Path, version: str
) -> None:
    program = compiled(ROOT / "examples/fri_cpp/sdk_pose.cpp", tmp_path, parts=loop)
    said = retry(
        lambda: driven(program, version, "pose"),
        lambda said: "answers came late" if isinstance(said, str) and "ends at" not in said else "",
    )
    found = re.search(r"lifted (\S+) mm, ends at (\S+) mm", said)
    assert found is not None, said
    assert abs(float(found[1]) - 30.0) < 1.0 and abs(float(found[2])) < 1.0


@pytest.mark.long
def test_signals_of_a_session_of_an_arm(loop: list[str], tmp_path: Path) -> None:
    program = compiled(ROOT / "tests/cpp/fri_signals.cpp", tmp_path, parts=loop)
    with sim() as ready:
        command = [str(program), f"127.0.0.1:{ready['port']}"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    refusal, on, off = done.stdout.splitlines()
    assert refusal.startswith("no output of the session has the name MediaFlange.InputX3Pin3; it has "), done
    assert on.endswith("OutputX3Pin1 shows 1") and off.endswith("OutputX3Pin1 shows 0")
