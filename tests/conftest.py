"""The whole suite: fast tests first, then slow ones, then those with a browser; and no process is left behind."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from heptarm import Arm

_LATE = ("slow", "browser")
_MARK = "TESTS_OF_HEPTARM"
_left: list[str] = []

# no timing assertions, least of all on a machine that does other things as well
settings.register_profile("heptarm", deadline=None)
settings.load_profile("heptarm")


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
    output = getattr(session.config, "workeroutput", None)  # of a worker of pytest-xdist
    if output is not None:
        output["left"] = _late_ones()
        return
    if not session.config.getoption("numprocesses", None):
        _left.extend(_late_ones())
    if _left:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A worker has ended and says what it left behind."""
    _left.extend(getattr(node, "workeroutput", {}).get("left", []))


def _late_ones() -> list[str]:
    patience = time.monotonic() + 2.0
    while (left := _started_here()) and time.monotonic() < patience:
        time.sleep(0.1)
    return left


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


# ------------------------------------------------------------------------------- a virtual cabinet for all


@dataclass(frozen=True)
class RunningCabinet:
    """A virtual cabinet that several tests share."""

    host: str
    port: int
    pid: int

    @property
    def target(self) -> str:
        """What to connect to."""
        return f"sim://{self.host}:{self.port}"


@pytest.fixture(scope="module")
def cabinet() -> Iterator[RunningCabinet]:
    """One virtual iiwa 14 for a module, in real time; tests leave it at rest and without a controller."""
    from heptarm.arm.private_cabinet import PrivateCabinet
    from heptarm.arm.target import Target

    running = PrivateCabinet.start(Target(model="iiwa14"))
    yield RunningCabinet(running.host, running.port, running.pid)
    running.close()


@pytest.fixture
def arm(cabinet: RunningCabinet) -> Iterator[Arm]:
    """An arm in control of the shared cabinet, at its home position."""
    import heptarm

    with heptarm.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:  # patient, for busy machines
        home = heptarm.deg(0, 30, 0, -90, 0, 60, 0)
        if abs(arm.state.q - home).max() > 1e-3:
            arm.move(heptarm.ptp(home))
        yield arm


@pytest.fixture
def private_target() -> str:
    """A target that starts a virtual cabinet of one's own, five times as fast as time."""
    return "sim://iiwa14?speed=5"
