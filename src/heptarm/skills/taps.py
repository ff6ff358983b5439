"""Taps: short forces on an arm at rest, as distinct from pushes and from a constant load."""

from __future__ import annotations

from math import nan

import numpy as np

from heptarm.values.checks import Array, within


class TapCounter:
    """Counts taps: short forces in quick succession.

    Args:
        force: least force of a tap [N].
        longest: longest duration of a tap [s].
        gap: longest time between two taps of a series [s].

    Attributes:
        count: taps of the current series.
    """

    def __init__(self, *, force: float, longest: float = 0.4, gap: float = 1.0) -> None:
        self._force, self._longest, self._gap = force, longest, gap
        self._rose = nan
        self._last = nan
        self.count = 0

    def see(self, time: float, strength: float) -> int:
        """Process a force.

        Args:
            time: of the measurement [s].
            strength: magnitude without the constant force [N].

        Returns:
            Taps of the current series; a pause or a long push starts a new one.
        """
        if self.count and self._rose != self._rose and time - self._last > self._gap:
            self.count = 0
        if self._rose != self._rose and strength >= self._force:
            self._rose = time
        elif self._rose == self._rose and strength < 0.5 * self._force:
            short = time - self._rose <= self._longest
            self.count = self.count + 1 if short else 0
            self._rose, self._last = nan, time
        return self.count


class TapWatch:
    """Counts taps on an arm at rest by the external force.

    A constant force is not a tap: the bias starts as the mean of the first forces and follows slow changes.

    Args:
        force: least force of a tap [N].
        gap: longest time between two taps of a series [s].

    Raises:
        LimitError: a value outside its range.
    """

    #: Number of first forces whose mean is the initial bias.
    SAMPLES = 8
    #: Largest threshold [N].
    STRONGEST = 500.0
    #: Time constant of the bias [s].
    LASTING = 3.0

    def __init__(self, *, force: float = 8.0, gap: float = 1.0) -> None:
        strong = within(force, "force", 0.0, self.STRONGEST, above=True, unit="N")
        self._taps = TapCounter(force=strong, gap=within(gap, "gap", 0.0, 60.0, above=True, unit="s"))
        self._first: list[Array] = []
        self._bias = np.zeros(3)
        self._last = nan

    def see(self, time: float, force: Array) -> int:
        """Process a force.

        Args:
            time: of the measurement [s].
            force: external force on the robot in axes at rest, shape (3,) [N].

        Returns:
            Taps of the current series; 0 for the first forces.
        """
        if len(self._first) < self.SAMPLES:
            self._first.append(force)
            self._bias, self._last = np.mean(self._first, axis=0), time
            return 0
        self._bias = self._bias + (force - self._bias) * min(1.0, (time - self._last) / self.LASTING)
        self._last = time
        return self._taps.see(time, float(np.linalg.norm(force - self._bias)))
