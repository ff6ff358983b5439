"""A request and its answer in one call of C: the bytes of the session, and nothing lost when something else comes."""

from __future__ import annotations

import select
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.errors import RemoteProtocolError
from heptarm.io.exchange import Exchange, ReceiveState, compiled_link
from heptarm.io.tcp import MSG_DONTWAIT
from heptarm.wire.messages import Accepted, JointState, Message, Ping, Rejected, SetOverride, State
from heptarm.wire.session import RECEIVED, REQUESTED, SENT, UNREAD, Received, Session, StateReceived
from tests.wire.pairs import open_pair, pour

KEYS = (None, b"k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj")
HALF = SetOverride(value=0.5)
PATIENCE = 0.1


@dataclass
class Line:
    """A client whose requests go through a real socket, and the cabinet's session at its other end."""

    key: bytes | None = None
    left: list[bytes] = field(default_factory=list)
    pending: dict[int, str] = field(default_factory=dict)
    spare: list[str] = field(default_factory=lambda: ["spare"])
    reading: threading.Lock = field(default_factory=threading.Lock)
    sending: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.client, self.cabinet = open_pair(self.key)
        with socket.create_server(("127.0.0.1", 0)) as server:
            self.near = socket.create_connection(server.getsockname())
            self.far = server.accept()[0]
        patience = struct.pack("@ll", 0, round(PATIENCE * 1e6))
        self.near.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, patience)
        self.far.settimeout(10.0)
        self.far.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        made = self.functions(self.client)
        assert made is not None, "these tests need the compiled part"
        self.exchange: Exchange[str] = made[0]
        self.state: ReceiveState = made[1]

    def functions(self, session: Session) -> tuple[Exchange[str], ReceiveState] | None:
        """What a session gets for this connection."""
        return compiled_link(
            session,
            self.near.fileno,
            left=self.left,
            pending=self.pending,
            spare=self.spare,
            reading=self.reading,
            sending=self.sending,
        )

    def ask(self, message: Message = HALF, now: int = 5) -> tuple[int, bytes] | str | None:
        return self.exchange(type(message), message.TYPE, now, message.encode())

    def ask_and_get(self, *replies: Callable[[int], bytes]) -> tuple[int, bytes] | str | None:
        """Ask, while the cabinet gets the whole frame and replies to this id, piece by piece."""
        thread = threading.Thread(target=self._reply, args=replies)
        thread.start()
        answer = self.ask()
        thread.join()
        return answer

    def _reply(self, *replies: Callable[[int], bytes]) -> None:
        (event,) = pour(self.far.recv(65536), self.cabinet)
        assert isinstance(event, Received)
        self.event = event
        for reply in replies:
            self.far.sendall(reply(event.request))
            time.sleep(PATIENCE / 10)

    def accepted(self, request: int) -> bytes:
        return self.cabinet.send(Accepted(id=0), request=request)

    def read(self) -> list[Message]:
        """What the session reads after a request: what was left, then what is in the socket."""
        events = pour(b"".join(self.left), self.client)
        self.left.clear()
        self.near.setblocking(False)
        try:
            events += pour(self.near.recv(65536), self.client)
        except BlockingIOError:
            pass
        return [event.message for event in events if isinstance(event, Received)]

    def close(self) -> None:
        assert not self.reading.locked() and not self.sending.locked()
        self.near.close()
        self.far.close()


@pytest.fixture(params=KEYS, ids=["no key", "key"])
def line(request: pytest.FixtureRequest) -> Iterator[Line]:
    made = Line(request.param)
    yield made
    made.close()


def test_a_request_and_its_answer(line: Line) -> None:
    for number in range(1, 4):
        assert line.ask_and_get(line.accepted) == (Accepted.TYPE, Accepted(id=0).encode())
        assert line.event == Received(HALF, number, 5)
    assert not line.left and not line.pending and not line.client.waiting
    assert line.client.counts[RECEIVED] == line.cabinet.counts[SENT]


@pytest.mark.parametrize("key", KEYS, ids=["no key", "key"])
@given(
    value=st.floats(0.0, 1.0),
    seq=st.integers(0, 0xFFFFFFFE),
    last=st.integers(0, 0xFFFFFFFF),
    now=st.integers(-(1 << 63), (1 << 63) - 1),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.differing_executors])
