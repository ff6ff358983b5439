"""Figures and the benchmarks that make them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Figure:
    """One measured number beside what is promised.

    `limit` bounds `ratio` where there is a reference, otherwise `value`; "at least" figures carry
    `least=True`. A figure without a limit is reported only.
    """

    name: str
    line: str
    value: float
    unit: str
    limit: float | None = None
    reference: float | None = None
    least: bool = False
    detail: dict[str, Any] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        return None if not self.reference else self.value / self.reference

    @property
    def ok(self) -> bool:
        if self.limit is None:
            return True
        measured = self.value if self.ratio is None else self.ratio
        return bool(measured >= self.limit if self.least else measured <= self.limit)

    def as_dict(self) -> dict[str, Any]:
        ratio = self.ratio
        return {
            "name": self.name,
            "line": self.line,
            "value": float(f"{self.value:.6g}"),
            "unit": self.unit,
            "reference": self.reference if self.reference is None else float(f"{self.reference:.6g}"),
            "ratio": ratio if ratio is None else round(ratio, 4),
            "limit": self.limit,
            "ok": self.ok,
            **({"detail": self.detail} if self.detail else {}),
        }


@dataclass(frozen=True)
class Benchmark:
    line: str
    doc: str
    run: Callable[[], Iterator[Figure]]


BENCHMARKS: dict[str, Benchmark] = {}


def benchmark(
    name: str, line: str
) -> Callable[[Callable[[], Iterator[Figure]]], Callable[[], Iterator[Figure]]]:
    """Register a benchmark under a name."""

    def register(function: Callable[[], Iterator[Figure]]) -> Callable[[], Iterator[Figure]]:
        BENCHMARKS[name] = Benchmark(line, (function.__doc__ or "").strip().splitlines()[0], function)
        return function

    return register
