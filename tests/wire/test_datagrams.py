"""Datagrams: golden bytes, newest wins, age, and whatever arrives instead is ignored and counted."""

from __future__ import annotations

import json
from dataclasses import astuple
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.wire import messages as wire
from heptarm.wire.datagrams import Datagrams
from heptarm.wire.frames import pack
from heptarm.wire.key import KeyExchange, datagram_tags
from heptarm.wire.session import Received
from tests.wire.pairs import open_pair

VECTORS = {
    name: bytes.fromhex(value)
    for name, value in json.loads(
        (Path(__file__).parents[2] / "schema" / "golden" / "key.json").read_text()
    ).items()
}
TOKEN, NOW, LIMIT = VECTORS["token"], 1_234_567_890, 500_000_000
TARGET = wire.ServoJoints(servo=9, watchdog=0.2, q=tuple(0.1 * axis for axis in range(7)))
PONG = wire.Pong(sent=NOW - 1000, received=NOW)


def ends(secret: bytes | None = None, token: bytes = TOKEN) -> tuple[Datagrams, Datagrams]:
    up, down = datagram_tags(secret, token)
    return Datagrams(5, "client", up, down), Datagrams(5, "cabinet", down, up)


def numbers() -> tuple[float, ...]:
    return (TARGET.servo, TARGET.watchdog, *TARGET.q)


@pytest.mark.parametrize("with_key", [True, False])
def test_golden_datagrams(with_key: bool) -> None:
    v, secret, end = VECTORS, None, "_without_key"
    if with_key:
        exchange = KeyExchange(v["key"])
        nonces = wire.Hello.decode(v["hello"]).nonce, wire.Challenge.decode(v["challenge"]).nonce
        secret, end = exchange.secret(*nonces), ""
    client, cabinet = ends(secret)
    for _ in range(3):
        client.pack(wire.Ping(sent=0), time=NOW)
    assert client.pack_numbers(wire.ServoJoints, numbers(), time=NOW, number=17) == v[f"target_datagram{end}"]
    for _ in range(4):
        cabinet.pack(wire.Ping(sent=0), time=NOW)
    assert cabinet.pack(PONG, time=NOW) == v[f"pong_datagram{end}"]
    client, cabinet = ends(secret)
    frame = cabinet.receive(v[f"target_datagram{end}"], now=NOW, limit=LIMIT)
    assert frame is not None
    assert (wire.ServoJoints.decode(frame.body), frame.seq, frame.request) == (TARGET, 3, 17)
    frame = client.receive(v[f"pong_datagram{end}"], now=NOW, limit=LIMIT)
    assert frame is not None and wire.Pong.decode(frame.body) == PONG


@pytest.mark.parametrize("key", [None, b"k" * 32])
def test_both_sides_of_a_session_derive_the_same_keys(key: bytes | None) -> None:
    client, cabinet = (one.datagrams(7, TOKEN) for one in open_pair(key))
    assert cabinet.receive(client.pack(wire.Ping(sent=1), time=NOW), now=NOW, limit=LIMIT) is not None
    assert client.receive(cabinet.pack(PONG, time=NOW), now=NOW, limit=LIMIT) is not None


def test_a_session_with_a_key_has_other_keys_than_one_without() -> None:
    data = open_pair(b"k" * 32)[0].datagrams(7, TOKEN).pack(wire.Ping(sent=1), time=NOW)
    cabinet = open_pair()[1].datagrams(7, TOKEN)
    assert cabinet.receive(data, now=NOW, limit=LIMIT) is None
    assert cabinet.ignored.forged == 1


def test_newer_ones_of_a_stream_count_and_others_do_not_disturb_it() -> None:
    client, cabinet = ends()
    sent = [client.pack_numbers(wire.ServoJoints, numbers(), time=NOW, number=n) for n in range(4)]
    ping = client.pack(wire.Ping(sent=0), time=NOW)
    stop = client.pack(wire.Stop(), time=NOW, request=3)
    got = [
        cabinet.receive(one, now=NOW, limit=LIMIT) for one in (ping, sent[1], sent[0], sent[1], stop, sent[3])
    ]
    assert [one is not None for one in got] == [True, True, False, False, True, True]
    assert (cabinet.ignored.accepted, cabinet.ignored.old) == (4, 2)


