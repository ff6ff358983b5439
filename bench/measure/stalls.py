"""When the machine stood still, as a bare real-time thread on each processor felt it: the floor of all punctuality."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

from bench.compiler import compiled

#: What is shorter is not kept [s].
SHORTEST = 0.5e-3


class Stalls:
    """Watches in a `with` block; afterwards it knows.

    Attributes:
        starts: when a processor should have gone on, shape (n,) [ns of the monotonic clock].
        lengths: for how long it did not, shape (n,) [s].
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        program = compiled(Path(__file__).with_name("stalls.c"), Path(self._folder.name))
        self._process = subprocess.Popen(
            [str(program), str(round(SHORTEST * 1e6))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"
        self.starts = np.zeros(0, dtype=np.int64)
        self.lengths = np.zeros(0)

    def during(
        self, times: npt.NDArray[np.int64], *, before: float, after: float, longer: float
    ) -> npt.NDArray[np.bool_]:
        """Which times lie in a stall, or near it.

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
        told, _ = self._process.communicate()
        numbers = np.array([line.split() for line in told.splitlines()], dtype=np.int64).reshape(-1, 2)
        numbers = numbers[np.argsort(numbers[:, 0])]
        self.starts, self.lengths = numbers[:, 0], numbers[:, 1] * 1e-9
        self._folder.cleanup()
