"""Bands that a measured number may leave: checks and words."""

from __future__ import annotations

from heptarm.errors import LimitError
from heptarm.values.arrays import within


def check_band(low: float, high: float, limit: float, unit: str) -> None:
    """Refuse a band that is none, or lies outside what can be asked for.

    Raises:
        LimitError: see above.
    """
    within(low, "low", -limit, limit, unit=unit)
    within(high, "high", -limit, limit, unit=unit)
    if not low < high:
        raise LimitError(
            f"low is {low:g} {unit}, high is {high:g} {unit}; low has to be below high",
            code=2,
            parameter="low",
            value=low,
            allowed=f"below {high:g} {unit}",
        )


def band_text(low: float, high: float, limit: float, unit: str) -> str:
    """What lies outside a band, in words; a bound at the limit is none."""
    if low <= -limit:
        return f"> {high:g} {unit}"
    if high >= limit:
        return f"< {low:g} {unit}"
    return f"outside [{low:g}, {high:g}] {unit}"
