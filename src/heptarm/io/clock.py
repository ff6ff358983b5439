"""Clocks: time is an interface, so that tests own it."""

from __future__ import annotations

import time
from typing import Protocol

#: A sleeper is woken up to so much late [s]: Linux gives timers 50 us of slack, and waking takes time, too.
_AWAKE = 100e-6


class Clock(Protocol):
    """A monotonic clock."""

    def nanos(self) -> int:
        """The present time [ns]; its zero means nothing."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""
        ...

    def sleep_until(self, nanos: int) -> None:
        """Let time pass until the clock shows that [ns]: to the point, at the price of waiting awake at the end."""
        ...


class RealClock:
    """The machine's monotonic clock."""

    __slots__ = ()

    nanos = staticmethod(time.monotonic_ns)

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        if seconds > 0:
            time.sleep(seconds)

    def sleep_until(self, nanos: int) -> None:
        """Sleep; then wait awake, because a sleeper is woken late."""
        now = self.nanos
        self.sleep((nanos - now()) * 1e-9 - _AWAKE)
        while now() < nanos:
            pass


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

    def sleep_until(self, nanos: int) -> None:
        """Be there at once."""
        self._now = max(self._now, nanos)

    def step(self, seconds: float) -> None:
        """Move on by that many seconds."""
        self._now += max(0, round(seconds * 1e9))
