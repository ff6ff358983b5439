"""What takes too long for every run: `make test-long` sets LONG=1."""

from __future__ import annotations

import os
from typing import TypeVar

T = TypeVar("T")

LONG = os.environ.get("LONG", "") not in ("", "0")


def longer(usual: T, long: T) -> T:
    """A number, or whatever states how thorough a test is: the usual one, or that of the long run."""
    return long if LONG else usual
