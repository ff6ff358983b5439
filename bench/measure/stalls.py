"""Stalls of the machine, measured by a bare realtime thread on each processor: the floor of all timing."""

from __future__ import annotations

import atexit
import os
import subprocess
import tempfile
import time
from functools import cache
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

from bench.measure.compiler import compiled

#: Shorter stalls are not recorded [s].
SHORTEST = 0.5e-3
#: A wake-up that is so late counts for `stalled` [s], which watches for so long [s].
LATE, WATCH = 0.1e-3, 0.5
#: Time between two wake-ups of the program [s].
STEP = 0.5e-3


def stalled() -> float:
    """Fraction of the wake-ups of a bare real-time thread that are late on this machine, beside nothing else."""
    with Stalls(LATE) as stalls:
        time.sleep(WATCH)
    return len(stalls.lengths) * STEP / (os.sysconf("SC_NPROCESSORS_ONLN") * WATCH)


@cache
def _program() -> Path:
    """Compile the program once."""
    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    return compiled(Path(__file__).with_name("stalls.c"), Path(folder.name))


class Stalls:
    """Watches for stalls in a `with` block.

    Args:
        shortest: that is recorded [s].

    Attributes:
        starts: when a processor should have run on, shape (n,) [ns of the monotonic clock].
        lengths: for how long it did not, shape (n,) [s]; both are complete after the block.
    """

    def __init__(self, shortest: float = SHORTEST) -> None:
        self._process = subprocess.Popen(
            [str(_program()), str(round(shortest * 1e6))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"
        self.starts: npt.NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.lengths: npt.NDArray[np.float64] = np.zeros(0)

    def during(
        self, times: npt.NDArray[np.int64], *, before: float, after: float, longer: float
    ) -> npt.NDArray[np.bool_]:
        """Whether times are in a stall, or near one.

        Args:
            times: shape (n,) [ns of the monotonic clock].
            before: what lies so long before a stall counts as within [s]; `after` likewise.
            after: see `before`.
            longer: shorter stalls do not count [s].
        """
        within = np.zeros(len(times), dtype=np.bool_)
        for start, length in zip(self.starts, self.lengths, strict=True):
            if length >= longer:
                within |= (times > start - before * 1e9) & (times < start + (length + after) * 1e9)
        return within

    def __enter__(self) -> Stalls:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        output, _ = self._process.communicate()
        numbers = np.array([line.split() for line in output.splitlines()], dtype=np.int64).reshape(-1, 2)
        numbers = numbers[np.argsort(numbers[:, 0])]
        self.starts, self.lengths = numbers[:, 0], numbers[:, 1].astype(np.float64) * 1e-9
