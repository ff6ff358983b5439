"""Table-driven over the schema: a value just outside its range, NaN, infinity are refused by both languages alike."""

from __future__ import annotations

import typing
from collections.abc import Callable

from heptarm.wire import messages as wire
from heptarm.wire.messages import MESSAGES
from tests.schema.python_side import verdict
from tests.schema.spoiling import SPEC, cases, checked_fields


def test_a_value_just_outside_is_refused_by_both_languages_with_the_same_code(
    recode: Callable[..., list[str]],
) -> None:
    every = cases()
    assert len(every) > 1000
    for case in every:
        assert verdict(case.message) == f"{case.bad.code}:{case.path}"
    answers = recode([(case.message.TYPE, case.message.encode()) for case in every])
    for case, answer in zip(every, answers, strict=True):
        assert answer.rsplit(" ", 1)[-1] == f"{case.bad.code}:{case.path}", case.message


def test_no_field_is_forgotten() -> None:
    for message in SPEC.messages.values():
        if not message.groups:
            seen = {case.field for case in cases() if message.id == case.message.TYPE}
            assert seen == checked_fields(message), message.name


def test_a_quaternion_must_be_of_unit_length() -> None:
    pose = wire.Pose(xyz=(0.0, 0.0, 0.0), quat=(0.0, 0.0, 0.0, 0.99))
    item = wire.Item(motion=wire.LinRel(offset=pose))
    assert verdict(wire.Run(items=(item,))) == "4:items[0].motion.offset.quat"


def test_lengths_are_bounded() -> None:
    assert verdict(wire.Run(items=())) == "3:items"
    assert verdict(wire.ShowMessage(severity=wire.Severity.INFO, text="x" * 513)) == "3:text"


def test_every_message_is_in_the_table() -> None:
    assert set(typing.get_args(wire.Message)) == set(MESSAGES.values())
