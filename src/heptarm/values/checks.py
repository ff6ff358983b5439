"""Checked, read-only arrays, numbers and words: what a user gives passes through these checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, Field, FrozenInstanceError
from typing import Any, ClassVar, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError
from heptarm.values.notebook import as_html

Array: TypeAlias = npt.NDArray[np.float64]

_Kind = TypeVar("_Kind")
_Function = TypeVar("_Function", bound=Callable[..., Any])
#: Longest text of a value in an error.
_LONGEST_TEXT = 200
#: Largest integer that a double can be near to.
_LARGEST_INTEGER = int(np.finfo(np.float64).max)
_HUGE = "an integer is too large for a double"


class Value:
    """Base of frozen dataclasses that hold arrays: equal and hashed by their numbers; NaN equals NaN."""

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls, **options: Any) -> None:
        """Keep the short form: a dataclass makes one of its own where its class has none."""
        super().__init_subclass__(**options)
        if "__repr__" not in vars(cls):
            cls.__repr__ = cls.__repr__  # type: ignore[method-assign]
        if "__setattr__" in vars(
            cls
        ):  # what a frozen dataclass with slots makes fails at names that it has not
            cls.__setattr__ = _refuse  # type: ignore[method-assign, assignment]

    def __repr__(self) -> str:
        """The call that makes it, without what is at its default or left open (NaN)."""
        given = [
            f"{name}={getattr(self, name)!r}"
            for name, field in self.__dataclass_fields__.items()
            if field.repr and not _is_default(getattr(self, name), field)
        ]
        return f"{type(self).__qualname__}({', '.join(given)})"

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _repr_html_(self) -> str:
        """A table of the rows of `str` for a notebook; of a single line the line."""
        return as_html(str(self))

    def _key(self) -> tuple[object, ...]:
        return tuple(_key(getattr(self, name)) for name, f in self.__dataclass_fields__.items() if f.compare)


def _refuse(value: Value, name: str, _: object) -> None:
    kind = type(value).__name__
    if name in value.__dataclass_fields__:
        raise FrozenInstanceError(
            f"{name} of a {kind} cannot be set: dataclasses.replace makes another {kind}"
        )
    raise FrozenInstanceError(f"a {kind} has no {name!r}, and nothing of it can be set")


def _key(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return "nan" if isinstance(value, float) and value != value else value


def _is_default(value: object, field: Field[Any]) -> bool:
    if isinstance(value, (float, np.ndarray)) and np.size(value) and np.isnan(value).all():
        return True
    default = field.default if field.default_factory is MISSING else field.default_factory()
    return _key(value) == _key(default)


def frozen(values: npt.ArrayLike) -> Array:
    """The values as a read-only array, unchecked; an array of doubles is not copied."""
    result = np.asarray(values, dtype=np.float64)
    result.setflags(write=False)
    return result


def shown(value: object) -> str:
    """A value in an error's text: short, and whatever the value is."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return f"an integer of {value.bit_length()} bits"
    try:
        text = repr(value)
    except Exception:  # a repr of another library
        return f"a {type(value).__name__}"
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}..."


def numbers(value: npt.ArrayLike, name: str, wanted: str = "numbers") -> Array:
    """A copy of `value` as doubles, of any shape, unchecked but for its type.

    Args:
        value: a number, or numbers in lists, tuples and arrays.
        name: of the parameter, for the error.
        wanted: what it must be, for the error.

    Raises:
        ShapeError: it is something else: text, booleans, masked entries, lists of different lengths.
        LimitError: an integer too large for a double.
    """
    reason = _defect(value)
    if not reason:
        try:
            given = np.asarray(value)
            if given.dtype.kind in "iuf":
                with np.errstate(over="ignore"):  # of numbers longer than doubles: infinite then
                    result = given.astype(np.float64)
                    result += 0.0  # -0.0 becomes 0.0, so that equal arrays hash alike
                    return result
        except (TypeError, ValueError):
            pass
        except OverflowError:
            reason = _HUGE
    if reason == _HUGE:
        raise LimitError(
            f"{name} must be finite, got {shown(value)}: {reason}", code=1, parameter=name, value=value
        )
    because = f": {reason}" if reason else ""
    raise ShapeError(f"{name} must be {wanted}, got {shown(value)}{because}", parameter=name, value=value)


