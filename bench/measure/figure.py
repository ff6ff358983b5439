"""The figure record, and the registry of benchmarks."""

from __future__ import annotations

import math
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

from bench.measure.noise import Noise
from heptarm.errors import HeptarmError

ROOT = Path(__file__).resolve().parents[2]
#: Errors that a busy machine can cause; any other is a defect.
LATE = (HeptarmError, TimeoutError)


@dataclass(frozen=True)
class Figure:
    """A measured number beside its floor and its limit.

    `limit` bounds `ratio` where there is a floor, otherwise `value`; it is an upper bound unless `at_least` is set. A
    figure without a limit is reported only.

    Attributes:
        name: unique among all figures.
        value: NaN if nothing could be measured.
        unit: of the value, such as "us"; "fraction" for a number from 0 to 1, "count" for a number of things.
        limit: bound of the ratio or of the value.
        reference: the floor, measured in the same run.
        ratios: value by floor, block by block.
        noisy: numbers of the blocks that something else on the machine disturbed; they count like the others.
        disturbed: the machine disturbed a figure that has no blocks: a missed limit then decides nothing.
        at_least: `limit` is a lower bound.
        detail: further facts.
        group: of its benchmark; the registry fills it in.
    """

    name: str
    value: float
    unit: str
    limit: float | None = None
    reference: float | None = None
    ratios: tuple[float, ...] = ()
    noisy: tuple[int, ...] = ()
    disturbed: bool = False
    at_least: bool = False
    detail: dict[str, Any] = field(default_factory=dict)
    group: str = ""

    @property
    def ratio(self) -> float | None:
        """Median over the blocks; without blocks the value by its floor."""
        if self.ratios:
            return median(self.ratios)
        return self.value / self.reference if self.reference else None

    @property
    def ok(self) -> bool | None:
        """Whether the limit is met; None if this run cannot decide that.

        The middle half of the blocks has to lie on one side of the limit, and most blocks have to be undisturbed: no
        single block decides, nothing passes by luck, nothing fails because the machine was busy.
        """
        if math.isnan(self.value):
            return None if self.disturbed else False
        if self.limit is None:
            return True
        if not self.ratios:
            return self._meets(self.value if self.ratio is None else self.ratio) or (
                None if self.disturbed else False
            )
        if 2 * len(self.noisy) > len(self.ratios):
            return None
        ordered = sorted(self.ratios)
        quarter = len(ordered) // 4
        verdicts = {self._meets(ordered[quarter]), self._meets(ordered[-1 - quarter])}
        return verdicts.pop() if len(verdicts) == 1 else None

    def _meets(self, measured: float) -> bool:
        assert self.limit is not None
        return bool(measured >= self.limit if self.at_least else measured <= self.limit)

    def as_dict(self) -> dict[str, Any]:
        """The record that is printed and stored."""
        record: dict[str, Any] = {
            "name": self.name,
            "group": self.group,
            "value": _short(self.value),
            "unit": self.unit,
            "reference": _short(self.reference),
            "ratio": _short(self.ratio, 4),
            "limit": self.limit,
            "ok": self.ok,
        }
        if self.at_least:
            record["at_least"] = True
        if self.disturbed:
            record["disturbed"] = True
        if self.ratios:
            record["blocks"] = [_short(ratio, 4) for ratio in self.ratios]
            record["noisy"] = list(self.noisy)
        if self.detail:
            record["detail"] = self.detail
        return record


def _short(value: float | None, digits: int = 6) -> float | None:
    """A number as it is printed; None for what JSON cannot hold."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.{digits}g}")


@dataclass(frozen=True)
class Benchmark:
    """A function that measures some figures.

    Attributes:
        group: the folder that it lies in.
        doc: what it measures, in a line.
        run: measures, figure by figure.
    """

    name: str
    group: str
    doc: str
    run: Callable[[], Iterator[Figure]]

    def figures(self) -> Iterator[Figure]:
        """Run it; what fails is a figure, too, behind those that were measured before."""
        noise = Noise()
        try:
            with noise:
                for figure in self.run():
                    yield replace(figure, group=self.group)
        except Exception as error:
            traceback.print_exc()
            text = f"{type(error).__name__}: {error}".replace(str(ROOT), ".").replace(
                tempfile.gettempdir(), "TMP"
            )
            detail = {"error": text[:500], "others": round(noise.others, 2)}
            yield Figure(
                f"{self.name}_failed",
                math.nan,
                "",
                disturbed=noise.is_noisy and isinstance(error, LATE),
                detail=detail,
                group=self.group,
            )


BENCHMARKS: dict[str, Benchmark] = {}


def benchmark(name: str) -> Callable[[Callable[[], Iterator[Figure]]], Callable[[], Iterator[Figure]]]:
    """Register a benchmark; its group is the folder of its module."""

    def register(function: Callable[[], Iterator[Figure]]) -> Callable[[], Iterator[Figure]]:
        assert name not in BENCHMARKS, name
        group = function.__module__.split(".")[1]
        BENCHMARKS[name] = Benchmark(name, group, (function.__doc__ or "").strip().splitlines()[0], function)
        return function

    return register
