"""Every field that a client sends, set through the API to every bad value: refused here, with the cabinet's code."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from tests.schema.calls import CALLS, FIXED
from tests.schema.spoiling import SPEC, Bad, cases, checked_fields

PATIENCE = 30.0
SENT = [one for one in SPEC.messages.values() if one.source == "client"]


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with ha.connect("sim://iiwa14?speed=3", watchdog=10.0, timeout=PATIENCE) as arm:
        yield arm


def refused() -> dict[str, list[Bad]]:
    """The values that each field of a client must refuse."""
    every: dict[str, dict[str, Bad]] = {}
    names = {message.name for message in SENT}
    for case in cases():
        if type(case.message).__name__ in names:
            every.setdefault(case.field, {}).setdefault(case.bad.why, case.bad)
    return {field: list(bad.values()) for field, bad in every.items()}


def test_every_field_has_a_row() -> None:
    fields = set().union(*(checked_fields(message) for message in SENT))
    assert set(CALLS) | set(FIXED) == fields
    assert not set(CALLS) & set(FIXED)


def _given(case: Bad, size: int, filler: float) -> Any:
    if size == 1 or isinstance(case.value, tuple):
        return case.value
    return [filler] * (size - 1) + [case.value]


@pytest.mark.parametrize("field", CALLS)
def test_the_client_refuses_with_the_cabinets_code(arm: ha.Arm, field: str) -> None:
    call = CALLS[field]
    before = arm.wait_for_rest(timeout=PATIENCE)
    reported = refused()[field]
    assert any(bad.why not in call.but for bad in reported)
    for bad in reported:
        if bad.why in call.but:
            continue
        value = _given(bad, call.size, call.filler)
        with pytest.raises(ha.CommandRejected) as error:
            call.do(arm, value)
        whole = call.size == 1 or isinstance(bad.value, tuple)
        name = call.name if whole else f"{call.name}[{call.size - 1}]"
        assert (error.value.code, error.value.parameter) == (bad.code, name), (bad, error.value.text)
    after = arm.wait_for_rest(timeout=PATIENCE)
    assert np.abs(after.q - before.q).max() < 1e-3 and after.tool == before.tool


@pytest.mark.parametrize("field", [field for field, call in CALLS.items() if call.size > 1])
def test_a_wrong_shape_is_refused(arm: ha.Arm, field: str) -> None:
    call = CALLS[field]
    for value in (
        [call.filler] * (call.size - 1),
        [[call.filler] * call.size],
        "numbers",
        [None] * call.size,
    ):
        with pytest.raises(ha.ShapeError) as error:
            call.do(arm, value)
        assert error.value.parameter == call.name