def _defect(value: object, depth: int = 0) -> str:
    """Why numpy must not convert something that it would convert; empty: it may try."""
    if isinstance(value, np.ndarray):
        # the type first: to import numpy.ma takes every program 20 ms
        masked = type(value) is not np.ndarray and np.ma.is_masked(value)
        return "masked entries have no value" if masked else ""
    if isinstance(value, (list, tuple)):
        for entry in value:
            if type(entry) is float:  # the usual case
                continue
            if isinstance(entry, (bool, np.bool_)):
                return "a boolean is no number"
            if isinstance(entry, int) and abs(entry) > _LARGEST_INTEGER:
                return _HUGE
            if reason := "lists in lists in lists" if depth > 2 else _defect(entry, depth + 1):
                return reason
        return ""
    if isinstance(value, (bool, np.bool_)):
        return "a boolean is no number"
    return _HUGE if isinstance(value, int) and abs(value) > _LARGEST_INTEGER else ""


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
    if isinstance(value, tuple) and len(value) == size and all(type(entry) is float for entry in value):
        result = np.array(value)
        if math.isfinite(sum(value)):  # the usual case: every entry is finite
            result += 0.0  # as `numbers` does
            result.flags.writeable = False
            return result
    result = numbers(value, name, f"{size} numbers")
    if result.shape != (size,):
        raise ShapeError(f"{name} must have shape ({size},), got {result.shape}", parameter=name, value=value)
    return finite_entries(result, name, nan=nan)


def finite_entries(result: Array, name: str, *, nan: bool = False) -> Array:
    """The same array, read-only, after a check of its entries.

    Raises:
        LimitError: an entry is infinite, or NaN where that is not allowed.
    """
    wrong = np.isinf(result) if nan else ~np.isfinite(result)
    if wrong.any():
        place = np.unravel_index(int(np.argmax(wrong)), result.shape)
        at = f"{name}[{', '.join(map(str, place))}]"
        raise LimitError(
            f"{at} must be finite, got {result[place]}", code=1, parameter=at, value=float(result[place])
        )
    result.flags.writeable = False
    return result


def one_or_each(value: npt.ArrayLike, size: int, name: str, *, nan: bool = False) -> Array:
    """One number for all, or one for each, shape (size,). Raises as `array` does."""
    given = numbers(value, name, f"one number or {size} numbers")
    return array(np.full(size, given) if given.ndim == 0 else given, size, name, nan=nan)


def within(value: float, name: str, low: float, high: float, *, above: bool = False, unit: str = "") -> float:
    """A number in [low, high] (or (low, high] with `above`).

    Raises:
        ShapeError: it is no number.
        LimitError: it is outside, or NaN.
    """
    if type(value) is float and low < value <= high:  # the usual case
        return value + 0.0
    number = scalar(value, name, unit=unit)
    if not (low < number if above else low <= number) or not number <= high:
        of_unit = f" {unit}" if unit else ""
        bounds = f"{'(' if above else '['}{low:g}, {high:g}]{of_unit}"
        meant = other_unit(number, unit) if unit else _of_percent(number, high)
        raise LimitError(
            f"{name} must be in {bounds}, got {number:g}{of_unit}",
            code=2 if math.isfinite(number) else 1,
            parameter=name,
            value=number,
            allowed=bounds,
            hint=meant[1] if meant is not None and low <= meant[0] <= high and meant[0] != low else "",
        )
    return number


def _of_percent(value: float, high: float) -> tuple[float, str] | None:
    """What a number without a unit would be if it were given in percent; None: it is no fraction."""
    if high != 1.0 or not 1.0 < value <= 100.0:
        return None
    return value / 100.0, f"it is a fraction: did you mean {value / 100.0:g}?"


def other_unit(value: float, unit: str) -> tuple[float, str] | None:
    """What a number would be if millimetres were given for metres, or degrees for radians; None: no such unit.

    Args:
        value: the number.
        unit: in which it is expected, such as "m/s".

    Returns:
        The number in this unit, and a question that asks whether it was meant.
    """
    base = unit.partition("/")[0]
    if base == "m":
        meant = value / 1000.0
        return meant, f"units are metres: did you mean {value:g} m{unit}, which is {meant:g} {unit}?"
    if base == "rad":
        return math.radians(value), f"angles are in radians: did you mean math.radians({value:g})?"
    return None


