"""What fails on an overloaded machine runs again when the others have ended, and anything else fails at once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_CONFTEST = """
import os
pytest_plugins = ["tests.postponed"]
os.cpu_count = lambda: {processors}
"""
_TESTS = """
import pytest

@pytest.mark.parametrize("number", range({count}))
def test_late(number):
    assert number > {failing}

@pytest.fixture
def broken():
    yield
    assert not {is_broken}

def test_with_a_fixture(broken):
    pass
"""


def run(
    folder: Path, *options: str, failing: int = 0, is_broken: bool = False, processors: int = -1
) -> subprocess.CompletedProcess[str]:
    """Four tests and one with a fixture; fewer processors than none are overloaded at any time."""
    (folder / "conftest.py").write_text(_CONFTEST.format(processors=processors))
    (folder / "test_it.py").write_text(_TESTS.format(count=4, failing=failing - 1, is_broken=is_broken))
    (folder / "pytest.ini").write_text("[pytest]\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "xdist", *options]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=100, check=False
    )


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_what_fails_beside_others_is_named_and_fails_the_run_if_it_fails_again(
    tmp_path: Path, workers: tuple[str, ...]
) -> None:
    file = tmp_path / "again" / "names"
    done = run(tmp_path, *workers, "--postpone", str(file), failing=1, is_broken=True)
    assert done.returncode == 0, done.stdout
    assert "1 failed, 4 passed, 1 error" in done.stdout and "assert 0 > 0" in done.stdout
    assert "runs again when nothing else does: test_it.py::test_late[0]" in done.stdout
    assert set(file.read_text().splitlines()) == {
        "test_it.py::test_late[0]",
        "test_it.py::test_with_a_fixture",
    }
    again = run(tmp_path, f"@{file}", failing=1)
    assert again.returncode == 1 and "1 failed, 1 passed" in again.stdout, again.stdout
    assert run(tmp_path, f"@{file}").returncode == 0


def test_free_processors_many_failures_and_errors_of_other_kinds_fail_at_once(tmp_path: Path) -> None:
    file = tmp_path / "names"
    option = "--postpone", str(file)
    assert run(tmp_path, *option, failing=1, processors=10**6).returncode == 1
    assert run(tmp_path, *option, failing=4).returncode == 1
    assert run(tmp_path, *option, "test_nothing.py").returncode == pytest.ExitCode.USAGE_ERROR
    assert run(tmp_path, *option).returncode == 0
    assert run(tmp_path, failing=1).returncode == 1
    assert not file.exists()
