"""A recording of all groups at 1 kHz while the arm moves, beside the same loop without a recorder."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, Placement, by_turns, pin
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.state.push import States
from heptarm.values.state import GROUP_NAMES

#: Seconds that are recorded, and as many without a recorder, over all blocks of a placement.
SECONDS = float(os.environ.get("BENCH_SECONDS", "60")) / 2
#: Seconds of one more recording, without a break.
WHOLE = 600.0 if os.environ.get("LONG") else 0.0
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
        self._block_states = States(seconds)
        self.files: list[Path] = []
        self.lost = 0
        self.processor = {"with": 0.0, "without": 0.0}
        self.time = {"with": 0.0, "without": 0.0}

    def recorded(self) -> list[float]:
        """Ages of the states of a block that is recorded [s]."""
        with self._recording():
            return self._block("with")

    def whole(self, seconds: float) -> list[float]:
        """Ages of the states of a longer recording, which counts among the files but not as a block [s]."""
        with self._recording():
            return States(seconds).block(self._arm)

    def bare(self) -> list[float]:
        """Ages of the states of a block that is not [s]."""
        return self._block("without")

    @contextmanager
    def _recording(self) -> Iterator[None]:
        self.files.append(self._folder / f"{len(self.files)}.mcap")
        with self._arm.record(self.files[-1]) as recorder:
            yield
        self.lost += recorder.lost

    def _block(self, kind: str) -> list[float]:
        began, used = time.monotonic(), time.process_time()
        ages = self._block_states.block(self._arm)
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
        count = min(450, int(SECONDS + WHOLE + 20))
        handle = arm.start([there, back] * count)  # longer than the run; closing stops it
        blocks = RecordedBlocks(arm, Path(folder), SECONDS / BLOCKS)

        def place(placement: Placement) -> None:
            pin(cabinet.process.pid, placement.far)

        found = by_turns(blocks.recorded, blocks.bare, place)
        ages = blocks.whole(WHOLE) if WHOLE else []
        handle.cancel()
        contents = [_content(one) for one in blocks.files]
        size = sum(one.stat().st_size for one in blocks.files)
    states = sum(one.states for one in contents)
    missing = sum(one.missing for one in contents)
    cut = sum(one.is_cut for one in contents)
    noisy = any(one.is_noisy for comparison in found for one in comparison.noise)
    detail: dict[str, object] = {"states": states, "not_pushed": missing, "files_cut_off": cut}
    if ages:
        p50, p99 = np.percentile(ages, (50, 99)) * 1e6
        detail |= {
            "without_a_break": contents[-1].states,
            "age_us": [round(float(p50), 1), round(float(p99), 1)],
        }
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


@dataclass(frozen=True)
class FileContent:
    """What a file contains.

    Attributes:
        states: in it.
        missing: milliseconds between its first and its last state that have none.
        is_cut: it has no end.
    """

    states: int
    missing: int
    is_cut: bool


def _content(file: Path) -> FileContent:
    run = ha.load(file)
    at = run["stamp"] // 1_000_000
    missing = len(np.setdiff1d(np.arange(at[0], at[-1]), at))
    return FileContent(len(run), missing, not run.complete)
