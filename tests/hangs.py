"""What a test that hangs leaves in the log: which processes it has, what their threads wait for, and all stacks.

A plugin of pytest for all tests. Some time before a test's time-out it writes to the standard error of the run, also
from a worker of pytest-xdist. Then it aborts the test's Python processes: Python prints the stacks of their threads
first, to where the test reads their standard error, or to the log.
"""

from __future__ import annotations

import faulthandler
import os
import threading
from collections.abc import Generator
from pathlib import Path

import pytest

from tests import processes, reaper

#: So long before its time-out a test counts as hanging [s].
AHEAD = 40.0

_log = pytest.StashKey[int]()


def pytest_configure(config: pytest.Config) -> None:
    """Keep the standard error, which pytest takes from the tests, and let aborted processes print their stacks."""
    config.stash[_log] = os.dup(2)
    os.environ["PYTHONFAULTHANDLER"] = "1"


def pytest_unconfigure(config: pytest.Config) -> None:
    """Close what was kept."""
    os.close(config.stash[_log])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Look after a test."""
    mark = item.get_closest_marker("timeout")
    timeout = mark.args[0] if mark is not None and mark.args else _default(item.config)
    watch = threading.Timer(timeout - AHEAD, _tell, (item.nodeid, item.config.stash[_log]))
    watch.daemon = True
    if timeout > AHEAD:
        watch.start()
    try:
        return (yield)
    finally:
        watch.cancel()


def _default(config: pytest.Config) -> float:
    given = config.getoption("timeout", None)
    return float(given if given is not None else config.getini("timeout") or 0.0)


def _tell(test: str, log: int) -> None:
    lines = [f"\n{test} hangs; its processes:\n"]
    started = processes.running()
    for process in started:
        lines.append(f"  {process}\n")
        lines += [f"    {thread}\n" for thread in _threads(process.pid)]
    os.write(log, "".join([*lines, "its threads:\n"]).encode(errors="replace"))
    faulthandler.dump_traceback(log, all_threads=True)
    for process in started:
        if "python" in process.command.partition(" ")[0]:
            reaper.abort(process)


def _threads(pid: int) -> list[str]:
    """Name, state and what in the kernel it waits for, of each thread of a process."""
    found = []
    for task in sorted(Path(f"/proc/{pid}/task").glob("*")):
        try:
            state = (task / "stat").read_text().rpartition(")")[2].split()[0]
            found.append(f"{(task / 'comm').read_text().strip()}: {state} {(task / 'wchan').read_text()}")
        except OSError:
            continue  # ended meanwhile
    return found
