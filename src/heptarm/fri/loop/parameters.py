"""Declaration of a law's parameter: its range, its unit, and how fast it follows what a program sets.

Every setter checks against it: making a law, opening its session, `rt.params`. The loop moves a parameter towards its
new value at its rate before each call of the law (`fri_follow` of native/fri_law.c), so a law in Python, Numba or C
sees the same values.
"""

from __future__ import annotations

import ctypes
import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm._library import library
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array, Value, flag, instance, numbers, other_unit, shown
from heptarm.values.pose import Pose

#: Whether a value of a parameter is allowed: why not, as text; empty: it is.
Check: TypeAlias = Callable[[Array], str]


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Param(Value):
    """A parameter of a law, with what it may be set to; made by `heptarm.param`.

    Attributes:
        value: initial value, of any shape.
        low: smallest value, of the same shape; -inf: none.
        high: largest value, of the same shape; inf: none.
        above: `low` itself is not allowed.
        unit: for errors, such as "Nm/rad".
        rate: largest change in a second, of the same shape; inf: a new value acts at once.
        nan: NaN is allowed.
        live: a running law's parameter can be changed.
        check: looks at a whole value; None: nothing does.
    """

    value: Array
    low: Array
    high: Array
    above: bool
    unit: str
    rate: Array
    nan: bool
    live: bool
    check: Check | None

    def __init__(
        self,
        value: npt.ArrayLike | Pose,
        *,
        low: npt.ArrayLike = -math.inf,
        high: npt.ArrayLike = math.inf,
        above: bool = False,
        unit: str = "",
        rate: npt.ArrayLike = math.inf,
        nan: bool = False,
        live: bool = True,
        check: Check | None = None,
        name: str = "value",
    ) -> None:
        made = _numbers(value, instance(name, str, "name"))
        bounds = {
            part: _like(given, made, f"{part} of {name}")
            for part, given in (("low", low), ("high", high), ("rate", rate))
        }
        if not (bounds["low"] <= bounds["high"]).all():
            raise LimitError(
                f"low of {name} must not be above its high", parameter="low", value=bounds["low"].tolist()
            )
        if not (bounds["rate"] > 0.0).all():
            raise LimitError(
                f"rate of {name} must be above 0", parameter="rate", value=bounds["rate"].tolist()
            )
        if check is not None and not callable(check):
            raise ShapeError(f"check must be a function, got {shown(check)}", parameter="check", value=check)
        for attribute, found in (
            *bounds.items(),
            ("above", flag(above, "above")),
            ("unit", instance(unit, str, "unit")),
            ("nan", flag(nan, "nan")),
            ("live", flag(live, "live")),
            ("check", check),
            ("value", made),
        ):
            object.__setattr__(self, attribute, found)
        object.__setattr__(self, "value", self.checked(made, name))

    def checked(self, value: npt.ArrayLike | Pose, name: str) -> Array:
        """A value, after a check against the declaration.

        Args:
            value: what it is to be set to.
            name: of the parameter, for the error.

        Raises:
            ShapeError: it has another shape than initially.
            LimitError: an entry is outside its range, or not finite.
            CommandRejected: the check of the whole value refuses it.
        """
        given = _numbers(value, instance(name, str, "name"))
        if given.shape != self.low.shape:
            raise ShapeError(
                f"{name} must have shape {self.low.shape}, as initially, got {given.shape}", parameter=name
            )
        missing = np.isnan(given)
        inside = (given > self.low if self.above else given >= self.low) & (given <= self.high)
        wrong = np.where(missing, not self.nan, ~inside | np.isinf(given))
        if wrong.any():
            self._refuse(given, name, int(np.argmax(wrong)))
        if self.check is not None and not missing.any() and (why := self.check(given)):
            raise CommandRejected(f"{name}: {why}", parameter=name, value=given.tolist())
        given.flags.writeable = False
        return given

    def starting(self, value: npt.ArrayLike | Pose, name: str) -> Param:
        """The same declaration with another initial value."""
        return Param(
            value,
            low=self.low,
            high=self.high,
            above=self.above,
            unit=self.unit,
            rate=self.rate,
            nan=self.nan,
            live=self.live,
            check=self.check,
            name=name,
        )

    def _refuse(self, given: Array, name: str, index: int) -> None:
        """Raise the error of the entry at a flat index."""
        number, low, high = (float(array.flat[index]) for array in (given, self.low, self.high))
        place = ", ".join(str(int(place)) for place in np.unravel_index(index, given.shape))
        where, unit = f"{name}[{place}]" if given.ndim else name, f" {self.unit}" if self.unit else ""
        ends = "(" if self.above or low == -math.inf else "[", ")" if high == math.inf else "]"
        allowed = f"{ends[0]}{low:g}, {high:g}{ends[1]}{unit}"
        if not math.isfinite(number):
            text, code = f"{where} must be finite, got {number:g}{unit}", 1
        else:
            text, code = f"{where} must be in {allowed}, got {number:g}{unit}", 2
        meant = other_unit(number, self.unit)
        fits = meant is not None and low <= meant[0] <= high and meant[0] != low
        raise LimitError(
            text,
            code=code,
            parameter=where,
            value=number,
            allowed=allowed,
            hint=meant[1] if meant is not None and fits else "",
        )


