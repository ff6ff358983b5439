"""Measure a quantity and its floor alternately, in blocks, with the same placement on the processors."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bench.measure.figure import Figure
from bench.measure.noise import Noise

#: Processors that this process had when it was started; pinning takes some away.
PROCESSORS = tuple(sorted(os.sched_getaffinity(0)))
#: Blocks of each placement; more of them settle a figure that five leave undecided.
BLOCKS = max(5, int(os.environ.get("BENCH_BLOCKS", "5")))
#: A block is noisy, too, if its floor is this many times the median floor of its placement.
HIGH_FLOOR = 1.5

Measure = Callable[[], Sequence[float]]


@dataclass(frozen=True)
class Placement:
    """Where the processes of a measurement may run.

    Attributes:
        name: "one_core" or "two_cores".
        near: processors of this process, which measures.
        far: processors of the processes that serve it.
    """

    name: str
    near: frozenset[int]
    far: frozenset[int]


def placements() -> list[Placement]:
    """Everything on one processor; then, if there are two, both sides on one each."""
    first, last = frozenset(PROCESSORS[:1]), frozenset(PROCESSORS[-1:])
    two = [Placement("two_cores", first, last)] if first != last else []
    return [Placement("one_core", last, last), *two]


def pin(process: int, processors: frozenset[int]) -> None:
    """Keep all threads of a process on some processors; threads that they start later inherit that."""
    for _ in range(2):  # a thread may have been started during the first pass
        for task in Path(f"/proc/{process}/task").iterdir():
            with contextlib.suppress(ProcessLookupError):
                os.sched_setaffinity(int(task.name), processors)


@contextlib.contextmanager
def placed() -> Iterator[None]:
    """Give this process its processors back afterwards."""
    before = os.sched_getaffinity(0)
    try:
        yield
    finally:
        pin(os.getpid(), frozenset(before))


@dataclass
class Comparison:
    """A quantity and its floor under one placement, block by block.

    Attributes:
        placement: of both.
        cap: sample that stands for an answer that never came; a floor as high as that shows nothing.
        values: samples of each block.
        floors: the same of the floor.
        noise: of each block.
    """

    placement: Placement
    cap: float = math.inf
    values: list[npt.NDArray[np.float64]] = field(default_factory=list)
    floors: list[npt.NDArray[np.float64]] = field(default_factory=list)
    noise: list[Noise] = field(default_factory=list)

    def add(self, values: Sequence[float], floors: Sequence[float], noise: Noise) -> None:
        """Append a block."""
        self.values.append(np.asarray(values, dtype=np.float64))
        self.floors.append(np.asarray(floors, dtype=np.float64))
        self.noise.append(noise)

    def figure(
        self,
        name: str,
        percentile: float,
        unit: str,
        *,
        limit: float | None = None,
        scale: float = 1.0,
        detail: dict[str, Any] | None = None,
    ) -> Figure:
        """A percentile of both sides, the median over the blocks, and the ratio of each block.

        Args:
            name: without the placement, which is appended.
            percentile: 50 for the median.
            unit: of the figure.
            limit: of the ratio.
            scale: from the samples' unit to the figure's.
            detail: further facts.
        """
        values = np.array([np.percentile(value, percentile) for value in self.values]) * scale
        floors = np.array([np.percentile(floor, percentile) for floor in self.floors]) * scale
        high = (floors > HIGH_FLOOR * np.median(floors)) | (floors >= self.cap * scale)
        facts = {
            "samples": [sum(map(len, self.values)), sum(map(len, self.floors))],
            "others": round(max(one.others for one in self.noise), 2),
            "stolen": round(max(one.stolen for one in self.noise), 2),
        }
        if any(one.stalled for one in self.noise):
            facts["stalled"] = [round(one.stalled, 4) for one in self.noise]
        # where the machine by itself makes more late than the percentile leaves out, it decides
        rare = 1.0 - percentile / 100.0
        return Figure(
            f"{name}_{self.placement.name}",
            float(np.median(values)),
            unit,
            limit=limit,
            reference=float(np.median(floors)),
            ratios=tuple((values / floors).tolist()),
            noisy=tuple(
                k for k, one in enumerate(self.noise) if one.is_noisy or high[k] or one.stalled > rare
            ),
            detail=facts | (detail or {}),
        )


def by_turns(
    value: Measure,
    floor: Measure,
    place: Callable[[Placement], None],
    *,
    where: Sequence[Placement] | None = None,
    blocks: int = BLOCKS,
    warm_up: int = 1,
    stalled: Callable[[], float] | None = None,
) -> list[Comparison]:
    """Measure a quantity and its floor by turns, in blocks, under each placement.

    Args:
        value: one block of the quantity.
        floor: one block of its floor.
        place: pins the processes that serve; this process is pinned here.
        where: placements; every one unless given.
        blocks: of each placement.
        warm_up: blocks before them that do not count.
        stalled: measures before each block how often the machine by itself is late, see `stalls.stalled`.
    """
    found = [Comparison(placement) for placement in where or placements()]
    with placed():
        for number in range(-warm_up, blocks):
            for one in found:
                pin(os.getpid(), one.placement.near)
                place(one.placement)
                by_itself = 0.0 if stalled is None else stalled()
                with Noise(stalled=by_itself) as noise:
                    if number % 2:  # the order alternates, so that a drift affects both sides equally
                        values, floors = value(), floor()
                    else:
                        floors, values = floor(), value()
                if number >= 0:
                    one.add(values, floors, noise)
    return found
