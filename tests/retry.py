"""Retries where this machine was too busy: a pytest plugin, and the one helper for all tests.

FRI answers that come late and servo targets that do not come are faults that heptarm has to report, and on a machine
that is busy with something else it is right to. Such a test shows nothing about heptarm; it runs again. Each such case
names its cause and is counted over the whole run with all its workers. More than a few mean that this machine is not
what the tests take it for: then nothing is tried again any more, and the run fails. A check that fails is never tried
again here; `tests.postponed` does so once, when nothing else runs.
"""

from __future__ import annotations

import logging
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import pytest

if TYPE_CHECKING:
    import heptarm as ha

T = TypeVar("T")

#: Most retries in a run.
LIMIT = 12
#: Most retries in a row.
IN_A_ROW = 2
#: Longest times of the cabinet that show nothing about this machine [s]: between two states of it, and between the
#: receipt of two by this process.
HELD_UP, HELD_UP_HERE = 0.06, 0.2
#: Pause before a retry, in which the load of the machine may end [s].
PAUSE = 1.0

_LATE_ANSWERS = ("this machine answers late", "QualityLost")
_LATE_TARGETS = ("no target arrived", "Starved")
_SILENCE = ("its watchdog time is", "nothing received for", "the newest state is")
_FILE = "RETRIES_OF_HEPTARM"
_log = logging.getLogger(__name__)


def retry(attempt: Callable[[], T], cause: Callable[[T | Exception], str]) -> T:
    """Return what an attempt returns.

    Args:
        attempt: what may need a machine that has time.
        cause: names what this machine was too busy for, given what the attempt returned or raised; "": the outcome
            stands.
    """
    for left in range(IN_A_ROW, -1, -1):
        try:
            outcome = attempt()
        except AssertionError:
            raise
        except Exception as error:
            if not _again(cause(error), left):
                raise
        else:
            if not _again(cause(outcome), left):
                return outcome
        time.sleep(PAUSE)
    raise RuntimeError("the last attempt is never followed by another one")


def answers_late(outcome: object) -> str:
    """The cause, if a program or a call reported late FRI answers of this machine.

    A session on this machine that loses its quality has no other cause, even where too few answers tell it.
    """
    said = str(outcome.stderr) if isinstance(outcome, subprocess.CompletedProcess) else str(outcome)
    hint = str(getattr(outcome, "hint", ""))  # of an error of heptarm
    failed = not isinstance(outcome, subprocess.CompletedProcess) or outcome.returncode != 0
    words = f"{type(outcome).__name__} {said} {hint}"
    return (
        "FRI answers came late"
        if failed and any(late_answer in words for late_answer in _LATE_ANSWERS)
        else ""
    )


def starved(outcome: object) -> str:
    """The cause, if servo targets of a program or a call were too late."""
    if isinstance(outcome, subprocess.CompletedProcess):
        failed = outcome.returncode != 0 and any(
            late_target in outcome.stderr for late_target in _LATE_TARGETS
        )
        return "servo targets came late" if failed else ""
    return "servo targets came late" if type(outcome).__name__ == "Starved" else ""


def silent(outcome: object) -> str:
    """The cause of a program or a call that ended since one side heard nothing of the other for the time allowed."""
    if isinstance(outcome, subprocess.CompletedProcess):
        said = str(outcome.stderr) if outcome.returncode != 0 else ""
    else:
        said = str(outcome) if isinstance(outcome, Exception) else ""
    return "one side was silent" if any(one in said for one in _SILENCE) else ""


def reported(text: str) -> str:
    """The cause that the text of a result gives; "": none of this machine."""
    if any(late_target in text for late_target in _LATE_TARGETS):
        return "servo targets came late"
    return "one side was silent" if any(one in text for one in _SILENCE) else ""


def held_up(arm: ha.Arm, since: int) -> str:
    """The cause, if the cabinet of an arm did not sample states for a while, or this process received none.

    What happened then was not seen, and what this process was to send in that time was not sent.

    Args:
        arm: connected to a virtual cabinet.
        since: when its measurement began, our monotonic clock [ns].
    """
    connection = arm.connection
    kept = [one for one in connection.feed.kept() if one.received >= since]

    def longest(times: list[int]) -> float:
        return max((after - before for before, after in pairwise(times)), default=0) * 1e-9

    if (gap := longest([connection.decode(one).stamp for one in kept])) > HELD_UP:
        return f"no states of {gap:.2f} s of the cabinet's time"
    if (gap := longest([one.received for one in kept])) * connection.real_time_factor > HELD_UP_HERE:
        return f"no states received for {gap:.2f} s"
    return ""


def busy(outcome: object) -> str:
    """The cause of a program that this machine was too busy for: its servo targets, its FRI answers, or all of it."""
    return answers_late(outcome) or starved(outcome) or silent(outcome)


def _again(cause: str, left: int) -> bool:
    if not cause or not left:
        return False
    test = os.environ.get("PYTEST_CURRENT_TEST", "").removesuffix(" (call)")
    _log.warning("tried again, because this machine was too busy: %s", cause)
    file = Path(os.environ[_FILE])
    with file.open("a") as lines:
        lines.write(f"{test}: {cause}\n")
    return len(_cases()) <= LIMIT


def _cases() -> list[str]:
    return Path(os.environ[_FILE]).read_text().splitlines()


def pytest_configure(config: pytest.Config) -> None:
    """Start counting; workers of pytest-xdist count with the process that started them."""
    if not hasattr(config, "workerinput"):
        descriptor, os.environ[_FILE] = tempfile.mkstemp(prefix="retries-of-heptarm-")
        os.close(descriptor)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Reset the count."""
    if not hasattr(config, "workerinput"):
        Path(os.environ.pop(_FILE)).unlink(missing_ok=True)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail the run after too many retries."""
    if not hasattr(session.config, "workerinput") and len(_cases()) > LIMIT:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List every case."""
    cases = _cases()
    for case in cases:
        terminalreporter.write_line(f"tried again on a busy machine: {case}", yellow=True)
    if len(cases) > LIMIT:
        why = f"{len(cases)} were to be tried again, of {LIMIT} at most: this machine is too busy for these tests"
        terminalreporter.write_line(why, red=True)
