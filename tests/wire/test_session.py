"""The session state machine: all transitions, any split of the bytes, and noise."""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codes import Code
from heptarm.wire.frames import MAX_UNREAD, FrameReader, pack
from heptarm.wire.messages import (
    HEADER,
    MAGIC,
    MAJOR,
    MAX_BODY,
    MESSAGES,
    ONE_WAY,
    Accepted,
    Goodbye,
    Groups,
    Hello,
    JointState,
    Message,
    OneWay,
    Ping,
    Refusal,
    ServoJoints,
    State,
    Stop,
    Subscribe,
)
from heptarm.wire.session import REQUESTED, SENT, Received, Session, Side, StateReceived
from heptarm.wire.states import TRANSITIONS, SessionState, symbol
from tests.wire.pairs import open_pair, pour, welcome

NONCES = bytes(32), bytes(range(32))
SYMBOLS = {symbol(kind) for kind in MESSAGES.values()}


def joints(stamp: int) -> State:
    return State(joints=JointState(stamp=stamp, q=(0.1,) * 7, q_cmd=(0.2,) * 7, dq=(0.0,) * 7))


# ------------------------------------------------------------------------------------ the table


def test_every_state_is_in_the_table_and_every_symbol_is_a_message() -> None:
    assert set(TRANSITIONS) == set(SessionState)
    used = {name for row in TRANSITIONS.values() for name in row}
    assert used == SYMBOLS


def test_every_state_can_be_reached_and_left() -> None:
    reached = {SessionState.START}
    for _ in SessionState:
        reached |= {after for state in reached for after in TRANSITIONS[state].values()}
    assert reached == set(SessionState)
    for state, row in TRANSITIONS.items():
        assert (SessionState.CLOSED in row.values()) == (state is not SessionState.CLOSED)


def test_handshake_messages_are_legal_before_the_session_stands_only() -> None:
    for kind in MESSAGES.values():
        if kind.KIND == "handshake":
            assert symbol(kind) not in TRANSITIONS[SessionState.OPEN]


# ------------------------------------------------------------------------------------ handshake


def test_hello_and_welcome_open_the_session() -> None:
    client, cabinet = open_pair()
    assert client.state is cabinet.state is SessionState.OPEN


def test_a_refusal_of_another_version_is_understood() -> None:
    client = Session(Side.CLIENT)
    client.send(client.hello(name="t"))
    body = Refusal(code=14, text="no", major=1, minor=1).encode()
    frame = bytearray(pack(Refusal.TYPE, body, seq=0))
    frame[2] = 1
    (event,) = pour(bytes(frame), client)
    assert isinstance(event, Received) and event.message.major == 1
    assert client.state is SessionState.CLOSED


def test_any_other_frame_of_another_version_is_refused() -> None:
    client, cabinet = open_pair()
    frame = bytearray(cabinet.send(Ping(sent=1)))
    frame[2] = 1
    with pytest.raises(RemoteProtocolError, match="version 1") as error:
        pour(bytes(frame), client)
    assert error.value.code == Code.WRONG_VERSION


# ------------------------------------------------------------------------------------ requests


def test_requests_and_answers_carry_the_id() -> None:
    client, cabinet = open_pair()
    request = client.next_request()
    (event,) = pour(client.send(Stop(), request=request, time=5), cabinet)
    assert isinstance(event, Received) and (event.request, event.time) == (request, 5)
    (event,) = pour(cabinet.send(Accepted(id=0), request=request), client)
    assert isinstance(event, Received) and event.request == request


def test_request_ids_are_never_zero() -> None:
    client, _ = open_pair()
    client.counts[REQUESTED] = 0xFFFFFFFE
    assert [client.next_request(), client.next_request()] == [0xFFFFFFFF, 1]


def test_what_a_side_may_not_send() -> None:
    client, cabinet = open_pair()
    before = client.counts[SENT]
    cases: list[tuple[Message, int]] = [
        (Accepted(id=1), 1),
        (Stop(), 0),
        (Ping(sent=0), 3),
        (client.hello(name=""), 0),
    ]
    for message, request in cases:
        with pytest.raises(LocalProtocolError):
            client.send(message, request=request)
    with pytest.raises(LocalProtocolError, match="no request 9"):
        cabinet.send(Accepted(id=1), request=9)
    client.send(Stop(), request=4)
    with pytest.raises(LocalProtocolError, match="in use"):
        client.send(Stop(), request=4)
    assert client.counts[SENT] == before + 1  # nothing illegal has left a trace


