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
        measured: processes that belong to the measurement, with their descendants, besides this one.
    """

    others: float = 0.0
    stolen: float = 0.0
    measured: tuple[int, ...] = ()

    def __enter__(self) -> Noise:
        self._began = time.monotonic()
        self._busy, self._stolen = _busy()
        self._own = _own(self.measured)
        return self

    def __exit__(self, *_: object) -> None:
        busy, stolen = _busy()
        ticks = max(1.0, (time.monotonic() - self._began) * os.sysconf("SC_CLK_TCK"))
        self.others = max(0.0, (busy - self._busy - (_own(self.measured) - self._own)) / ticks)
        self.stolen = (stolen - self._stolen) / ticks

    @property
    def is_noisy(self) -> bool:
        """Whether others took too much."""
        return self.others + self.stolen > OTHERS


def _busy() -> tuple[int, int]:
    """Time that processes have run, and time that the host has kept [clock ticks]."""
    fields = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:]]
    return sum(fields[:3]), fields[7]


def _own(measured: tuple[int, ...]) -> int:
    """Time that this process, those given, and the descendants of all of them have run [clock ticks]."""
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
        total += times[number] if above else 0
    return total
