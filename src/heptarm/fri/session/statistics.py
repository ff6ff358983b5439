"""What a client counts and measures of its own exchange; times are passed in, the words may live in shared memory."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import Protocol

#: Histograms have bins of one microsecond; the last one takes all that is longer.
BINS = 16_384
#: Longest duration that is told apart [ns].
LONGEST = 10**15


class Words(Protocol):
    """Integer words, of an array or of shared memory."""

    def __getitem__(self, index: int, /) -> int: ...

    def __setitem__(self, index: int, value: int, /) -> None: ...

    def __iter__(self) -> Iterator[int]: ...


class Counters:
    """Plain counts of one client, over all its sessions.

    Attributes:
        received: legal monitoring messages.
        answered: commands sent.
        lost: monitoring messages that never came, told from the controller's counter.
        duplicated: messages that came twice; the second one is not answered.
        reordered: messages overtaken by a later one; they are not answered.
        malformed: datagrams that are no legal message of this version.
        missed: answers that the controller did not take in time, late or lost, told from its reflected counter.
        restarts: times the controller's counter began anew.
        poor, fair, good, excellent: messages that named that quality.
        commanded: answers in COMMANDING_ACTIVE.
        filled: of those, answers without a fresh command of the user, made by the policy.
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
        """Write the counts into integer words, in the order of `COUNTERS`."""
        for index, name in enumerate(COUNTERS):
            words[at + index] = getattr(self, name)

    def load(self, words: Words, at: int) -> None:
        """Take the counts from integer words, in the order of `COUNTERS`."""
        for index, name in enumerate(COUNTERS):
            setattr(self, name, int(words[at + index]))

    def as_dict(self) -> dict[str, int]:
        """All counts by name."""
        return {name: getattr(self, name) for name in COUNTERS}


#: Order of the counts in memory; the native loop has the same.
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
    """Counts durations in bins of one microsecond.

    Args:
        words: BINS + 1 integer words, the last one being the longest duration [ns]; None for own memory.
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
        """The longest duration [s]."""
        return self._words[BINS] * 1e-9

    def percentiles(self, *shares: float) -> tuple[float, ...]:
        """Durations [s] that these shares (0 to 1) stay below; zeros if nothing was counted.

        Resolution is a microsecond; what is beyond the bins answers with the longest duration.
        """
        counts = list(self._words)[:BINS]
        total = sum(counts)
        found = []
        for share in shares:
            wanted, seen = share * total, 0
            for index, count in enumerate(counts):
                seen += count
                if seen >= wanted and seen:
                    found.append(self.longest if index == BINS - 1 else (index + 0.5) * 1e-6)
                    break
            else:
                found.append(0.0)
        return tuple(found)

    def clear(self) -> None:
        """Forget everything."""
        for index in range(BINS + 1):
            self._words[index] = 0
