"""What a guard has limited: counts and extremes, and the same as text."""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod


class GuardReport(ABC):
    """Counts and extremes of what a guard has limited; the first kind counts targets that are not finite.

    Args:
        kinds: of what is limited.
        parts: number of axes, or of other parts that are limited by themselves.

    Attributes:
        counts: cycles, by kind and part, shape [kinds][parts].
        worst: largest requested magnitude, by kind and part.
        allowed: largest magnitude allowed at that time.
    """

    __slots__ = ("_kinds", "allowed", "counts", "worst")

    def __init__(self, kinds: type[enum.IntEnum], parts: int) -> None:
        self._kinds = kinds
        self.counts = [[0] * parts for _ in kinds]
        self.worst = [[0.0] * parts for _ in kinds]
        self.allowed = [[0.0] * parts for _ in kinds]

    def add(self, kind: int, part: int, asked: float, allowed: float) -> None:
        """Count a part that was limited in one cycle."""
        self.counts[kind][part] += 1
        if abs(asked) >= self.worst[kind][part]:
            self.worst[kind][part], self.allowed[kind][part] = abs(asked), abs(allowed)

    @property
    def lines(self) -> list[str]:
        """One line of text for each kind and part that was limited."""
        found = []
        for kind in self._kinds:
            for part, count in enumerate(self.counts[kind]):
                if not count:
                    continue
                where, unit = self._named(kind, part)
                cycles = f"{count} cycle{'s' * (count != 1)}"
                if kind == 0:
                    found.append(f"{where}: target not finite in {cycles}; the last one was kept")
                    continue
                found.append(
                    f"{where}: {kind.name.lower().replace('_', ' ')} limited in {cycles}: "
                    f"{self.worst[kind][part]:.4g} {unit} requested, {self.allowed[kind][part]:.4g} allowed"
                )
        return found

    @abstractmethod
    def _named(self, kind: int, part: int) -> tuple[str, str]:
        """What is limited, and its unit."""
