"""Conditions that the cabinet evaluates while the arm moves: frozen values, composed with & | ^ ~."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Value, shown, within


def check_band(low: float, high: float, limit: float, unit: str) -> None:
    """Refuse a band that is empty, or exceeds the limit.

    Raises:
        LimitError: see above.
    """
    within(low, "low", -limit, limit, unit=unit)
    within(high, "high", -limit, limit, unit=unit)
    if not low < high:
        raise LimitError(
            f"low must be below high = {high:g} {unit}, got {low:g} {unit}",
            code=2,
            parameter="low",
            value=low,
            allowed=f"below {high:g} {unit}",
        )


def band_text(low: float, high: float, limit: float, unit: str) -> str:
    """Describe the outside of a band; a bound at the limit is left out."""
    if low <= -limit:
        return f"> {high:g} {unit}"
    if high >= limit:
        return f"< {low:g} {unit}"
    return f"outside [{low:g}, {high:g}] {unit}"


#: Most nodes of a condition that the cabinet accepts.
MOST_NODES = 64


class Condition(Value):
    """Base of conditions; combine them with & (and), | (or), ^ (exactly one of two), ~ (not)."""

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
            f"only the cabinet can evaluate the condition {self}",
            parameter="condition",
            hint="combine conditions with & | ^ ~ and brackets, not with and, or, not or a < b < c",
        )


def _condition(other: object) -> Condition:
    if not isinstance(other, Condition):
        raise ShapeError(
            f"condition must be a Condition, got {shown(other)}",
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
    """Refuse what is no condition, or has more nodes than the cabinet accepts.

    Raises:
        ShapeError: it is none.
        LimitError: it is too large.
    """
    if not isinstance(condition, Condition):
        raise ShapeError(
            f"{parameter} must be a condition, got {shown(condition)}",
            parameter=parameter,
            value=condition,
            hint="build one with heptarm.when, for example force > 10",
        )
    size = sum(1 for _ in condition_nodes(condition))
    if size > MOST_NODES:
        raise LimitError(
            f"{parameter} must have at most {MOST_NODES} nodes, got {size}",
            code=3,
            parameter=parameter,
            value=size,
            allowed=f"[1, {MOST_NODES}]",
            hint="a condition with ^ counts its two sides twice",
        )
    return condition


def condition_nodes(condition: Condition) -> Iterator[tuple[Condition, Condition]]:
    """The nodes in postfix order, as they are sent, each with the part of the user's condition that it belongs to.

    `OneOf` is expanded into & | ~.
    """
    if isinstance(condition, OneOf):
        for node, _ in condition_nodes(condition.expanded):
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
    def expanded(self) -> Condition:
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
