"""Stalls of the machine, measured by a bare realtime thread on each processor: the floor of all timing."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

from bench.measure.compiler import compiled

#: Shorter stalls are not recorded [s].
SHORTEST = 0.5e-3


class Stalls:
    """Watches for stalls in a `with` block.

    Attributes:
        starts: when a processor should have run on, shape (n,) [ns of the monotonic clock].
        lengths: for how long it did not, shape (n,) [s]; both are complete after the block.
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
        self.starts, self.lengths = numbers[:, 0], numbers[:, 1] * 1e-9
        self._folder.cleanup()
