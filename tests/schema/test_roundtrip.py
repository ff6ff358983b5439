"""Any legal body survives a round trip; any other bytes raise DecodeError and nothing else, in both languages."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sample_bodies
import spec as schema
from heptarm.arm.translate.state import read_state
from heptarm.record.journal import plain, restored
from heptarm.wire.clock_sync import ClockOffset
from heptarm.wire.codec import DecodeError
from heptarm.wire.messages import MESSAGES, SafetyBits, State
from heptarm.wire.state_groups import StateGroups
from tests.schema.python_side import recoded

SPEC = schema.load()
NAMES = sorted(SPEC.messages)
REQUESTS = [name for name in NAMES if SPEC.messages[name].kind == "request"]


@given(name=st.sampled_from(NAMES), seed=st.integers(0, 2**32), size=st.integers(0, 5))
def test_a_legal_body_comes_back(name: str, seed: int, size: int) -> None:
    body = sample_bodies.body(SPEC, name, str(seed), size)
    message = MESSAGES[SPEC.messages[name].id].decode(body)
    assert message.encode() == body
    message.validate()


@given(name=st.sampled_from(REQUESTS), seed=st.integers(0, 2**32), size=st.integers(0, 5))
def test_a_request_comes_back_from_a_recording(name: str, seed: int, size: int) -> None:
    message = MESSAGES[SPEC.messages[name].id].decode(sample_bodies.body(SPEC, name, str(seed), size))
    again = restored(json.loads(json.dumps(plain(message), allow_nan=False)), type(message))
    assert again.encode() == message.encode()


@given(name=st.sampled_from(NAMES), seed=st.integers(0, 2**32), data=st.data())
def test_a_damaged_body_is_refused_or_read_but_nothing_else(
    name: str, seed: int, data: st.DataObject
) -> None:
    body = bytearray(sample_bodies.body(SPEC, name, str(seed)))
    for _ in range(data.draw(st.integers(0, 4))):
        if body:
            body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    cut = bytes(body[: data.draw(st.integers(0, len(body)))])
    for candidate in (bytes(body), cut, bytes(body) + b"\0", data.draw(st.binary(max_size=60))):
        try:
            MESSAGES[SPEC.messages[name].id].decode(candidate)
        except DecodeError as error:
            assert str(error)


def _group_by_group(body: bytes) -> State:
    groups = StateGroups(body)
    state = State(**{field.name: groups.get(field.name) for field in fields(State)})
    stamps = [group.stamp for field in fields(State) if (group := getattr(state, field.name)) is not None]
    assert groups.stamp == max(stamps, default=0) and groups.get("no such group") is None
    return state


@given(seed=st.integers(0, 2**32), size=st.integers(0, 5), data=st.data())
def test_the_groups_of_a_state_one_by_one_are_those_of_the_whole(
    seed: int, size: int, data: st.DataObject
) -> None:
    body = sample_bodies.body(SPEC, "State", str(seed), size)
    assert _group_by_group(body).encode() == body
    damaged = bytearray(body)
    damaged[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    for candidate in (bytes(damaged), body[: data.draw(st.integers(0, len(body)))], body + b"\0"):
        try:
            whole = State.decode(candidate)
        except DecodeError:
            with pytest.raises(DecodeError):
                _group_by_group(candidate)
        else:
            assert str(_group_by_group(candidate)) == str(whole)  # a damaged number may be NaN


@given(seed=st.integers(0, 2**32))
def test_the_groups_of_received_bytes_have_the_numbers_of_the_messages(seed: int) -> None:
    body = sample_bodies.body(SPEC, "State", str(seed), 3)
    sent, state = State.decode(body), read_state(body, ClockOffset(), lambda: 0, received=0)
    for name in ("joints", "torques", "wrench", "motion", "safety"):
        message, group = getattr(sent, name), getattr(state.groups, name)
        assert (message is None) == (group is None)
        if message is None:
            continue
        assert group.stamp == message.stamp
        if name == "safety":
            said = message.bits
            if said & SafetyBits.UNKNOWN:  # then the others have no meaning but this one
                said &= SafetyBits.MOVING
            bits = {one.name.lower() for one in SafetyBits if one.name and one & said}
            assert bits == {field.name for field in fields(group) if getattr(group, field.name) is True}
            continue
        for field in fields(group):
            read = getattr(group, field.name)
            wanted = getattr(message, {"id": "motion"}.get(field.name, field.name))
            np.testing.assert_array_equal(read, wanted)  # a number may be NaN
            assert not (isinstance(read, np.ndarray) and read.flags.writeable)


def _damaged(count: int) -> list[tuple[int, bytes]]:
    chance = random.Random(5)
    bodies = []
    for index in range(count):
        name = chance.choice(NAMES)
        body = bytearray(sample_bodies.body(SPEC, name, f"damaged-{index}"))
        for _ in range(chance.randrange(4)):
            if body:
                body[chance.randrange(len(body))] = chance.randrange(256)
        if chance.random() < 0.2:
            body = body[: chance.randrange(len(body) + 1)]
        bodies.append((SPEC.messages[name].id, bytes(body)))
    return bodies


@pytest.mark.parametrize("kind", ["legal", "damaged"])
def test_java_agrees_with_python_byte_for_byte(kind: str, recode: Callable[..., list[str]]) -> None:
    if kind == "legal":
        bodies = [
            (SPEC.messages[name].id, sample_bodies.body(SPEC, name, f"legal-{index}"))
            for index in range(40)
            for name in NAMES
        ]
    else:
        bodies = _damaged(4000)
    different = [
        (number, body.hex(), ours, theirs)
        for (number, body), theirs in zip(bodies, recode(bodies), strict=True)
        if _canonical(ours := recoded(number, body)) != _canonical(theirs)
    ]
    assert not different, different[:3]


def _canonical(answer: str) -> str:
    """A damaged NaN keeps its payload in Python and loses it in Java: a NaN is a NaN."""
    return answer if "7ff" not in answer and "fff" not in answer else answer.rsplit(" ", 1)[-1]
