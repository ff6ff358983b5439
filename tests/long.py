"""What takes too long for every run: `make test-long` sets LONG=1."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")

LONG = os.environ.get("LONG", "") not in ("", "0")


def longer(usual: T, long: T) -> T:
    """A number, or whatever states how thorough a test is: the usual one, or that of the long run."""
    return long if LONG else usual


def few(cases: Iterable[T], number: int = 1) -> list[T]:
    """The first cases of a grid that shows one behaviour again and again; in the long run all of them."""
    every = list(cases)
    return longer(every[:number], every)
