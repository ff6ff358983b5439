"""Tests that fail while this machine is overloaded run again when the others have ended: a pytest plugin.

`make test` keeps all processors busy for twenty minutes, at times with more than they can do. A test that fails then
shows a fault of heptarm, or that its simulator or its client got no processor for a second. To tell them apart,
`--postpone FILE` writes the names of a few such tests to a file, and `make test` runs them again, one at a time, when
nothing else runs. A test that fails again fails the run. Each is named in the report: a test that depends on the load
is to be mended. Where processors are free, where more tests fail, and without the option nothing is postponed.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

#: More failures than these have their cause in heptarm.
MOST = 3


def is_overloaded() -> bool:
    """Whether more processes had or wanted a processor in the last minutes than there are processors."""
    return max(os.getloadavg()[:2]) > (os.cpu_count() or 1)


class Postponement:
    """Collects what fails, and writes it at the end of the run."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._failed: dict[str, None] = {}
        self._is_postponed = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a failure, in the set-up of a test or its end too."""
        if report.failed:
            self._failed[report.nodeid] = None

    @pytest.hookimpl(tryfirst=True)  # other plugins may fail the run all the same
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the tests to run again instead of failing."""
        if (
            session.exitstatus == pytest.ExitCode.TESTS_FAILED
            and 0 < len(self._failed) <= MOST
            and is_overloaded()
        ):
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._file.write_text("".join(f"{test}\n" for test in self._failed))
            self._is_postponed = True
            session.exitstatus = pytest.ExitCode.OK

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Name them."""
        for test in self._failed if self._is_postponed else ():
            terminalreporter.write_line(f"runs again when nothing else does: {test}", yellow=True)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option."""
    parser.addoption(
        "--postpone", metavar="FILE", help="write what fails on an overloaded machine to a file, to run again"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Collect where it is asked for; workers of pytest-xdist leave it to the process that started them."""
    if (file := config.getoption("--postpone")) and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Postponement(Path(file)), "postponement")