def test_the_bytes_are_those_of_the_session(
    key: bytes | None, value: float, seq: int, last: int, now: int
) -> None:
    line, message = Line(key), SetOverride(value=value)
    counts = line.client.counts
    counts[SENT], counts[REQUESTED] = seq, last
    before = counts[:]
    request = line.client.next_request()
    wanted = line.client.send(message, request=request, time=now)
    after = counts[:]
    counts[:] = before
    line.client.waiting.clear()
    assert line.ask(message, now) == "spare"  # no answer in time: others wait for it
    assert line.far.recv(65536) == wanted
    assert counts == after and line.pending == {request: "spare"} and not line.spare
    assert line.client.waiting == {request: SetOverride}
    line.close()


def test_the_last_sequence_number_is_left_to_the_session(line: Line) -> None:
    """After it, the tags of a session with a key begin again."""
    line.client.counts[SENT] = 0xFFFFFFFF
    assert line.ask() is None and line.client.counts[SENT] == 0xFFFFFFFF


def test_what_comes_before_the_answer_is_left_to_the_session(line: Line) -> None:
    ping = line.cabinet.send(Ping(sent=3))
    assert line.ask_and_get(lambda request: ping + line.accepted(request)) == "spare"
    assert list(line.pending) == [1] and line.read() == [Ping(sent=3), Accepted(id=0)]


def test_what_comes_with_the_answer_is_left_to_the_session(line: Line) -> None:
    assert (
        line.ask_and_get(lambda request: line.accepted(request) + line.cabinet.send(Ping(sent=3))) == "spare"
    )
    assert line.read() == [Accepted(id=0), Ping(sent=3)]


@pytest.mark.parametrize("size", [1, 25, 26, 27])
def test_an_answer_in_pieces_is_left_to_the_session(line: Line, size: int) -> None:
    answer = b""

    def first(request: int) -> bytes:
        nonlocal answer
        answer = line.accepted(request)
        return answer[:size]

    assert line.ask_and_get(first, lambda _: answer[size:]) == "spare"
    time.sleep(PATIENCE)
    assert line.read() == [Accepted(id=0)]


def test_a_refusal_is_an_answer(line: Line) -> None:
    refusal = Rejected(code=1, parameter="value", text="too large", value="2", allowed="[0, 1]")
    answer = line.ask_and_get(lambda request: line.cabinet.send(refusal, request=request))
    assert isinstance(answer, tuple) and line.client.answer(*answer) == refusal


def test_an_answer_that_is_none_ends_the_session(line: Line) -> None:
    with pytest.raises(RemoteProtocolError, match="as the answer to a request"):
        line.client.answer(Ping.TYPE, Ping(sent=1).encode())
    with pytest.raises(RemoteProtocolError):
        list(line.client.events())


@pytest.mark.parametrize("at", range(26 + 4))
def test_a_changed_answer_is_left_to_the_session(line: Line, at: int) -> None:
    """Whichever byte of the frame is changed: the session finds out, if anybody can."""
    unprotected = line.key is None and (at in (4, 5) or at >= 18)  # type, time, body

    def changed(request: int) -> bytes:
        data = bytearray(line.accepted(request))
        data[at] ^= 0x40
        return bytes(data)

    answer = line.ask_and_get(changed)
    if unprotected:
        assert isinstance(answer, tuple)
        return
    assert answer == "spare" and line.client.counts[RECEIVED] == line.cabinet.counts[SENT] - 1
    if at in (8, 9):  # the length: the frame is not complete yet
        assert line.read() == [] and line.client.counts[UNREAD]
        return
    with pytest.raises(RemoteProtocolError):
        line.read()


