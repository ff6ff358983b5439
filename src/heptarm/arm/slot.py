"""Where the answer to a request is put down, for the one who waits for it."""

from __future__ import annotations

from _thread import allocate_lock
from collections.abc import Callable

from heptarm.wire.messages import Message


class Slot:
    """One request's; used once.

    Args:
        on_answer: called with the answer, by the thread that brings it.

    Attributes:
        answer: the answer; None until it has come.
    """

    __slots__ = ("_lock", "_on_answer", "answer")

    def __init__(self, on_answer: Callable[[Message], None] | None = None) -> None:
        self.answer: Message | None = None
        self._on_answer = on_answer
        self._lock = allocate_lock()
        self._lock.acquire()

    def put(self, answer: Message) -> None:
        """The answer has come."""
        if self._on_answer is not None:
            self._on_answer(answer)
        self.answer = answer
        self._lock.release()

    def give_up(self) -> None:
        """None will come."""
        self._lock.release()

    def wait(self, seconds: float) -> None:
        """Wait until one of both."""
        self._lock.acquire(timeout=max(0.0, seconds))
