"""Parameters of a law: numbers and arrays by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError

Floats = npt.NDArray[np.float64]


class Params:
    """Parameters of a law: numbers and arrays by name, all of them taken over at once.

    Args:
        values: numbers and arrays, flat.
        schema: name, shape and place of each.
        changed: called after an assignment; None makes them read-only.
    """

    __slots__ = ("_changed", "_schema", "_values")

    def __init__(
        self,
        values: Floats,
        schema: Mapping[str, tuple[tuple[int, ...], int]],
        *,
        changed: Callable[[], None] | None = None,
    ) -> None:
        object.__setattr__(self, "_values", values)
        object.__setattr__(self, "_schema", dict(schema))
        object.__setattr__(self, "_changed", changed)

    def __getattr__(self, name: str) -> Any:
        try:
            shape, start = self._schema[name]
        except KeyError:
            raise AttributeError(
                f"no parameter {name!r}; there are {', '.join(self._schema) or 'none'}"
            ) from None
        if not shape:
            return float(self._values[start])
        part = self._values[start : start + int(np.prod(shape))].reshape(shape)
        part.flags.writeable = False
        return part

    def __setattr__(self, name: str, value: npt.ArrayLike) -> None:
        self.set(**{name: value})

    def set(self, **values: npt.ArrayLike) -> None:
        """Change several parameters in one go: the law sees all of them or none.

        Raises:
            ShapeError: a value has another shape than at the start.
            AttributeError: no such parameter, or they are read-only.
        """
        if self._changed is None:
            raise AttributeError("parameters are read-only in a law")
        checked = []
        for name, value in values.items():
            given: Floats = np.asarray(value, dtype=np.float64)
            if name not in self._schema:
                raise AttributeError(f"no parameter {name!r}; there are {', '.join(self._schema) or 'none'}")
            shape, start = self._schema[name]
            if given.shape != tuple(shape):
                raise ShapeError(
                    f"{name} has shape {given.shape}; {tuple(shape)} is wanted, as at the start",
                    parameter=name,
                )
            checked.append((start, given.reshape(-1)))
        for start, given in checked:
            self._values[start : start + given.size] = given
        self._changed()

    def replace(self, values: Floats) -> None:
        """Take over all values."""
        self._values[:] = values

    @staticmethod
    def flat(values: Mapping[str, npt.ArrayLike]) -> tuple[Floats, dict[str, tuple[tuple[int, ...], int]]]:
        """Flat numbers and schema of a mapping.

        Raises:
            ShapeError: a value is no number and no array of numbers.
        """
        parts: list[Floats] = []
        schema: dict[str, tuple[tuple[int, ...], int]] = {}
        start = 0
        for name, value in values.items():
            try:
                given: Floats = np.asarray(value, dtype=np.float64)
            except (TypeError, ValueError):
                raise ShapeError(f"{name} is {value!r}; numbers are wanted", parameter=name) from None
            schema[name] = (given.shape, start)
            parts.append(given.reshape(-1))
            start += given.size
        return (np.concatenate(parts) if parts else np.zeros(0)), schema