def test_one_that_is_too_old_is_late_and_does_not_count_as_the_newest() -> None:
    client, cabinet = ends()
    late = client.pack(wire.Ping(sent=0), time=NOW - LIMIT - 1)
    fresh = client.pack(wire.Ping(sent=0), time=NOW - LIMIT)
    assert cabinet.receive(late, now=NOW, limit=LIMIT) is None
    assert cabinet.receive(fresh, now=NOW, limit=LIMIT) is not None
    assert cabinet.ignored.late == 1


def test_datagrams_of_another_token_direction_or_session_do_not_count() -> None:
    client, cabinet = ends()
    ping = client.pack(wire.Ping(sent=0), time=NOW)
    assert client.receive(ping, now=NOW, limit=LIMIT) is None  # reflected
    assert ends(token=bytes(32))[1].receive(ping, now=NOW, limit=LIMIT) is None
    assert cabinet.receive(b"\0\0\0\6" + ping[4:], now=NOW, limit=LIMIT) is None
    assert cabinet.receive(ping, now=NOW, limit=LIMIT) is not None


@pytest.mark.parametrize("message", [wire.SetOverride(value=0.1), wire.Goodbye(code=0, text="")])
def test_a_message_that_no_datagram_may_contain_is_ignored(message: wire.Message) -> None:
    up, down = datagram_tags(None, TOKEN)
    data = b"\0\0\0\5" + pack(message.TYPE, message.encode(), seq=0, time=NOW, tag=up)
    cabinet = Datagrams(5, "cabinet", down, up)
    assert cabinet.receive(data, now=NOW, limit=LIMIT) is None
    assert cabinet.ignored.damaged == 1


def test_a_tag_of_the_stream_does_not_fit_a_datagram() -> None:
    client, cabinet = open_pair(b"k" * 32)
    frame = client.send(wire.Ping(sent=1), time=NOW)
    datagrams = cabinet.datagrams(7, TOKEN)
    assert datagrams.receive(b"\0\0\0\7" + frame, now=NOW, limit=LIMIT) is None
    assert datagrams.ignored.forged == 1


@given(st.binary(max_size=1600))
def test_garbage_is_ignored(data: bytes) -> None:
    _, cabinet = ends()
    assert cabinet.receive(data, now=NOW, limit=LIMIT) is None
    assert sum(astuple(cabinet.ignored)) == 1


@given(st.integers(0, 10**6), st.integers(1, 255), st.integers(0, 200))
def test_any_changed_or_missing_byte_is_noticed(place: int, change: int, cut: int) -> None:
    client, cabinet = ends(b"s" * 32)
    whole = client.pack_numbers(wire.ServoJoints, numbers(), time=NOW, number=1)
    data = bytearray(whole)
    data[place % len(data)] ^= change
    for one in (bytes(data), whole[: cut % len(whole)], whole + bytes(1 + cut)):
        assert cabinet.receive(one, now=NOW, limit=LIMIT) is None
    assert cabinet.ignored.accepted == 0
    assert cabinet.receive(whole, now=NOW, limit=LIMIT) is not None  # and nothing is broken


@given(st.permutations(range(12)), st.lists(st.integers(0, 11), max_size=12))
def test_in_any_order_with_any_repetition_the_accepted_ones_rise(order: list[int], again: list[int]) -> None:
    client, cabinet = ends()
    sent = [client.pack_numbers(wire.ServoJoints, numbers(), time=NOW, number=n + 1) for n in range(12)]
    got = [cabinet.receive(sent[n], now=NOW, limit=LIMIT) for n in [*order, *again]]
    accepted = [frame.request for frame in got if frame is not None]
    assert accepted == sorted(set(accepted)) and accepted[-1] == 12


def test_a_number_of_a_target_is_legal_in_the_session_too() -> None:
    client, cabinet = open_pair()
    data = client.send_numbers(wire.ServoJoints, numbers(), time=NOW, number=4711)
    cabinet.receive_data(data)
    (event,) = cabinet.events()
    assert isinstance(event, Received)
    assert (event.message, event.request) == (TARGET, 4711)
