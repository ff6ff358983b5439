"""A recording of all groups at 1 kHz while the arm moves, beside the same loop without a recorder."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, Placement, by_turns, pin
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.state.push import States
from heptarm.values.state import GROUP_NAMES

#: Seconds that are recorded, and as many without a recorder, over all blocks; LONG=1: ten minutes.
SECONDS = float(os.environ.get("BENCH_SECONDS", "600" if os.environ.get("LONG") else "60")) / 2
RATE = 1000
#: Largest factor on the age of the states in the user's loop.
LIMIT = 1.05


class RecordedBlocks:
    """Blocks of states, with a recorder and without, and what the recordings contain.

    Args:
        arm: that moves.
        folder: for the files.
        seconds: of a block.
    """

    def __init__(self, arm: ha.Arm, folder: Path, seconds: float) -> None:
        self._arm, self._folder = arm, folder
        self._states = States(arm, seconds)
        self.files: list[Path] = []
        self.lost = 0
        self.processor = {"with": 0.0, "without": 0.0}
        self.time = {"with": 0.0, "without": 0.0}

    def recorded(self) -> list[float]:
        """Ages of the states of a block that is recorded [s]."""
        self.files.append(self._folder / f"{len(self.files)}.mcap")
        with self._arm.record(self.files[-1]) as recorder:
            ages = self._block("with")
        self.lost += recorder.lost
        return ages

    def bare(self) -> list[float]:
        """Ages of the states of a block that is not [s]."""
        return self._block("without")

    def _block(self, kind: str) -> list[float]:
        began, used = time.monotonic(), time.process_time()
        ages = self._states.block()
        self.time[kind] += time.monotonic() - began
        self.processor[kind] += time.process_time() - used
        return ages

    def load(self, kind: str) -> float:
        """Processors that this process used."""
        return self.processor[kind] / self.time[kind]


@benchmark("record")
def record() -> Iterator[Figure]:
    """All groups recorded at 1 kHz: what is lost, the age of states beside the recorder, size and processor time."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Cabinet() as cabinet,
        ha.connect(cabinet.target, state_rate=RATE, groups=GROUP_NAMES) as arm,
    ):
        arm.speed = 0.3
        there, back = (
            ha.ptp(ha.deg(30, 40, 10, -70, 20, 60, 30)),
            ha.ptp(ha.deg(-30, 20, -10, -100, -20, 50, -30)),
        )
        handle = arm.start(
            [there, back] * min(450, int(SECONDS + 20))
        )  # longer than the run; closing stops it
        blocks = RecordedBlocks(arm, Path(folder), SECONDS / BLOCKS)

        def place(placement: Placement) -> None:
            pin(cabinet.process.pid, placement.far)

        found = by_turns(blocks.recorded, blocks.bare, place)
        handle.cancel()
        runs = [ha.load(one) for one in blocks.files]
        size = sum(one.stat().st_size for one in blocks.files)
    states = sum(map(len, runs))
    missing = sum(len(np.setdiff1d(_ticks(run), run["stamp"] // 1_000_000)) for run in runs)
    cut = sum(not run.complete for run in runs)
    noisy = any(one.is_noisy for comparison in found for one in comparison.noise)
    detail = {"states": states, "not_pushed": missing, "files_cut_off": cut}
    yield Figure("record_lost", blocks.lost + cut, "count", limit=0, disturbed=noisy, detail=detail)
    for comparison in found:
        yield comparison.figure("record_age", 50, "us", limit=LIMIT, scale=1e6)
        yield comparison.figure("record_age_p99", 99, "us", scale=1e6)
    yield Figure(
        "record_size", size / max(1, states), "bytes", detail={"mb_per_minute": size / states * RATE * 60e-6}
    )
    more = blocks.load("with") - blocks.load("without")
    yield Figure(
        "record_processor", more, "fraction", detail={kind: blocks.load(kind) for kind in blocks.time}
    )


def _ticks(run: ha.Recording) -> np.ndarray:
    """Every millisecond between the first and the last state."""
    return np.arange(run["stamp"][0] // 1_000_000, run["stamp"][-1] // 1_000_000)