def optional(
    value: float | None, name: str, low: float, high: float, *, above: bool = False, unit: str = ""
) -> float:
    """As `within`; None becomes NaN, "keep the default"."""
    return math.nan if value is None else within(value, name, low, high, above=above, unit=unit)


def scalar(value: object, name: str, *, unit: str = "") -> float:
    """One number; it may be infinite or NaN.

    Raises:
        ShapeError: it is something else.
        LimitError: it is too large for a double.
    """
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        try:
            return float(value) + 0.0
        except OverflowError:
            of_unit = f" {unit}" if unit else ""
            raise LimitError(
                f"{name} must be finite, got {shown(value)}{of_unit}", code=1, parameter=name, value=value
            ) from None
    raise ShapeError(f"{name} must be a number, got {shown(value)}", parameter=name, value=value)


def finite(value: object, name: str, *, unit: str = "") -> float:
    """One finite number.

    Raises:
        ShapeError: it is no number.
        LimitError: it is infinite or NaN.
    """
    number = scalar(value, name, unit=unit)
    if not math.isfinite(number):
        of_unit = f" {unit}" if unit else ""
        raise LimitError(
            f"{name} must be finite, got {number:g}{of_unit}", code=1, parameter=name, value=number
        )
    return number


def integer(value: object, name: str, low: int, high: int) -> int:
    """An integer in [low, high].

    Raises:
        ShapeError: it is no integer.
        LimitError: it is outside.
    """
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool):
        raise ShapeError(f"{name} must be an integer, got {shown(value)}", parameter=name, value=value)
    if not low <= value <= high:
        raise LimitError(
            f"{name} must be in [{low}, {high}], got {shown(value)}",
            code=2,
            parameter=name,
            value=value,
            allowed=f"[{low}, {high}]",
        )
    return int(value)


def instance(value: object, kind: type[_Kind] | tuple[type, ...], name: str, hint: str = "") -> _Kind:
    """Something of a type.

    Raises:
        ShapeError: it is something else.
    """
    if not isinstance(value, kind):
        kinds = kind if isinstance(kind, tuple) else (kind,)
        wanted = " or ".join(kind.__name__ for kind in kinds)
        article = "an" if wanted[0] in "AEIOU" else "a"
        raise ShapeError(
            f"{name} must be {article} {wanted}, got {shown(value)}", parameter=name, value=value, hint=hint
        )
    return value  # type: ignore[return-value]


def word(value: str, name: str, allowed: Collection[str]) -> str:
    """One of some words.

    Raises:
        ShapeError: it is something else.
    """
    if not isinstance(value, str) or value not in allowed:
        listed = ", ".join(map(repr, allowed))
        raise ShapeError(
            f"{name} must be one of {listed}, got {shown(value)}", parameter=name, value=value, allowed=listed
        )
    return value


def choice(name: str, parameter: str, choices: Mapping[str, _Kind]) -> _Kind:
    """What has a name, out of some; see `word`.

    Raises:
        ShapeError: none has that name; the text lists those that there are.
    """
    if isinstance(name, str) and name in choices:
        return choices[name]
    allowed = ", ".join(choices)
    raise ShapeError(
        f"{parameter} must be one of {allowed}, got {shown(name)}",
        parameter=parameter,
        value=name,
        allowed=allowed,
    )


def flag(value: bool, name: str) -> bool:
    """True or False.

    Raises:
        ShapeError: it is something else.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise ShapeError(f"{name} must be True or False, got {shown(value)}", parameter=name, value=value)
    return bool(value)


def callback(value: _Function, name: str) -> _Function:
    """A function.

    Raises:
        ShapeError: it cannot be called.
    """
    if not callable(value):
        raise ShapeError(f"{name} must be a function, got {shown(value)}", parameter=name, value=value)
    return value


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
    result = one_or_each(value, 7, name, nan=nan)
    is_one = np.ndim(value) == 0
    for index, entry in enumerate(result.tolist()):
        if entry == entry:  # not NaN
            within(entry, name if is_one else f"{name}[{index}]", 0.0, 1.0, above=True)
    return result
