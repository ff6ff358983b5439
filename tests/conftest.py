"""The whole suite: fast tests first, then slow ones, then those with a browser; and no process is left behind."""

from __future__ import annotations

import os
import time
import uuid
from pathlib import Path

import pytest

_LATE = ("slow", "browser")
_MARK = "TESTS_OF_HEPTARM"
_left: list[str] = []


def pytest_configure() -> None:
    """Marks the environment, which every process started by a test inherits."""
    os.environ[_MARK] = uuid.uuid4().hex


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sorts the tests; the sort is stable, so files keep their own order."""
    items.sort(key=_rank)


def _rank(item: pytest.Item) -> int:
    return max((1 + _LATE.index(mark.name) for mark in item.iter_markers() if mark.name in _LATE), default=0)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fails the run if a process that a test started is still alive a little later."""
    patience = time.monotonic() + 2.0
    while (left := _started_here()) and time.monotonic() < patience:
        time.sleep(0.1)
    if left:
        _left.extend(left)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Names what was left."""
    for process in _left:
        terminalreporter.write_line(f"left behind by a test: {process}", red=True)


def _started_here() -> list[str]:
    """Processes that carry this run's mark: number and command line."""
    mark = f"{_MARK}={os.environ[_MARK]}".encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if int(folder.name) != os.getpid() and mark in (folder / "environ").read_bytes().split(b"\0"):
                command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                found.append(f"{folder.name} {command}")
        except OSError:
            continue  # ended meanwhile
    return found
