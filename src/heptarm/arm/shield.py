"""Holds Ctrl-C back for the moment in which a frame is half sent or half understood."""

from __future__ import annotations

import signal
import threading
from _thread import get_ident
from collections.abc import Callable
from types import FrameType
from typing import Any

try:  # the public functions wrap every number in an enumeration, which costs ten times as much
    from _signal import getsignal  # type: ignore[import-not-found]
    from _signal import signal as set_signal
except ImportError:  # another Python than CPython
    from signal import getsignal
    from signal import signal as set_signal

_SIGINT = int(signal.SIGINT)


class Shield:
    """While it is up, Ctrl-C is noted; when it goes down, the program's own handler hears of it.

    Handlers run in the main thread alone, so in other threads it does nothing. It must go down in a `finally`.
    """

    __slots__ = ("_previous", "pending")

    def __init__(self) -> None:
        self.pending = False
        self._previous: Callable[[int, FrameType | None], Any] | None = None
        if get_ident() == threading.main_thread().ident:
            previous = getsignal(_SIGINT)
            if callable(previous):  # otherwise no exception can come of it
                self._previous = previous
                set_signal(_SIGINT, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Note the signal."""
        self.pending = True

    def down(self) -> None:
        """Take it down; raises what the program's own handler raises."""
        previous = self._previous
        if previous is not None:
            self._previous = None
            set_signal(_SIGINT, previous)
            if self.pending:
                previous(_SIGINT, None)
