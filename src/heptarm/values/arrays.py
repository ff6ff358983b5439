"""Checked, read-only arrays: the one way by which numbers of a user become numbers of heptarm."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError

Array: TypeAlias = npt.NDArray[np.float64]


def array(value: npt.ArrayLike, size: int, name: str, *, nan: bool = False) -> Array:
    """A read-only copy of `value`, shape (size,).

    Args:
        value: anything that numpy makes a vector of.
        size: number of entries.
        name: of the parameter, for the error.
        nan: NaN is legal ("keep the default").

    Raises:
        ShapeError: it is not a vector of that size.
        LimitError: an entry is infinite, or NaN where that is not legal.
    """
    try:
        result = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ShapeError(
            f"{name} is {value!r}; {size} numbers are wanted", parameter=name, value=value
        ) from None
    if result.shape != (size,):
        raise ShapeError(
            f"{name} has shape {result.shape}; ({size},) is wanted", parameter=name, value=value
        )
    wrong = np.isinf(result) if nan else ~np.isfinite(result)
    if wrong.any():
        index = int(np.argmax(wrong))
        raise LimitError(
            f"{name}[{index}] is {result[index]}; a finite number is wanted",
            code=1,
            parameter=f"{name}[{index}]",
            value=float(result[index]),
        )
    result.flags.writeable = False
    return result


def within(
    value: float | None, name: str, low: float, high: float, *, above: bool = False, unit: str = ""
) -> float:
    """A number in [low, high] (or (low, high] with `above`); None becomes NaN, "keep the default".

    Raises:
        LimitError: it is outside, or not a number.
    """
    if value is None:
        return float("nan")
    number = float(value)
    if not (low < number if above else low <= number) or not number <= high:
        bounds = f"{'(' if above else '['}{low:g}, {high:g}]{' ' + unit if unit else ''}"
        raise LimitError(
            f"{name} is {number:g}; allowed is {bounds}",
            code=2,
            parameter=name,
            value=number,
            allowed=bounds,
        )
    return number


def fractions(value: npt.ArrayLike | None, name: str) -> Array:
    """Per-axis fractions in (0, 1], shape (7,), from one number, seven, or None (NaN: keep the default).

    Raises:
        ShapeError: neither one number nor seven.
        LimitError: one is outside (0, 1].
    """
    if value is None:
        value = np.nan
    if np.ndim(value) == 0:
        value = np.full(7, value)
    result = array(value, 7, name, nan=True)
    for index, entry in enumerate(result):
        if not np.isnan(entry):
            within(float(entry), f"{name}[{index}]", 0.0, 1.0, above=True)
    return result
