"""Clocks: time is an interface, so that tests own it."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock."""

    def nanos(self) -> int:
        """The present time [ns]; its zero means nothing."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""
        ...


class RealClock:
    """The machine's monotonic clock."""

    __slots__ = ()

    nanos = staticmethod(time.monotonic_ns)

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        if seconds > 0:
            time.sleep(seconds)


class StepClock:
    """A clock that moves only when told; sleeping moves it.

    Args:
        start: first reading [ns].
    """

    __slots__ = ("_now",)

    def __init__(self, start: int = 0) -> None:
        self._now = start

    def nanos(self) -> int:
        """The present time [ns]."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Move on at once."""
        self.step(seconds)

    def step(self, seconds: float) -> None:
        """Move on by that many seconds."""
        self._now += max(0, round(seconds * 1e9))
