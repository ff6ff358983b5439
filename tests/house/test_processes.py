"""Processes started by a test end with it, also if it fails, hangs or is killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.long import few

ROOT = Path(__file__).parents[2]
_CONFTEST = """
pytest_plugins = ["tests.processes", "tests.hangs"]

def pytest_sessionstart():
    from tests import processes
    from tests import hangs
    processes.GRACE = 0.3
    hangs.AHEAD = 45.0
"""
_HEAD = """
import os, pathlib, signal, subprocess, sys, time
import pytest

def start(name):
    # it ignores what would end it, and has started another one
    code = "import signal, subprocess, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); " \\
        "child = subprocess.Popen(['sleep', '600']); print(child.pid, flush=True); time.sleep(600)"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, start_new_session=True)
    child = process.stdout.readline().decode().strip()
    pathlib.Path(name).write_text(f"{process.pid} {child}")
    return process
"""


def run(folder: Path, body: str, *options: str) -> tuple[subprocess.CompletedProcess[str], list[int]]:
    """Run a file of tests in a separate pytest; return its result and the processes that it has started."""
    (folder / "conftest.py").write_text(_CONFTEST)
    (folder / "test_it.py").write_text(_HEAD + body)
    (folder / "pytest.ini").write_text("[pytest]\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "pytest_timeout"]
    command += ["-p", "xdist", *options]
    done = subprocess.run(
        command,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    started = [int(word) for file in folder.glob("*.pids") for word in file.read_text().split()]
    return done, started


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


pytestmark = pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="asks Linux")


def test_a_test_that_leaves_a_process_fails_and_the_process_ends(tmp_path: Path) -> None:
    done, started = run(
        tmp_path,
        """
def test_leaves():
    start("a.pids")

def test_next():
    from tests.house.test_processes import runs
    assert not any(runs(int(pid)) for pid in pathlib.Path("a.pids").read_text().split())
""",
    )
    assert "2 passed, 1 error" in done.stdout, done.stdout + done.stderr
    assert "the test left processes behind" in done.stdout and str(started[0]) in done.stdout
    assert len(started) == 2 and not any(map(runs, started))


def test_a_test_that_hangs_leaves_none(tmp_path: Path) -> None:
    done, started = run(
        tmp_path, "\ndef test_hangs():\n    start('a.pids')\n    time.sleep(60)\n", "--timeout=2"
    )
    assert "1 failed" in done.stdout and "error" not in done.stdout.splitlines()[-1], done.stdout
    assert len(started) == 2 and not any(map(runs, started))


@pytest.mark.parametrize("options", few([("-n", "1"), ()]), ids=few(["in a worker", "here"]))
def test_a_test_that_hangs_leaves_its_stacks_in_the_log(tmp_path: Path, options: tuple[str, ...]) -> None:
    body = """
def wait_for_nobody(program):
    subprocess.run([sys.executable, "-c", program], check=True)

def test_hangs():
    wait_for_nobody("import time\\ndef sit_there():\\n    time.sleep(60)\\nsit_there()")
"""
    done, _ = run(tmp_path, body, "--timeout=60", *options)
    assert "1 failed" in done.stdout, done.stdout
    log = done.stdout + done.stderr  # what a test's processes print is shown with its failure
    assert "test_it.py::test_hangs hangs; its processes:" in log and "sit_there()" in log, log
    assert "in wait_for_nobody" in log, "its own stack"
    assert "line 3 in sit_there" in log, "and that of its process"


def test_what_a_fixture_starts_lives_as_long_as_the_fixture(tmp_path: Path) -> None:
    done, started = run(
        tmp_path,
        """
@pytest.fixture(scope="module")
def module():
    return start("module.pids")

@pytest.fixture(scope="session")
def session():
    process = start("session.pids")
    yield process
    process.kill()  # and leaves its child

@pytest.fixture
def function():
    process = start("function.pids")
    yield process

def test_one(module, session): ...
def test_two(module, session): assert module.poll() is None and session.poll() is None
def test_three(module, session, function): assert module.poll() is None
""",
    )
    assert "3 passed, 1 error" in done.stdout, done.stdout
    assert len(started) == 6 and not any(map(runs, started))


@pytest.mark.parametrize("how", ["os.kill(os.getpid(), signal.SIGKILL)", "os._exit(1)"])
def test_tests_that_are_killed_leave_none(tmp_path: Path, how: str) -> None:
    done, started = run(tmp_path, f"\ndef test_killed():\n    start('a.pids')\n    {how}\n")
    assert done.returncode != 0 and len(started) == 2
    patience = time.monotonic() + 20.0
    while any(map(runs, started)) and time.monotonic() < patience:
        time.sleep(0.05)
    assert not any(map(runs, started))


def test_a_worker_that_is_killed_leaves_none(tmp_path: Path) -> None:
    body = "\ndef test_killed():\n    start('a.pids')\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    done, started = run(tmp_path, body, "-n", "1", "--max-worker-restart=0")
    assert "crashed" in done.stdout and len(started) == 2, done.stdout
    patience = time.monotonic() + 20.0
    while any(map(runs, started)) and time.monotonic() < patience:
        time.sleep(0.05)
    assert not any(map(runs, started))
