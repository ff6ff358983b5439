"""A pytest plugin for all tests: no process outlives the test that started it.

Every process inherits a mark in its environment. It names the run and the owner: a test, or for what a fixture starts
the test, module, folder or session that the fixture lives for. When an owner is over, what is left of its processes is
ended and named, and a test that passed until then fails. `tests.reaper` does the same where pytest itself is killed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import uuid
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests import reaper

#: Time for a process to end by itself [s].
GRACE = 3.0

_run = uuid.uuid4().hex
_before: set[int] = set()
_reaper: list[subprocess.Popen[bytes]] = []
_left: list[str] = []
_failed = pytest.StashKey[bool]()


@contextmanager
def _owned_by(owner: str) -> Iterator[None]:
    """Mark the processes that are started meanwhile."""
    outer = os.environ.get(reaper.MARK)
    os.environ[reaper.MARK] = f"{_run} {owner}".encode("unicode_escape").decode()
    try:
        yield
    finally:
        if outer is not None:
            os.environ[reaper.MARK] = outer


def _end(owners: set[str] | None) -> list[reaper.Started]:
    """Processes that some owners (None: any) have left; they are ended, if they do not end by themselves."""
    ended: dict[int, reaper.Started] = {}
    patience = time.monotonic() + GRACE
    while left := [one for one in running() if owners is None or one.owner in owners]:
        if time.monotonic() > patience:  # until they are gone: they may start others meanwhile
            for process in left:
                reaper.end(process)
                ended[process.pid] = process
        time.sleep(0.02)
    return list(ended.values())


def running() -> list[reaper.Started]:
    """The processes that the tests of this process have started."""
    return reaper.started(_run, but=_before)


def _chain(item: pytest.Item | None) -> set[str]:
    nodes = () if item is None else item.listchain()
    return {node.nodeid.encode("unicode_escape").decode() for node in nodes}


def pytest_configure() -> None:
    """Mark this process' environment, and start the reaper, which does not carry the mark."""
    _before.update(reaper.numbers())
    unmarked = {name: value for name, value in os.environ.items() if name != reaper.MARK}
    command = [sys.executable, "-I", "-S", str(Path(reaper.__file__)), _run, str(os.getpid())]
    nowhere = subprocess.DEVNULL
    _reaper.append(
        subprocess.Popen(command, env=unmarked, stdin=nowhere, stdout=nowhere, start_new_session=True)
    )
    os.environ[reaper.MARK] = f"{_run} "


def pytest_unconfigure() -> None:
    """End the reaper; everything is ended already."""
    for process in _reaper:
        process.kill()
        process.wait()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_fixture_setup(
    fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
) -> Generator[None, Any, Any]:
    """Processes of a fixture may live as long as the fixture."""
    with _owned_by(request.node.nodeid):
        return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """Processes of a test end with it."""
    try:
        with _owned_by(item.nodeid):
            return (yield)
    except BaseException:
        item.stash[_failed] = True
        raise


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Generator[None, Any, Any]:
    """End what a test has left, and with a folder's last test what fixtures of the folder have left."""
    try:
        return (yield)
    finally:
        left = "\n".join(map(str, _end(_chain(item) - _chain(nextitem))))
        if left and item.stash.get(_failed, False):  # it could not clean up, but that is not why it failed
            item.add_report_section("teardown", "processes", f"ended, for the test left them behind:\n{left}")
        elif left:
            pytest.fail(f"the test left processes behind, which are ended now:\n{left}", pytrace=False)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail the run if a process is still alive that belongs to no test."""
    output = getattr(session.config, "workeroutput", None)  # of a worker of pytest-xdist
    if output is not None:
        output["left"] = list(map(str, _end(None)))
        return
    if not session.config.getoption("numprocesses", None):  # else these are the workers
        _left.extend(map(str, _end(None)))
    if _left:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A worker has ended and reports what it left behind."""
    _left.extend(getattr(node, "workeroutput", {}).get("left", []))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the processes that were left."""
    for process in _left:
        terminalreporter.write_line(f"left behind by the tests: {process}", red=True)
