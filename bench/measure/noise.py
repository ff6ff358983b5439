"""Processor time taken by others during a measurement: other processes, and the host of a virtual machine."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass
from pathlib import Path

#: A measurement is noisy if other processes and the host together take more than this, in processors.
OTHERS = 0.1


@dataclass
class Noise:
    """Measures the processor time that others take during a `with` block.

    Attributes:
        others: processors that processes other than those measured took.
        stolen: processors that the machine's host kept to itself.
        stalled: fraction of wake-ups for which the machine by itself is late, see `stalls.stalled`.
        measured: processes that belong to the measurement, with their descendants, besides this one.
    """

    others: float = 0.0
    stolen: float = 0.0
    stalled: float = 0.0
    measured: tuple[int, ...] = ()

    def __enter__(self) -> Noise:
        self._began = time.monotonic()
        self._others, self._stolen = _others(self.measured), _stolen()
        return self

    def __exit__(self, *_: object) -> None:
        ticks = max(1.0, (time.monotonic() - self._began) * os.sysconf("SC_CLK_TCK"))
        self.others = max(0.0, (_others(self.measured) - self._others) / ticks)
        self.stolen = (_stolen() - self._stolen) / ticks

    @property
    def is_noisy(self) -> bool:
        """Whether others took too much."""
        return self.others + self.stolen > OTHERS


def _stolen() -> int:
    """Time that the host has kept [clock ticks]."""
    return int(Path("/proc/stat").read_text().splitlines()[0].split()[8])


def _others(measured: tuple[int, ...]) -> int:
    """Time that all processes have run but this one, those given, and the descendants of all of them [clock ticks].

    Not the machine's busy time in /proc/stat: Linux samples that 250 times a second, and a load of 1 kHz is then always
    seen at the same phase.
    """
    times, parents = {}, {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = entry.read_text().rsplit(")", 1)[1].split()
            number = int(entry.parent.name)
            parents[number] = int(fields[1])
            times[number] = sum(map(int, fields[11:15]))  # those of children that have ended included
    roots, total = {os.getpid(), *measured}, 0
    for number in times:
        above = number
        while above and above not in roots:
            above = parents.get(above, 0)
        total += 0 if above else times[number]
    return total