def param(
    value: npt.ArrayLike | Pose,
    *,
    low: npt.ArrayLike = -math.inf,
    high: npt.ArrayLike = math.inf,
    above: bool = False,
    unit: str = "",
    rate: npt.ArrayLike = math.inf,
    nan: bool = False,
    live: bool = True,
    check: Check | None = None,
) -> Param:
    """Declare a parameter of a law: what a program may set it to, and how fast the law sees it change.

    ::

        @ha.law(params={"k": ha.param(500.0, low=0.0, high=2000.0, unit="Nm/rad", rate=2000.0)})
        def spring(s, out, p):
            out.tau[:] = p.k * (s.q_ipo - s.q)

    Args:
        value: initial value: a number, an array or a pose, x y z [m] and quaternion x y z w.
        low: smallest value, one for all entries or an array of the same shape.
        high: largest value, likewise.
        above: `low` itself is not allowed.
        unit: for errors, such as "Nm/rad".
        rate: largest change in a second, in units of the parameter; the law sees a step as a ramp. inf: at once.
        nan: NaN is allowed: "not given".
        live: False: fixed once its session is open.
        check: called with a value whose entries are in range; returns why it is not allowed, "" if it is.

    Raises:
        ShapeError: value or bounds are not numbers, or of shapes that do not fit.
        LimitError: the initial value is outside the range, or the range is empty.
    """
    return Param(
        value,
        low=low,
        high=high,
        above=above,
        unit=unit,
        rate=rate,
        nan=nan,
        live=live,
        check=check,
    )


def declared(values: Mapping[str, object]) -> dict[str, Param]:
    """The declaration of each parameter; one without a declaration may be any finite number, and NaN if it is NaN."""
    found = {}
    for name, value in values.items():
        if isinstance(value, Param):
            found[name] = value
        else:
            given = _numbers(value, name)
            found[name] = Param(given, nan=bool(np.isnan(given).any()), name=name)
    return found


def merged(known: Mapping[str, Any], given: Mapping[str, Any] | None) -> dict[str, Param]:
    """Declarations of a law's parameters with other initial values, which have to fit them.

    Args:
        known: the law's parameters.
        given: those of its session, in place of them; a declaration replaces the law's. None: none.

    Raises:
        LimitError: a value is outside its range.
        ShapeError: a value has another shape.
    """
    result = declared(known)
    for name, value in (given or {}).items():
        law = known.get(name)
        if isinstance(law, Param) and not isinstance(value, Param):
            result[name] = law.starting(value, name)
        else:
            result[name] = declared({name: value})[name]
    return result


def rates(declared: Mapping[str, Param]) -> Array:
    """Largest changes in a second of all parameters, in their order, shape (n,)."""
    return np.concatenate([np.zeros(0), *(parameter.rate.reshape(-1) for parameter in declared.values())])


@functools.cache
def _follow() -> Callable[..., None]:
    function = library(holds_gil=True).fri_follow
    pointer = ctypes.c_void_p
    function.argtypes = (pointer, pointer, pointer, ctypes.c_int64, ctypes.c_double)
    function.restype = None
    made: Callable[..., None] = function
    return made


class RateLimiter:
    """Parameters as a law sees them: they follow what a program sets, each at its rate.

    Args:
        values: what the law sees, shape (n,).
        rates: largest changes in a second, shape (n,).

    Attributes:
        target: what the program has set last, shape (n,).
    """

    __slots__ = ("_rates", "_values", "target")

    def __init__(self, values: Array, rates: Array) -> None:
        self._values, self._rates, self.target = values, rates, values.copy()

    def begin(self, target: Array) -> None:
        """Take over values without a ramp."""
        self.target[:] = self._values[:] = target

    def step(self, dt: float) -> None:
        """Let the values follow for a cycle of so many seconds."""
        at = (words.ctypes.data for words in (self._values, self.target, self._rates))
        _follow()(*at, len(self.target), dt)


def _numbers(value: object, name: str) -> Array:
    given = value.array if isinstance(value, Pose) else value
    return numbers(given, name, "a number or an array of numbers")  # type: ignore[arg-type]


def _like(bound: npt.ArrayLike, value: Array, name: str) -> Array:
    """A bound for each entry of a value."""
    given = numbers(bound, name)
    if given.shape not in ((), value.shape):
        raise ShapeError(f"{name} must have shape () or {value.shape}, got {given.shape}", parameter=name)
    if np.isnan(given).any():
        raise LimitError(f"{name} must be numbers, got NaN", parameter=name)
    result = np.array(np.broadcast_to(given, value.shape))
    result.flags.writeable = False
    return result