@pytest.mark.parametrize("kind", ONE_WAY, ids=lambda kind: kind.__name__)
def test_numbers_become_the_bytes_of_the_message_that_they_are(kind: type[OneWay]) -> None:
    body = kind.LAYOUT.pack(*range(1, 1 + len(kind.LAYOUT.unpack(bytes(kind.LAYOUT.size)))))
    message, numbers = kind.decode(body), kind.LAYOUT.unpack(body)
    (by_message, _), (by_numbers, cabinet) = open_pair(), open_pair()
    for time in (5, 6):
        data = by_numbers.send_numbers(kind, numbers, time=time)
        assert data == by_message.send(message, time=time)
        assert pour(data, cabinet) == [Received(message, 0, time)]
    assert pour(by_numbers.send(Ping(sent=1)), cabinet)  # both count the frames of one stream


def test_numbers_that_may_not_be_sent_leave_no_trace() -> None:
    client, cabinet = open_pair()
    target = (1, 0.1, *[0.5] * 7)
    with pytest.raises(LocalProtocolError, match="the cabinet may not send a ServoJoints"):
        cabinet.send_numbers(ServoJoints, target, time=0)
    with pytest.raises(LocalProtocolError, match="in state 'start'"):
        Session(Side.CLIENT).send_numbers(ServoJoints, target, time=0)
    for wrong in (target[:-1], (*target, 0.5), (*target[:-1], "0.5")):
        with pytest.raises(struct.error):
            client.send_numbers(ServoJoints, wrong, time=0)  # type: ignore[arg-type]
    assert pour(client.send_numbers(ServoJoints, target, time=0), cabinet)
    client.send(Goodbye(code=0, text=""))
    with pytest.raises(LocalProtocolError, match="in state 'closed'"):
        client.send_numbers(ServoJoints, target, time=0)


def test_nothing_is_sent_before_hello_and_after_goodbye() -> None:
    client = Session(Side.CLIENT)
    with pytest.raises(LocalProtocolError):
        client.send(Stop(), request=1)
    client, cabinet = open_pair()
    pour(client.send(Goodbye(code=0, text="")), cabinet)
    assert client.state is cabinet.state is SessionState.CLOSED
    with pytest.raises(LocalProtocolError):
        client.send(Ping(sent=0))


def test_what_comes_after_the_end_is_ignored() -> None:
    client, cabinet = open_pair()
    late = cabinet.send(joints(1))
    client.send(Goodbye(code=0, text=""))
    assert pour(late, client) == []


@pytest.mark.parametrize("case", ["answer nobody asked", "own side's message", "request id in use", "seq"])
def test_what_the_other_side_may_not_send(case: str) -> None:
    client, cabinet = open_pair()
    with pytest.raises(RemoteProtocolError) as error:
        if case == "answer nobody asked":
            pour(pack(Accepted.TYPE, Accepted(id=1).encode(), seq=1, request=5), client)
        elif case == "own side's message":
            pour(pack(Stop.TYPE, Stop().encode(), seq=1, request=5), client)
        elif case == "seq":
            pour(pack(Ping.TYPE, Ping(sent=1).encode(), seq=2), client)
        else:
            one = client.send(Stop(), request=5)
            twice = pack(Stop.TYPE, Stop().encode(), seq=2, request=5)
            pour(one + twice, cabinet)
    assert error.value.code in (Code.UNEXPECTED_MESSAGE, Code.FORGED_FRAME)
    assert SessionState.CLOSED in (client.state, cabinet.state)


def test_a_broken_session_stays_broken() -> None:
    client, _ = open_pair()
    for _ in range(2):
        with pytest.raises(RemoteProtocolError):
            pour(b"garbage", client)


def test_a_state_is_decoded_when_wanted() -> None:
    client, cabinet = open_pair()
    (event,) = pour(cabinet.send(joints(42), time=43), client)
    assert isinstance(event, StateReceived) and event.time == 43
    assert event.decode() == joints(42)
    with pytest.raises(RemoteProtocolError, match="State"):
        StateReceived(b"\xff\xff", 0).decode()


# ------------------------------------------------------------------------------------ bytes


def conversation() -> tuple[bytes, list[Received | StateReceived]]:
    """Messages of a cabinet in a session, and the events that a client must derive from them."""
    client, cabinet = Session(Side.CLIENT, nonce=NONCES[0]), Session(Side.CABINET, nonce=NONCES[1])
    pour(client.send(client.hello(name="t")), cabinet)
    pour(client_frame := b"", cabinet)
    data = client_frame + cabinet.send(welcome())
    pour(data, client)
    pour(client.send(Subscribe(groups=Groups.JOINTS, rate=10.0), request=1), cabinet)
    data += cabinet.send(Accepted(id=0), request=1)
    for stamp in range(5):
        data += cabinet.send(joints(stamp))
        data += cabinet.send(Ping(sent=stamp))
    data += cabinet.send(Goodbye(code=20, text="end"))
    fresh = asked()
    return data, pour(data, fresh)


