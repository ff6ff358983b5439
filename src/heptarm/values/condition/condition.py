"""Conditions that the cabinet evaluates while the arm moves: frozen values, composed with & | ^ ~.

The makers of the leaves are in heptarm.when; those of forces are in heptarm.values.force_condition. `and`, `or`, `not`
and chained comparisons would ask Python for a truth that only the cabinet knows; they raise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from heptarm.errors import LimitError, ShapeError
from heptarm.values.arguments import check_name
from heptarm.values.arrays import Value, within
from heptarm.values.band import band_text, check_band

#: Longest path [m] and delay [s].
PATH, DELAY = 100.0, 1000.0
#: Stands for "no bound" of a signal's band.
UNBOUNDED = 1e300

#: Nodes of one condition that the cabinet takes.
MOST_NODES = 64


class Condition(Value):
    """Something that holds or does not; combine with & (and), | (or), ^ (one of two), ~ (not)."""

    __slots__ = ()

    def __and__(self, other: Condition) -> Condition:
        return AllOf((*_parts(self, AllOf), *_parts(_condition(other), AllOf)))

    def __or__(self, other: Condition) -> Condition:
        return AnyOf((*_parts(self, AnyOf), *_parts(_condition(other), AnyOf)))

    def __xor__(self, other: Condition) -> Condition:
        return OneOf(self, _condition(other))

    def __invert__(self) -> Condition:
        return self.part if isinstance(self, Inverted) else Inverted(self)

    def __bool__(self) -> NoReturn:
        raise ShapeError(
            f"whether this holds is for the cabinet to say: {self}",
            parameter="condition",
            hint="combine conditions with & | ^ ~, in brackets, instead of and, or, not and a < b < c",
        )


def _condition(other: object) -> Condition:
    if not isinstance(other, Condition):
        raise ShapeError(
            f"{other!r} is no condition",
            parameter="condition",
            value=other,
            hint="put comparisons in brackets: (force > 10) | (torque[3] > 8)",
        )
    return other


def _parts(condition: Condition, kind: type[AllOf] | type[AnyOf]) -> tuple[Condition, ...]:
    return (
        condition.parts if isinstance(condition, (AllOf, AnyOf)) and type(condition) is kind else (condition,)
    )


def check_condition(condition: object, parameter: str = "until") -> Condition:
    """Refuse what is no condition, or one with more nodes than the cabinet takes.

    Raises:
        ShapeError: it is none.
        LimitError: it is too large.
    """
    if not isinstance(condition, Condition):
        raise ShapeError(
            f"{parameter} is {condition!r}; a condition is wanted",
            parameter=parameter,
            value=condition,
            hint="build one with heptarm.when, such as force > 10",
        )
    size = sum(1 for _ in condition_nodes(condition))
    if size > MOST_NODES:
        raise LimitError(
            f"{parameter} has {size} nodes; allowed is {MOST_NODES} at most",
            code=3,
            parameter=parameter,
            value=size,
            allowed=f"[1, {MOST_NODES}]",
            hint="a condition with ^ counts its two sides twice",
        )
    return condition


def condition_nodes(condition: Condition) -> Iterator[tuple[Condition, Condition]]:
    """The nodes in postfix order, as they go over the wire, each with the part that a person would name.

    `OneOf` is written out as what it means.
    """
    if isinstance(condition, OneOf):
        for node, _ in condition_nodes(condition.written_out):
            yield node, condition
        return
    parts: tuple[Condition, ...] = ()
    if isinstance(condition, (AllOf, AnyOf)):
        parts = condition.parts
    elif isinstance(condition, Inverted):
        parts = (condition.part,)
    for part in parts:
        yield from condition_nodes(part)
    yield condition, condition


# ------------------------------------------------------------------------------------- signals and the path


@dataclass(frozen=True, slots=True, eq=False)
class SignalIs(Condition):
    """A boolean signal has a value; `>` and `<` make a condition of a number signal.

    Attributes:
        signal: its name, as `arm.io` lists it.
        value: the value.
    """

    signal: str
    value: bool = True

    def __post_init__(self) -> None:
        check_name(self.signal, "signal")
        if not isinstance(self.value, bool):
            raise ShapeError(f"value is {self.value!r}; True or False is wanted", parameter="value")

    def __gt__(self, other: float) -> SignalOutside:
        return SignalOutside(self.signal, -UNBOUNDED, other)

    def __lt__(self, other: float) -> SignalOutside:
        return SignalOutside(self.signal, other, UNBOUNDED)

    def outside(self, low: float, high: float) -> SignalOutside:
        """The number signal is outside [low, high]."""
        return SignalOutside(self.signal, low, high)

    def __invert__(self) -> Condition:
        return SignalIs(self.signal, not self.value)

    def __str__(self) -> str:
        return f"{self.signal} is {str(self.value).lower()}"


@dataclass(frozen=True, slots=True, eq=False)
class SignalOutside(Condition):
    """A number signal is outside a band.

    Attributes:
        signal: its name, as `arm.io` lists it.
        low: lower bound, in the signal's unit.
        high: upper bound.
    """

    signal: str
    low: float
    high: float

    def __post_init__(self) -> None:
        check_name(self.signal, "signal")
        check_band(self.low, self.high, UNBOUNDED, "")

    def __str__(self) -> str:
        return f"{self.signal} {band_text(self.low, self.high, UNBOUNDED, '').rstrip()}"


@dataclass(frozen=True, slots=True, eq=False)
class PathReached(Condition):
    """A point on the path of the motion is reached.

    Attributes:
        distance: from the start, positive, or to the destination, negative [m].
        delay: so long after that point, or before it if negative [s].
        from_start: whether the distance counts from the start.
    """

    distance: float
    delay: float = 0.0
    from_start: bool = True

    def __post_init__(self) -> None:
        low, high = (0.0, PATH) if self.from_start else (-PATH, 0.0)
        within(self.distance, "distance", low, high, unit="m")
        within(self.delay, "delay", -DELAY, DELAY, unit="s")

    def __str__(self) -> str:
        where = f"{abs(self.distance):g} m {'after the start' if self.from_start else 'before the end'}"
        return where if self.delay == 0 else f"{where} and {self.delay:+g} s"


# --------------------------------------------------------------------------------------------- composed ones


@dataclass(frozen=True, slots=True, eq=False)
class AllOf(Condition):
    """All parts hold.

    Attributes:
        parts: two or more conditions.
    """

    parts: tuple[Condition, ...]

    def __str__(self) -> str:
        return "(" + " & ".join(map(str, self.parts)) + ")"


@dataclass(frozen=True, slots=True, eq=False)
class AnyOf(Condition):
    """One part or several hold.

    Attributes:
        parts: two or more conditions.
    """

    parts: tuple[Condition, ...]

    def __str__(self) -> str:
        return "(" + " | ".join(map(str, self.parts)) + ")"


@dataclass(frozen=True, slots=True, eq=False)
class OneOf(Condition):
    """One of two holds and the other does not.

    Attributes:
        first: a condition.
        second: another one.
    """

    first: Condition
    second: Condition

    @property
    def written_out(self) -> Condition:
        """The same with & | ~ only, as the cabinet evaluates it."""
        return (self.first & ~self.second) | (~self.first & self.second)

    def __str__(self) -> str:
        return f"({self.first} ^ {self.second})"


@dataclass(frozen=True, slots=True, eq=False)
class Inverted(Condition):
    """The part does not hold.

    Attributes:
        part: a condition.
    """

    part: Condition

    def __str__(self) -> str:
        return f"~({self.part})"
