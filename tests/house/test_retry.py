"""Retries on a busy machine are named and counted over the whole run; a failed check is never retried."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
_CONFTEST = """
pytest_plugins = ["tests.retry"]

def pytest_configure():
    from tests import retry
    retry.PAUSE = 0.0
"""


def run(folder: Path, body: str, *options: str) -> subprocess.CompletedProcess[str]:
    (folder / "conftest.py").write_text(_CONFTEST)
    (folder / "test_it.py").write_text(f"import pytest\nfrom tests.retry import retry\n{body}")
    (folder / "pytest.ini").write_text("[pytest]\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "xdist", *options]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=100, check=False
    )


def test_one_that_is_busy_once_passes_and_is_named(tmp_path: Path) -> None:
    done = run(
        tmp_path,
        """
def test_once():
    outcomes = iter([TimeoutError("late"), 42])
    def attempt():
        outcome = next(outcomes)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome
    assert retry(attempt, lambda it: "answers were late" if isinstance(it, TimeoutError) else "") == 42
""",
    )
    assert done.returncode == 0, done.stdout
    assert "tried again on a busy machine: test_it.py::test_once: answers were late" in done.stdout


def test_a_check_that_fails_is_never_tried_again(tmp_path: Path) -> None:
    done = run(
        tmp_path,
        """
def test_wrong():
    def attempt():
        print("attempt")
        assert not "it is wrong"
    retry(attempt, lambda _: "busy")

def test_other():
    def attempt():
        print("attempt")
        raise ValueError
    retry(attempt, lambda _: "")
""",
    )
    assert done.returncode == 1 and "2 failed" in done.stdout
    assert done.stdout.splitlines().count("attempt") == 2 and "tried again" not in done.stdout


def test_one_that_stays_busy_fails_with_what_it_saw_last(tmp_path: Path) -> None:
    done = run(
        tmp_path,
        """
def test_always():
    def attempt():
        print("attempt")
        raise TimeoutError("much too late")
    retry(attempt, lambda _: "busy")
""",
    )
    assert "much too late" in done.stdout and done.stdout.splitlines().count("attempt") == 3


def test_a_run_with_too_many_fails_a_client_that_made_them(tmp_path: Path) -> None:
    body = """
@pytest.mark.parametrize("number", range(13))
def test_each(number):
    left = [1]
    retry(lambda: left.pop() if left else 0, lambda late: "busy" if late else "")
"""
    for options in ((), ("-n", "2")):
        done = run(tmp_path, body, *options)
        assert done.returncode == 1 and "13 passed" in done.stdout, done.stdout
        assert "13 were to be tried again, of 12 at most" in done.stdout
    assert run(tmp_path, body.replace("range(13)", "range(12)")).returncode == 0
