"""Requests that wait for their answers, undisturbed by Ctrl-C."""

from __future__ import annotations

import signal
import threading
from _thread import allocate_lock, get_ident
from collections.abc import Callable
from types import FrameType
from typing import Any

from heptarm.wire.messages import Message

try:  # the public functions wrap every number in an enumeration, which costs ten times as much
    from _signal import getsignal  # type: ignore[import-not-found]
    from _signal import signal as set_signal
except ImportError:  # another Python than CPython
    from signal import getsignal
    from signal import signal as set_signal

_SIGINT = int(signal.SIGINT)


class InterruptShield:
    """Defers Ctrl-C from its construction until `release`, which calls the program's own handler.

    Python runs signal handlers in the main thread only, so in other threads it has no effect. Call `release` in a
    `finally`.
    """

    __slots__ = ("_previous", "pending")

    def __init__(self) -> None:
        self.pending = False
        self._previous: Callable[[int, FrameType | None], Any] | None = None
        if get_ident() == threading.main_thread().ident:
            previous = getsignal(_SIGINT)
            if callable(previous):  # otherwise Ctrl-C raises no exception
                self._previous = previous
                set_signal(_SIGINT, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Record the signal."""
        self.pending = True

    def release(self) -> None:
        """Restore the program's own handler and call it if Ctrl-C came; raises what it raises."""
        previous = self._previous
        if previous is not None:
            self._previous = None
            set_signal(_SIGINT, previous)
            if self.pending:
                previous(_SIGINT, None)


class PendingRequest:
    """A request that waits for its answer; used once.

    Args:
        on_answer: called with the answer, by the thread that reads it.

    Attributes:
        answer: None until it arrives.
    """

    __slots__ = ("_lock", "_on_answer", "answer")

    def __init__(self, on_answer: Callable[[Message], None] | None = None) -> None:
        self.answer: Message | None = None
        self._on_answer = on_answer
        self._lock = allocate_lock()
        self._lock.acquire()

    def resolve(self, answer: Message) -> None:
        """Deliver the answer."""
        if self._on_answer is not None:
            self._on_answer(answer)
        self.answer = answer
        self._lock.release()

    def abandon(self) -> None:
        """Wake the waiting thread without an answer."""
        self._lock.release()

    def wait(self, seconds: float) -> None:
        """Wait for `resolve` or `abandon`."""
        self._lock.acquire(timeout=max(0.0, seconds))


class PendingRequests:
    """The requests of a link that wait.

    Attributes:
        by_id: waiting ones.
        spare: ready ones, which the exchange in C takes; without any it sends nothing.
    """

    __slots__ = ("by_id", "spare")

    def __init__(self) -> None:
        self.by_id: dict[int, PendingRequest] = {}
        self.spare = [PendingRequest()]

    def replenish(self) -> None:
        """Have a spare one; an interrupt can come in the one moment in which it is missing."""
        if not self.spare:
            self.spare.append(PendingRequest())

    def resolve(self, request: int, answer: Message) -> None:
        """Deliver an answer; one that nobody waits for any more is dropped."""
        pending = self.by_id.pop(request, None)
        if pending is not None:
            pending.resolve(answer)

    def abandon(self) -> None:
        """Wake all waiting threads without an answer."""
        for request in list(self.by_id):
            pending = self.by_id.pop(request, None)
            if pending is not None:
                pending.abandon()
