"""Progress and remaining time of what takes long, on the terminal; nothing where standard error is no terminal."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError

#: Shorter motions show no progress [s].
PATIENCE = 2.0
#: Time between two lines [s].
_INTERVAL = 0.2
_CLEAR = "\r\x1b[K"


@contextmanager
def progress(arm: Arm, *, seconds: float | None = None) -> Iterator[None]:
    """A block that moves the arm; after two seconds a line shows how far it is and how long it still takes.

    Args:
        arm: the arm that moves.
        seconds: duration of the whole where it is known [s]; None: as the cabinet reports it for each motion.
    """
    if not sys.stderr.isatty():
        yield
        return
    ended = threading.Event()
    begin = monotonic()

    def line() -> str:
        return text(arm) if seconds is None else timed(monotonic() - begin, seconds)

    thread = threading.Thread(target=_show, args=(line, ended), name="heptarm-progress", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def text(arm: Arm) -> str:
    """How far the running motion is, as the cabinet reports it; empty: none runs."""
    try:
        motion = arm.state.motion
    except HeptarmError:
        return ""
    if motion is None or not motion.active:
        return ""
    done = "" if math.isnan(motion.progress) else f"{motion.progress:4.0%}"
    rest = "" if math.isnan(motion.remaining) else f"{motion.remaining:.1f} s left"
    return ", ".join(part for part in (done, rest) if part)


def timed(since: float, seconds: float) -> str:
    """How far something is that takes a known time [s]."""
    return f"{min(1.0, since / seconds):4.0%}, {max(0.0, seconds - since):.1f} s left"


def _show(line: Callable[[], str], ended: threading.Event) -> None:
    shown = False
    pause = PATIENCE
    while not ended.wait(pause):
        pause = _INTERVAL
        if found := line():
            print(f"{_CLEAR}{found}", end="", file=sys.stderr, flush=True)
            shown = True
    if shown:
        print(_CLEAR, end="", file=sys.stderr, flush=True)
