"""Checked, read-only arrays: every number that a user gives passes through these checks."""

from __future__ import annotations

import math
from dataclasses import Field
from typing import Any, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError

Array: TypeAlias = npt.NDArray[np.float64]


class Value:
    """Base of frozen dataclasses that hold arrays: equal and hashed by their numbers; NaN equals NaN."""

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return tuple(_key(getattr(self, name)) for name, f in self.__dataclass_fields__.items() if f.compare)


def _key(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return "nan" if isinstance(value, float) and value != value else value


def frozen(values: npt.ArrayLike) -> Array:
    """The values as a read-only array, unchecked; an array of doubles is not copied."""
    result = np.asarray(values, dtype=np.float64)
    result.flags.writeable = False
    return result


def array(value: npt.ArrayLike, size: int, name: str, *, nan: bool = False) -> Array:
    """A read-only copy of `value`, shape (size,).

    Args:
        value: anything that numpy makes a vector of.
        size: number of entries.
        name: of the parameter, for the error.
        nan: NaN is allowed ("keep the default").

    Raises:
        ShapeError: it is not a vector of that size.
        LimitError: an entry is infinite, or NaN where that is not allowed.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "iuf":
            raise ShapeError("not numeric")
        result = given.astype(np.float64) + 0.0  # + 0.0: -0.0 becomes 0.0, so that equal arrays hash alike
    except (TypeError, ValueError):
        raise ShapeError(
            f"{name} must be {size} numbers, got {value!r}", parameter=name, value=value
        ) from None
    if result.shape != (size,):
        raise ShapeError(f"{name} must have shape ({size},), got {result.shape}", parameter=name, value=value)
    wrong = np.isinf(result) if nan else ~np.isfinite(result)
    if wrong.any():
        index = int(np.argmax(wrong))
        raise LimitError(
            f"{name}[{index}] must be finite, got {result[index]}",
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
        return math.nan
    number = scalar(value, name)
    if not (low < number if above else low <= number) or not number <= high:
        of_unit = f" {unit}" if unit else ""
        bounds = f"{'(' if above else '['}{low:g}, {high:g}]{of_unit}"
        raise LimitError(
            f"{name} must be in {bounds}, got {number:g}{of_unit}",
            code=2 if math.isfinite(number) else 1,
            parameter=name,
            value=number,
            allowed=bounds,
        )
    return number


def scalar(value: object, name: str) -> float:
    """One number.

    Raises:
        ShapeError: it is something else.
    """
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        return float(value) + 0.0
    raise ShapeError(f"{name} must be a number, got {value!r}", parameter=name, value=value)


def fractions(value: npt.ArrayLike | None, name: str, *, nan: bool = False) -> Array:
    """Fractions of the joints' maxima in (0, 1], shape (7,), from one number, seven, or None (NaN: keep the default).

    Args:
        value: one number for all joints, or seven.
        name: of the parameter, for the error.
        nan: NaN entries are allowed ("keep the default").

    Raises:
        ShapeError: neither one number nor seven.
        LimitError: one is outside (0, 1].
    """
    if value is None:
        return frozen(np.full(7, np.nan))
    result = array(np.full(7, value) if np.ndim(value) == 0 else value, 7, name, nan=nan)
    for index, entry in enumerate(result.tolist()):
        if entry == entry:  # not NaN
            within(entry, f"{name}[{index}]", 0.0, 1.0, above=True)
    return result
