"""Counters and histograms of a client; their words may be in shared memory."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import Protocol

#: Number of bins of a histogram, one microsecond each; the last one holds all longer durations.
BINS = 16_384
#: Upper bound of a recorded duration [ns].
LONGEST = 10**15


class Words(Protocol):
    """Integer words of an array or of shared memory."""

    def __getitem__(self, index: int, /) -> int: ...

    def __setitem__(self, index: int, value: int, /) -> None: ...

    def __iter__(self) -> Iterator[int]: ...


class Counters:
    """Counts of one client over all its sessions.

    Attributes:
        received: legal monitoring messages.
        answered: commands sent.
        lost: monitoring messages that did not arrive, by the controller's counter.
        duplicated: messages received twice; the second one is not answered.
        reordered: messages received after a later one; they are not answered.
        malformed: datagrams that are no legal message of this version.
        missed: answers that the controller did not receive in time, by its reflected counter.
        restarts: restarts of the controller's counter.
        poor, fair, good, excellent: messages with that quality.
        commanded: answers in COMMANDING_ACTIVE.
        filled: of those, answers made by the policy because there was no fresh command.
        limited: of those, answers in which the guard changed something.
    """

    __slots__ = (
        "answered",
        "commanded",
        "duplicated",
        "excellent",
        "fair",
        "filled",
        "good",
        "limited",
        "lost",
        "malformed",
        "missed",
        "poor",
        "received",
        "reordered",
        "restarts",
    )

    received: int
    answered: int
    lost: int
    duplicated: int
    reordered: int
    malformed: int
    missed: int
    restarts: int
    poor: int
    fair: int
    good: int
    excellent: int
    commanded: int
    filled: int
    limited: int

    def __init__(self) -> None:
        for name in self.__slots__:
            setattr(self, name, 0)

    def save(self, words: Words, at: int) -> None:
        """Write the counts to integer words, in the order of `COUNTERS`."""
        for index, name in enumerate(COUNTERS):
            words[at + index] = getattr(self, name)

    def load(self, words: Words, at: int) -> None:
        """Read the counts from integer words, in the order of `COUNTERS`."""
        for index, name in enumerate(COUNTERS):
            setattr(self, name, int(words[at + index]))

    def as_dict(self) -> dict[str, int]:
        """Get all counts by name."""
        return {name: getattr(self, name) for name in COUNTERS}


#: Order of the counts in memory, in Python and C.
COUNTERS = (
    "received",
    "answered",
    "lost",
    "duplicated",
    "reordered",
    "malformed",
    "missed",
    "restarts",
    "poor",
    "fair",
    "good",
    "excellent",
    "commanded",
    "filled",
    "limited",
)


class Histogram:
    """Histogram of durations with bins of one microsecond.

    Args:
        words: BINS + 1 integer words, the last one being the longest duration [ns]; None allocates them.
    """

    __slots__ = ("_words",)

    def __init__(self, words: Words | None = None) -> None:
        self._words: Words = array("q", bytes(8 * (BINS + 1))) if words is None else words

    def add(self, nanos: int) -> None:
        """Count one duration [ns]; negative ones count as zero."""
        micros = nanos // 1000 if nanos > 0 else 0
        self._words[micros if micros < BINS else BINS - 1] += 1
        if nanos > self._words[BINS]:
            self._words[BINS] = min(nanos, LONGEST)

    @property
    def longest(self) -> float:
        """Longest duration [s]."""
        return self._words[BINS] * 1e-9

    def percentiles(self, *fractions: float) -> tuple[float, ...]:
        """Percentiles of the durations [s] for fractions of 0 to 1; zeros if nothing was counted.

        The resolution is a microsecond; beyond the bins the result is the longest duration.
        """
        counts = list(self._words)[:BINS]
        total = sum(counts)
        found = []
        for fraction in fractions:
            needed, seen = fraction * total, 0
            for index, count in enumerate(counts):
                seen += count
                if seen >= needed and seen:
                    found.append(self.longest if index == BINS - 1 else (index + 0.5) * 1e-6)
                    break
            else:
                found.append(0.0)
        return tuple(found)

    def clear(self) -> None:
        """Reset all bins."""
        for index in range(BINS + 1):
            self._words[index] = 0
