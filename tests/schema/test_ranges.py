"""Table-driven over the schema: a value just outside its range, NaN, infinity are refused by both languages alike."""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Callable, Iterator
from typing import Any

import sample_bodies
import spec as schema
from heptarm.wire import messages as wire
from heptarm.wire.messages import MESSAGES, Message
from tests.schema.python_side import verdict

SPEC = schema.load()


def _bad_values(one: schema.Field) -> Iterator[tuple[Any, int]]:
    """Values that the field must refuse, with the code."""
    if one.type.name == "f64":
        yield math.inf, 1
        yield -math.inf, 1
        if not one.nan:
            yield math.nan, 1
        if math.isfinite(one.high):
            yield math.nextafter(one.high, math.inf), 2
        if math.isfinite(one.low):
            yield (one.low if one.low_open else math.nextafter(one.low, -math.inf)), 2
    elif one.ranged and one.type.name == "i32":
        yield int(one.high) + 1, 2
        yield int(one.low) - 1, 2


def _cases() -> Iterator[tuple[Message, str, int]]:
    """Messages with one bad number each, the path of that number, and the code."""
    for name, message in SPEC.messages.items():
        if message.groups:
            continue
        for index in range(6):  # different examples reach different members of the unions
            good = MESSAGES[message.id].decode(sample_bodies.body(SPEC, name, f"range-{index}"))
            for path, bad, code in _spoilt(good, message.fields):
                yield bad, path, code


def _spoilt(value: Any, fields: list[schema.Field]) -> Iterator[tuple[str, Any, int]]:
    for one in fields:
        here = getattr(value, one.name)
        for path, bad, code in _spoilt_field(here, one):
            yield one.name + path, dataclasses.replace(value, **{one.name: bad}), code


def _spoilt_field(here: Any, one: schema.Field) -> Iterator[tuple[str, Any, int]]:
    kind = one.type.kind
    if kind == "prim" and one.type.name not in ("bool",):
        for bad, code in _bad_values(one):
            yield "", bad, code
    elif kind == "array":
        place = one.type.size - 1
        for bad, code in _bad_values(one):
            yield f"[{place}]", (*here[:place], bad), code
    elif kind in ("struct", "union", "opt"):
        if here is not None:
            for path, bad, code in _spoilt(here, _fields_of(here)):
                yield "." + path, bad, code
    elif kind == "list" and here and dataclasses.is_dataclass(here[0]):
        for path, bad, code in _spoilt(here[0], _fields_of(here[0])):
            yield "[0]." + path, (bad, *here[1:]), code


def _fields_of(value: Any) -> list[schema.Field]:
    return SPEC.structs[type(value).__name__].fields


def test_a_value_just_outside_is_refused_by_both_languages_with_the_same_code(
    recode: Callable[..., list[str]],
) -> None:
    cases = list(_cases())
    assert len(cases) > 1000
    for message, path, code in cases:
        assert verdict(message) == f"{code}:{path}"
    answers = recode([(message.TYPE, message.encode()) for message, *_ in cases])
    for (message, path, code), answer in zip(cases, answers, strict=True):
        assert answer.rsplit(" ", 1)[-1] == f"{code}:{path}", message


def test_a_quaternion_must_be_of_unit_length() -> None:
    pose = wire.Pose(xyz=(0.0, 0.0, 0.0), quat=(0.0, 0.0, 0.0, 0.99))
    item = wire.Item(motion=wire.LinRel(offset=pose))
    assert verdict(wire.Run(items=(item,))) == "4:items[0].motion.offset.quat"


def test_lengths_are_bounded() -> None:
    assert verdict(wire.Run(items=())) == "3:items"
    assert verdict(wire.ShowMessage(severity=wire.Severity.INFO, text="x" * 513)) == "3:text"


def test_every_message_is_in_the_table() -> None:
    assert set(typing.get_args(wire.Message)) == set(MESSAGES.values())