def asked() -> Session:
    client = Session(Side.CLIENT, nonce=NONCES[0])
    client.send(client.hello(name="t"))
    client.waiting[1] = Subscribe
    return client


DATA, EVENTS = conversation()


@given(st.lists(st.integers(0, len(DATA)), max_size=40))
def test_any_split_of_the_bytes_means_the_same(cuts: list[int]) -> None:
    client = asked()
    events: list[object] = []
    edges = [0, *sorted(cuts), len(DATA)]
    for start, end in pairwise(edges):
        events += pour(DATA[start:end], client)
    assert events == EVENTS
    assert len(EVENTS) == 13


def test_one_byte_at_a_time() -> None:
    client = asked()
    assert [event for byte in DATA for event in pour(bytes([byte]), client)] == EVENTS


@given(st.binary(max_size=400))
@settings(max_examples=300)
def test_noise_raises_nothing_but_remote_protocol_errors(noise: bytes) -> None:
    for session in (asked(), *open_pair()):
        try:
            for event in pour(noise, session):
                if isinstance(event, StateReceived):
                    event.decode()
        except RemoteProtocolError:
            assert session.state is SessionState.CLOSED


@given(
    st.sampled_from(sorted(MESSAGES)) | st.integers(0, 65535),
    st.binary(max_size=120),
    st.integers(0, 3),
    st.integers(0, 2),
)
@settings(max_examples=500)
def test_well_framed_noise_raises_nothing_but_remote_protocol_errors(
    kind: int, body: bytes, seq: int, request: int
) -> None:
    for session in (asked(), Session(Side.CABINET), *open_pair()):
        try:
            for event in pour(pack(kind, body, seq=seq, request=request), session):
                if isinstance(event, StateReceived):
                    event.decode()
        except RemoteProtocolError as error:
            assert error.code and session.state in (SessionState.CLOSED, SessionState.OPEN)


@given(st.data())
@settings(max_examples=200)
def test_mutated_conversations_raise_nothing_but_remote_protocol_errors(data: st.DataObject) -> None:
    noisy = bytearray(DATA)
    for place, value in data.draw(st.lists(st.tuples(st.integers(0, len(DATA) - 1), st.integers(0, 255)))):
        noisy[place] = value
    client = asked()
    try:
        for event in pour(bytes(noisy), client):
            if isinstance(event, StateReceived):
                event.decode()
    except RemoteProtocolError:
        pass


def test_a_frame_that_announces_too_much_is_refused_before_it_comes() -> None:
    reader = FrameReader()
    reader.feed(HEADER.pack(MAGIC, MAJOR, 0, 1, MAX_BODY + 1, 0, 0, 0))
    with pytest.raises(RemoteProtocolError, match="announces"):
        reader.read()


def test_another_protocol_is_refused_at_its_second_byte() -> None:
    reader = FrameReader()
    reader.feed(b"GE")
    with pytest.raises(RemoteProtocolError):
        reader.read()


def test_flags_are_reserved() -> None:
    reader = FrameReader()
    reader.feed(HEADER.pack(MAGIC, MAJOR, 4, 1, 0, 0, 0, 0))
    with pytest.raises(RemoteProtocolError, match="flags"):
        reader.read()


def test_memory_is_bounded() -> None:
    reader = FrameReader()
    reader.feed(bytes(MAX_UNREAD))
    with pytest.raises(LocalProtocolError):
        reader.feed(b"x")


def test_consumed_bytes_are_dropped() -> None:
    reader = FrameReader()
    frame = pack(Ping.TYPE, bytes(1000), seq=0)
    for _ in range(500):
        reader.feed(frame + frame[:100])
        assert reader.read() is not None
        reader.feed(frame[100:])
        assert reader.read() is not None
        assert len(reader) == 0
    reader.feed(frame * 200 + b"H")
    while reader.read() is not None:
        assert len(reader._buffer) <= 201 * len(frame)
    assert len(reader) == 1
    reader.feed(b"A")
    assert len(reader) == len(reader._buffer) == 2


def test_a_body_that_is_too_long_is_not_packed() -> None:
    with pytest.raises(LocalProtocolError):
        pack(1, bytes(MAX_BODY + 1), seq=0)


def test_names_are_cut_to_what_the_protocol_carries() -> None:
    hello = Session(Side.CLIENT).hello(name="x" * 100, version="y" * 100)
    assert isinstance(hello, Hello)
    hello.validate()