@pytest.mark.parametrize(
    "busy", ["reading", "sending", "part of a frame", "bytes left", "no spare", "closed", "long"]
)
def test_where_it_cannot_be_done_nothing_is_sent(line: Line, busy: str) -> None:
    locks = {"reading": line.reading, "sending": line.sending}
    if busy in locks:
        locks[busy].acquire()
    elif busy == "part of a frame":
        assert pour(line.cabinet.send(Ping(sent=1))[:9], line.client) == []
    elif busy == "bytes left":
        line.left.append(b"x")
    elif busy == "no spare":
        line.spare.clear()
    elif busy == "closed":
        line.near.close()
    counts = line.client.counts[:]
    body = bytes(2000) if busy == "long" else HALF.encode()
    assert line.exchange(SetOverride, SetOverride.TYPE, 5, body) is None
    assert line.client.counts == counts and not line.pending and not line.client.waiting
    if busy in locks:
        locks[busy].release()
    if busy != "closed":
        line.far.setblocking(False)
        with pytest.raises(BlockingIOError):
            line.far.recv(1)


def test_a_socket_that_takes_nothing_now(line: Line) -> None:
    line.near.setblocking(False)
    with pytest.raises(BlockingIOError):
        while True:
            line.near.send(bytes(65536))
    assert line.ask() is None and line.client.counts[REQUESTED] == 0


def test_a_connection_that_is_lost(line: Line) -> None:
    line.far.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    line.far.close()  # a reset
    time.sleep(0.01)
    with pytest.raises(OSError, match=r"reset|Broken pipe"):
        for _ in range(3):
            line.ask()
            line.spare.append("spare")


def test_wrong_arguments_are_refused(line: Line) -> None:
    exchange: Any = line.exchange
    counts = line.client.counts[:]
    for wrong in (
        (),
        (SetOverride, 40, 5),
        (SetOverride, 40, 5, "text"),
        (SetOverride, "40", 5, b""),
        (1, 2, None, b""),
    ):
        with pytest.raises(TypeError):
            exchange(*wrong)
    assert line.client.counts == counts


STATE = State(joints=JointState(stamp=7, q=(0.1,) * 7, q_cmd=(0.2,) * 7, dq=(0.3,) * 7))


def sent(line: Line, data: bytes) -> tuple[int, bytes] | bool | None:
    """What is received after the cabinet has sent this."""
    line.far.sendall(data)
    select.select([line.near], [], [], 10.0)
    return line.state(State.TYPE, 0)


def test_a_state(line: Line) -> None:
    for now in (-5, 0, 1 << 62):
        assert sent(line, line.cabinet.send(STATE, time=now)) == (now, STATE.encode())
    assert line.client.counts[RECEIVED] == line.cabinet.counts[SENT] and not line.left
    assert line.state(State.TYPE, MSG_DONTWAIT) is None and line.state(State.TYPE, 0) is None


def test_whatever_is_no_single_state_is_left_to_the_session(line: Line) -> None:
    assert sent(line, line.cabinet.send(Ping(sent=1))) is False
    assert line.state(State.TYPE, 0) is False, "what was left comes first"
    assert line.read() == [Ping(sent=1)]
    first, second = (line.cabinet.send(STATE, time=now) for now in (1, 2))
    assert sent(line, first + second) is False
    states = pour(b"".join(line.left), line.client)
    assert [state.time for state in states] == [1, 2]
    line.left.clear()
    third = line.cabinet.send(STATE, time=3)
    assert sent(line, third[:100]) is False and pour(line.left.pop(), line.client) == []
    line.far.sendall(third[100:])
    assert line.state(State.TYPE, 0) is False and not line.left, "the session has a part of it"
    assert pour(line.near.recv(65536), line.client) == [StateReceived(STATE.encode(), 3)]
    assert sent(line, line.cabinet.send(STATE, time=4)) == (4, STATE.encode())


@pytest.mark.parametrize("at", [0, 2, 3, 5, 9, 13, 17])
def test_a_changed_state_is_left_to_the_session(line: Line, at: int) -> None:
    data = bytearray(line.cabinet.send(STATE, time=1))
    data[at] ^= 0x40
    assert sent(line, bytes(data)) is False
    assert bytes(data) == b"".join(line.left)


def test_the_end_of_a_connection_is_left_to_the_transport(line: Line) -> None:
    line.far.shutdown(socket.SHUT_WR)
    assert line.state(State.TYPE, 0) is False
    line.near.close()
    assert line.state(State.TYPE, 0) is False


def test_in_a_python_without_its_lock_there_is_none(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "_is_gil_enabled", lambda: False, raising=False)
    assert line.functions(open_pair(None)[0]) is None
