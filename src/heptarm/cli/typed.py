"""What is typed while a command runs."""

from __future__ import annotations

import os
from collections.abc import Iterator


def is_silent() -> bool:
    """Nobody can type: in the background a terminal must not be read, which would halt the whole process."""
    try:
        return os.isatty(0) and os.tcgetpgrp(0) != os.getpgrp()
    except (OSError, AttributeError):
        return True


def lines() -> Iterator[str]:
    """Every line until the end of standard input."""
    rest = b""
    # read raw: a buffered read under way would keep the interpreter from ending
    while octets := os.read(0, 4096):
        *whole, rest = (rest + octets).split(b"\n")
        for line in whole:
            yield line.decode("utf-8", "replace").strip()
