"""Clocks behind an interface, so that tests control the time."""

from __future__ import annotations

import time
from typing import Protocol

#: Largest usual delay of a wake-up [s]: timer slack of Linux (50 us) and the time that waking takes.
_WAKE_DELAY = 100e-6


class Clock(Protocol):
    """A monotonic clock."""

    def nanos(self) -> int:
        """Read the time [ns]; its zero point is arbitrary."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait for a time [s]."""
        ...

    def sleep_until(self, nanos: int) -> None:
        """Wait until the clock reads a time [ns]; exact, because the last part is a busy wait."""
        ...


class RealClock:
    """Monotonic clock of the machine."""

    __slots__ = ()

    nanos = staticmethod(time.monotonic_ns)

    def sleep(self, seconds: float) -> None:
        """Sleep for a time [s]; return at once if it is not positive."""
        if seconds > 0:
            time.sleep(seconds)

    def sleep_until(self, nanos: int) -> None:
        """Sleep, then busy-wait, because the system wakes a sleeper late."""
        now = self.nanos
        self.sleep((nanos - now()) * 1e-9 - _WAKE_DELAY)
        while now() < nanos:
            pass


class StepClock:
    """Clock that advances only in `step`, `sleep` and `sleep_until`.

    Args:
        start: first reading [ns].
    """

    __slots__ = ("_now",)

    def __init__(self, start: int = 0) -> None:
        self._now = start

    def nanos(self) -> int:
        """Read the time [ns]."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Advance the clock instead of waiting."""
        self.step(seconds)

    def sleep_until(self, nanos: int) -> None:
        """Advance the clock instead of waiting."""
        self._now = max(self._now, nanos)

    def step(self, seconds: float) -> None:
        """Advance the clock [s]."""
        self._now += max(0, round(seconds * 1e9))
