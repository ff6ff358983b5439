"""No error contains the same sentence twice: a text that was put around another one, or the hint, may repeat it.

Every text of an error that a test provokes in this process is looked at, and every line that a node of ROS or a command
of the command line prints in a test.
"""

from __future__ import annotations

import re
from collections.abc import Generator

import pytest

from heptarm.errors import HeptarmError

#: What a text quotes, and how Python shows objects: it may well repeat itself.
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"|<[^<>]*>|\[[^\[\]]*\]")
#: Lists of figures repeat themselves.
_COUNTS = re.compile(r"\d").search
#: So many words in a row are no chance.
_MANY = 5
_found: list[str] = []


def doubled(text: str) -> str:
    """What a line contains twice: a clause of two words and more, or five words in a row; "": nothing.

    Args:
        text: one line.
    """
    text = _QUOTED.sub("_", text.lower())
    clauses = [clause.split() for clause in re.split(r"[:;,.()]+(?:\s|$)|\s\(", text)]
    before: set[str] = set()
    for clause in clauses:
        whole = " ".join(clause)
        if len([word for word in clause if word.isalpha()]) > 1 and whole in before and not _COUNTS(whole):
            return whole
        before.add(whole)
    words = [word for clause in clauses for word in clause]
    runs = [" ".join(words[k : k + _MANY]) for k in range(len(words) - _MANY + 1)]
    again = (run for k, run in enumerate(runs) if run in runs[: max(0, k - _MANY + 1)])
    return next((run for run in again if not _COUNTS(run)), "")


def check_lines(text: str) -> None:
    """Check what a program has printed.

    Raises:
        AssertionError: a line contains something twice.
    """
    for line in text.splitlines():
        assert not doubled(line), f"{doubled(line)!r} is there twice: {line}"


def pytest_configure() -> None:
    """Look at each text of an error when it is made into one."""
    as_text = HeptarmError.__str__

    def looked_at(error: HeptarmError) -> str:
        text = as_text(error)
        _found.extend(f"{doubled(line)!r}: {line}" for line in text.splitlines() if doubled(line))
        return text

    HeptarmError.__str__ = looked_at  # type: ignore[method-assign]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None, object, object]:
    """Fail the test that has provoked a text which repeats itself."""
    _found.clear()
    result = yield
    assert not _found, f"an error repeats itself: {_found[0]}"
    return result
