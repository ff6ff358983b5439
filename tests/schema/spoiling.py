"""Legal messages with one bad value each: just outside a range, not finite, too long, too short, not of unit length."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import sample_bodies
import spec as schema
from heptarm.wire.messages import MESSAGES, Message

SPEC = schema.load()
#: Examples of each message: different ones reach different members of the unions.
EXAMPLES = 60
_BITS = {"u8": 8, "u16": 16, "u32": 32, "i32": 31}


@dataclass(frozen=True)
class Bad:
    """A value that a field has to refuse.

    Attributes:
        value: of the field; of one entry if it has several, but for their norm.
        code: with which it is refused.
        why: in words.
    """

    value: Any
    code: int
    why: str


@dataclass(frozen=True)
class Case:
    """A message with one bad value.

    Attributes:
        message: the message.
        field: whose value is bad, as "Struct.field".
        path: where it is in the message.
        bad: the value.
    """

    message: Message
    field: str
    path: str
    bad: Bad


def bad_values(one: schema.Field) -> list[Bad]:
    """The values that a field must refuse."""
    name, kind = one.type.name, one.type.kind
    if kind in ("prim", "array") and name == "f64":
        return list(_numbers(one))
    if kind == "prim" and name in _BITS and one.ranged:
        least, most = (-(2**31) if name == "i32" else 0), 2 ** _BITS[name] - 1
        ends = ((one.high + 1, "above"), (one.low - 1, "below"))
        return [Bad(int(v), 2, why) for v, why in ends if math.isfinite(v) and least <= v <= most]
    if kind in ("str", "bytes"):
        one_letter: Any = "x" if kind == "str" else b"x"
        return [Bad(one_letter * size, 3, why) for size, why in _lengths(one)]
    return []


def _numbers(one: schema.Field) -> Iterator[Bad]:
    yield Bad(math.inf, 1, "infinite")
    yield Bad(-math.inf, 1, "infinite downwards")
    if not one.nan:
        yield Bad(math.nan, 1, "NaN")
    if math.isfinite(one.high):
        yield Bad(math.nextafter(one.high, math.inf), 2, "above")
    if math.isfinite(one.low):
        yield Bad(one.low if one.low_open else math.nextafter(one.low, -math.inf), 2, "below")


def _lengths(one: schema.Field) -> Iterator[tuple[int, str]]:
    if one.max_len < 65535:
        yield one.max_len + 1, "too long"
    if one.min_len > 0:
        yield one.min_len - 1, "too short"


@cache
def cases() -> tuple[Case, ...]:
    """Each field of each message with each value that it has to refuse, once."""
    found: dict[tuple[str, str, str], Case] = {}
    for name, message in SPEC.messages.items():
        if message.groups:
            continue
        for index in range(EXAMPLES):
            good = MESSAGES[message.id].decode(sample_bodies.body(SPEC, name, f"spoilt-{index}"))
            for field, path, bad, spoilt in _spoilt(good, name, message.fields):
                found.setdefault((name, field, bad.why), Case(spoilt, field, path, bad))
    return tuple(found.values())


def _spoilt(value: Any, owner: str, fields: list[schema.Field]) -> Iterator[tuple[str, str, Bad, Any]]:
    for one in fields:
        for field, path, bad, spoilt in _spoilt_field(getattr(value, one.name), owner, one):
            yield field, one.name + path, bad, dataclasses.replace(value, **{one.name: spoilt})


def _spoilt_field(here: Any, owner: str, one: schema.Field) -> Iterator[tuple[str, str, Bad, Any]]:
    kind, name = one.type.kind, f"{owner}.{one.name}"
    if kind in ("prim", "str", "bytes"):
        for bad in bad_values(one):
            yield name, "", bad, bad.value
    elif kind == "array":
        place = one.type.size - 1
        for bad in bad_values(one):
            yield name, f"[{place}]", bad, (*here[:place], bad.value)
        if one.norm is not None:
            yield name, "", Bad((0.0,) * place + (0.99,), 4, "short"), (0.0,) * place + (0.99,)
    elif kind in ("struct", "union", "opt"):
        if here is not None:
            inner = type(here).__name__
            for field, path, bad, spoilt in _spoilt(here, inner, SPEC.structs[inner].fields):
                yield field, "." + path, bad, spoilt
    elif kind == "list" and here:
        for size, why in _lengths(one):
            entries = tuple(here[:1] * size)
            yield name, "", Bad(entries, 3, why), entries
        if dataclasses.is_dataclass(here[0]):
            inner = type(here[0]).__name__
            for field, path, bad, spoilt in _spoilt(here[0], inner, SPEC.structs[inner].fields):
                yield field, "[0]." + path, bad, (spoilt, *here[1:])


def checked_fields(message: schema.Message) -> set[str]:
    """The fields of a message, down to the last, that have something to refuse."""
    found: set[str] = set()

    def visit(owner: str, fields: list[schema.Field]) -> None:
        for one in fields:
            name, inner = f"{owner}.{one.name}", one.type
            if name in found:
                continue
            if bad_values(one) or one.norm is not None or (inner.kind == "list" and any(_lengths(one))):
                found.add(name)
            while inner.kind in ("list", "opt"):
                assert inner.of is not None
                inner = inner.of
            if inner.kind == "struct":
                visit(inner.name, SPEC.structs[inner.name].fields)
            elif inner.kind == "union":
                for _, member in SPEC.unions[inner.name].members:
                    visit(member, SPEC.structs[member].fields)

    visit(message.name, message.fields)
    return found
