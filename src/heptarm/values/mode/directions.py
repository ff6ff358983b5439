"""Numbers for the six Cartesian directions: x y z, then about x, about y, about z; checked.

Where a direction is given by its name, rotations have KUKA's names: "a" is about z, "b" about y, "c" about x.
Six numbers may also be given by groups of directions, `{"xyz": 3000, "abc": 200}`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan, nan
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.checks import Array, Value, array, frozen, one_or_each, shown, within

#: Index of a direction by its name.
DIRECTIONS = {"x": 0, "y": 1, "z": 2, "c": 3, "b": 4, "a": 5}
#: The directions of a plane.
PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}

#: Units along and about an axis.
FORCE = ("N", "Nm")
LENGTH = ("m", "rad")
SPEED = ("m/s", "rad/s")


#: Six numbers x y z, about x, about y, about z; or one number for each group of directions, such as "xyz", "z", "abc".
Directional: TypeAlias = npt.ArrayLike | Mapping[str, float]


def by_groups(value: Directional, name: str, others: Sequence[float]) -> npt.ArrayLike:
    """The six numbers that groups of directions stand for; what is no mapping is returned as it is.

    Args:
        value: numbers by groups; anything else.
        name: of the parameter, for the error.
        others: numbers of the directions that no group names.

    Raises:
        ShapeError: a group with other letters than those of `DIRECTIONS`, a direction twice, or no group.
    """
    if not isinstance(value, Mapping):
        return value
    result: list[float] = list(others)
    named: list[str] = [letter for group in value if isinstance(group, str) for letter in group]
    if (
        not named
        or not all(isinstance(group, str) and group for group in value)
        or not set(named) <= set(DIRECTIONS)
        or len(set(named)) != len(named)
    ):
        raise ShapeError(
            f"{name} must have groups of the directions x y z a b c, each direction at most once, got {shown(value)}",
            parameter=name,
            value=value,
            hint='for example {"xyz": 1.0, "abc": 1.0}; a is about z, b about y, c about x',
        )
    for group, number in value.items():
        for letter in group:
            result[DIRECTIONS[letter]] = number
    return result


def one(value: float, name: str, low: float, high: float, unit: str = "", *, above: bool = False) -> float:
    """A number in [low, high] (or (low, high] with `above`) without a default.

    Raises:
        LimitError: it is outside, or not given.
        ShapeError: it is no number.
    """
    return within(value, name, low, high, above=above, unit=unit)


def each(value: npt.ArrayLike, size: int, name: str, low: float, high: float, unit: str = "") -> Array:
    """One number in [low, high] for all joints or directions, or one for each; shape (size,).

    Raises:
        LimitError: one is outside; the text names it.
        ShapeError: neither one number nor that many.
    """
    result = one_or_each(value, size, name)
    for index, entry in enumerate(result.tolist()):
        within(entry, f"{name}[{index}]", low, high, unit=unit)
    return result


def six(value: Directional, name: str, low: float, high: float, units: tuple[str, str]) -> Array:
    """One number in [low, high] for each direction, 0 where no group names it, shape (6,); `units` along and about.

    Raises:
        LimitError: one is outside; the text names it.
        ShapeError: not six numbers.
    """
    result = array(by_groups(value, name, (0.0,) * 6), 6, name)
    for index, entry in enumerate(result.tolist()):
        within(entry, f"{name}[{index}]", low, high, unit=units[index // 3])
    return result


def limit(
    value: Directional | None, name: str, high: float, units: tuple[str, str], *, above: bool = False
) -> Array:
    """Limits of six directions in [0, high] (or (0, high] with `above`), shape (6,); NaN or None: unlimited.

    Raises:
        LimitError: one is outside; the text names it.
        ShapeError: not six numbers.
    """
    if value is None:
        return frozen(np.full(6, nan))
    result = array(by_groups(value, name, (nan,) * 6), 6, name, nan=True)
    for index, entry in enumerate(result.tolist()):
        if not isnan(entry):
            within(entry, f"{name}[{index}]", 0.0, high, above=above, unit=units[index // 3])
    return result


def at(indices: Sequence[int], values: Sequence[float]) -> list[float]:
    """Six numbers, zero but for some directions."""
    result = [0.0] * 6
    for index, value in zip(indices, values, strict=True):
        result[index] = value
    return result


def put(value: Value, name: str, content: object) -> None:
    """Set a field of a frozen value during construction."""
    object.__setattr__(value, name, content)
