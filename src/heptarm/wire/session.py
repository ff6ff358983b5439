"""State machine of a session of the wire protocol, for both sides: bytes in, events out, messages to bytes.

It has no socket, clock or thread::

    session = Session(Side.CLIENT)
    data = session.send(session.hello(name="me"))
    session.receive_data(received)
    for event in session.events():
        ...

Theory of operation
-------------------

**States.** Both sides pass through the same ones, whether a message is sent or received::

    start --Hello--> hello ----------------------Welcome--> open --Goodbye--> closed
      |                +--Challenge--> challenged --Proof--> proved --Welcome--> open
      +--Halt--> halting --Halted--> closed                 (a Refusal closes any of these)

The table is generated (`states.TRANSITIONS`); nothing here asks for a state by its name, but for what the table
allows. `_enter` derives from it once per state what the usual cases need: `simple_requests`, `takes_states`, the
packers of servo targets.

**Two kinds of error.** What this side may not send raises `LocalProtocolError`, and nothing has changed: no frame is
counted, no request waits. What the other side may not send raises `RemoteProtocolError` and closes the session for
good; every later call of `events` raises the same error again, since bytes behind a broken frame mean nothing.

**Frames are counted, not trusted.** A frame carries the number of its predecessors in this direction. The first one
that is not the next ends the session: a stream that has lost or doubled a frame, or that somebody has cut into, would
let a request pass for another one. With a key, each frame has a tag from the Welcome on (`key`), which includes that
number; where the numbers begin again, so do the tags.

**Requests** are in `waiting` from the moment of their frame until their answer, by ids that the sender chooses; an
answer of another id is a violation. Several may be under way, and events may come in between. A request that the
cabinet refuses gets a Rejected, which is an answer; a Rejected without an id is about a message that was no request.

**Proof of the key.** Hello and Challenge carry a nonce of each side, Proof and Welcome a MAC over all that came before
them. A client that has a key takes no Welcome without one; a nonce that comes back to its sender is refused, since
it would make this side prove the key to itself.

**Calls.** One thread sends and one receives at a time, and the caller sees to it (`heptarm.arm.link.link` with its
locks). `heptarm.io.exchange` sends simple requests and reads their answers in C: that is why `counts`, `waiting` and
`tags` are plain lists and dictionaries that both change, and why `answer` takes a body without a frame. What it leaves,
bytes of anything else, comes in by `receive_data` as ever.
"""

from __future__ import annotations

import enum
import functools
import hmac
import secrets
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codec import DecodeError
from heptarm.wire.codes import Code
from heptarm.wire.datagrams import Datagrams
from heptarm.wire.frames import Frame, FrameReader, forged, pack, packer
from heptarm.wire.key import FrameTag, KeyExchange, datagram_tags, without_mac
from heptarm.wire.messages import (
    MAJOR,
    MESSAGES,
    MINOR,
    NONCE,
    ONE_WAY,
    Challenge,
    Halt,
    Halted,
    Hello,
    Message,
    OneWay,
    Proof,
    Refusal,
    Rejected,
    State,
    Welcome,
)
from heptarm.wire.states import TRANSITIONS, SessionState, symbol

_WRAP = 0xFFFFFFFF
#: Places in `Session.counts`.
SENT, RECEIVED, REQUESTED, UNREAD = range(4)
_SYMBOLS = {kind: symbol(kind) for kind in MESSAGES.values()}
_PACKERS = {kind: packer(kind, None) for kind in ONE_WAY}
#: Messages that are the same in every major version: an error can name both versions, and a stop needs no version.
_FROZEN = (Hello.TYPE, Refusal.TYPE, Halt.TYPE, Halted.TYPE)


class Side(enum.Enum):
    """End of the connection."""

    CLIENT = "client"
    CABINET = "cabinet"


class Received(NamedTuple):
    """Event: a message was received.

    Attributes:
        message: the message.
        request: id of the request that it is or answers; 0 elsewhere.
        time: sender's clock [ns].
    """

    message: Message
    request: int
    time: int


class StateReceived(NamedTuple):
    """Event: a pushed state was received; `decode` decodes it.

    Attributes:
        body: bytes of the State message.
        time: sender's clock [ns].
    """

    body: bytes
    time: int

    def decode(self) -> State:
        """Decode the state.

        Raises:
            RemoteProtocolError: the bytes are not a state.
        """
        try:
            return State.decode(self.body)
        except DecodeError as error:
            raise _broken(Code.BAD_BODY, f"State: {error}") from error


class Session:
    """One side of a session.

    Args:
        side: end of the connection.
        key: pre-shared key; None for none.
        nonce: random bytes for the proof of the key [32 bytes]; None generates them.

    Attributes:
        is_proven: the other side has proved that it knows the key; False without a key.
        counts: frames sent, frames received, the last request id, and bytes of a frame that is not complete yet. A
            list, since `heptarm.io.exchange` counts what it sends and receives itself.
        waiting: requests without an answer, by their ids.
        tags: of this side's frames and of the other side's, once the key is proven.
        takes_states: whether states may come now.
        simple_requests: what may be requested now without this session, which then interprets the answer (`answer`):
            requests that keep the state as it is.
    """

    def __init__(self, side: Side, *, key: bytes | None = None, nonce: bytes | None = None) -> None:
        self._side = side
        self._source = side.value
        self._exchange = None if key is None else KeyExchange(key)
        self._nonce = secrets.token_bytes(NONCE) if nonce is None else nonce
        self._other_nonce = b""
        self.is_proven = False
        self.waiting: dict[int, type[Message]] = {}
        self._reader = FrameReader()
        self._tag: FrameTag | None = None
        self.tags: list[FrameTag] = []
        self._one_way = _PACKERS
        self._enter(SessionState.START)
        self.counts = [0, 0, 0, 0]
        self._failed: RemoteProtocolError | None = None

    @property
    def side(self) -> Side:
        """End of the connection."""
        return self._side

    @property
    def has_key(self) -> bool:
        """Whether this side has a key."""
        return self._exchange is not None

    @property
    def state(self) -> SessionState:
        """State of the session."""
        return self._state

    # ------------------------------------------------------------------------------------- sending

    def next_request(self) -> int:
        """Get an unused request id."""
        self.counts[REQUESTED] = request = self.counts[REQUESTED] % _WRAP + 1
        return request

    def send(self, message: Message, *, request: int = 0, time: int = 0) -> bytes:
        """Pack a message to send.

        Args:
            message: the message.
            request: for a request its id (`next_request`), for an answer the id of its request.
            time: this side's clock [ns].

        Raises:
            LocalProtocolError: the message is illegal in this state; nothing has changed.
        """
        kind = type(message)
        if kind in self.simple_requests and request != 0 and request not in self.waiting:  # the usual case
            body = message.encode()
            data = pack(kind.TYPE, body, seq=self.counts[SENT], request=request, time=time, tag=self._tag)
            self.waiting[request] = kind
            self._count_sent()
            return data
        after = self._legal.get(_SYMBOLS[kind])
        if after is None or (self._source != kind.SOURCE and kind.SOURCE != "both"):
            raise self._illegal(kind)
        is_numbered = kind.KIND in ("request", "answer") and (kind is not Rejected or request != 0)
        if is_numbered != (request != 0):
            raise LocalProtocolError(f"a {kind.__name__} with request id {request}")
        if kind.KIND == "request" and request in self.waiting:
            raise LocalProtocolError(f"request id {request} is in use")
        if kind.KIND == "answer" and is_numbered and request not in self.waiting:
            raise LocalProtocolError(f"no request {request} waits for an answer")
        if kind is Welcome and self._exchange is not None:
            message = self._with_mac(message)
        body = message.encode()
        data = pack(kind.TYPE, body, seq=self.counts[SENT], request=request, time=time, tag=self._tag)
        self._count_sent()
        self._after(kind, after, request, body)
        return data

    def send_numbers(
        self, kind: type[OneWay], numbers: Iterable[float], *, time: int, number: int = 0
    ) -> bytes:
        """Pack a oneway message to send, directly from the numbers of its fields; same bytes as `send`.

        For streams: between two messages of a stream the caches get cold, so every step costs time.

        Args:
            kind: class of the message.
            numbers: its fields, in order.
            time: this side's clock [ns].
            number: of the target in the session, if it is also sent as datagram; otherwise 0.

        Raises:
            LocalProtocolError: the message is illegal in this state; nothing has changed.
        """
        pack = self._packers.get(kind)
        if pack is None:
            raise self._illegal(kind)
        data = pack(self.counts[SENT], number, time, *numbers)
        self._count_sent()
        return data

    def datagrams(self, session: int, token: bytes) -> Datagrams:
        """This side's end of the datagrams beside the session.

        Args:
            session: number of the session, of Welcome.
            token: of DatagramToken.
        """
        secret = None
        if self._exchange is not None:
            nonces = self._nonce, self._other_nonce
            secret = self._exchange.secret(*(nonces if self._side is Side.CLIENT else nonces[::-1]))
        tags = datagram_tags(secret, token)
        return Datagrams(session, self._source, *(tags if self._side is Side.CLIENT else tags[::-1]))

    def hello(self, *, name: str, version: str = "") -> Hello:
        """Make the client's first message; cut its name at 64 bytes."""
        short = name.encode()[:64].decode(errors="ignore")
        return Hello(major=MAJOR, minor=MINOR, name=short, version=version[:32], nonce=self._nonce)

    def challenge(self) -> Challenge:
        """Make the cabinet's request for a proof of the key."""
        return Challenge(nonce=self._nonce)

    def proof(self) -> Proof:
        """Make the client's answer to a Challenge.

        Raises:
            LocalProtocolError: this side has no key.
        """
        if self._exchange is None:
            raise LocalProtocolError("a proof needs a key, but this side has none")
        return Proof(mac=self._exchange.client_mac())

    def _with_mac(self, message: Message) -> Welcome:
        """The Welcome with the proof of this cabinet."""
        assert isinstance(message, Welcome) and self._exchange is not None
        if not self.is_proven:
            raise LocalProtocolError("no Welcome before the client has proved that it knows the key")
        bare = replace(message, mac=b"")
        return replace(bare, mac=self._exchange.cabinet_mac(Welcome.TYPE, bare.encode()))

    def _count_sent(self) -> None:
        self.counts[SENT] = (self.counts[SENT] + 1) & _WRAP
        if self.counts[SENT] == 0 and self._tag is not None:
            self._tag.begin_round()

    # ----------------------------------------------------------------------------------- receiving

    def receive_data(self, data: bytes | bytearray | memoryview) -> None:
        """Add bytes from the other side; `events` decodes them."""
        if self._state is not SessionState.CLOSED:
            self._reader.feed(data)

    def events(self) -> Iterator[Received | StateReceived]:
        """Decode the received bytes into events, each once.

        Raises:
            RemoteProtocolError: the other side violated the protocol; the session is closed.
        """
        return iter(self._next_event, None)

    def answer(self, type: int, body: bytes) -> Message:
        """Decode the answer to one of `simple_requests`, which `heptarm.io.exchange` has received.

        Raises:
            RemoteProtocolError: the other side violated the protocol; the session is closed.
        """
        try:
            kind = self._answers.get(type)
            if kind is None:
                raise _broken(Code.UNEXPECTED_MESSAGE, f"message {type} came as the answer to a request")
            return _decoded(kind, body)
        except RemoteProtocolError as error:
            self._fail(error)
            raise

    def _next_event(self) -> Received | StateReceived | None:
        """The next event; None until more bytes arrive, and when the session is closed."""
        if self._failed is not None:
            raise self._failed
        if self._state is SessionState.CLOSED:
            return None
        try:
            frame = self._reader.read()
            if frame is None:
                self.counts[UNREAD] = len(self._reader)
                return None
            return self._accept(frame)
        except RemoteProtocolError as error:
            self._fail(error)
            raise

    def _fail(self, error: RemoteProtocolError) -> None:
        self._failed = error
        self._enter(SessionState.CLOSED)

    def _accept(self, frame: Frame) -> Received | StateReceived:
        version, type_, seq, request, time, body = frame
        if version != MAJOR and type_ not in _FROZEN:
            raise _broken(
                Code.WRONG_VERSION, f"a frame has protocol version {version}, this side has {MAJOR}"
            )
        if seq != self.counts[RECEIVED]:
            raise forged(f"expected frame {self.counts[RECEIVED]}, got frame {seq}")
        self._count_received()
        # states and answers are by far the most frequent
        if type_ == State.TYPE and request == 0 and self.takes_states:
            return StateReceived(body, time)
        return Received(self._interpret(type_, request, body), request, time)

    def _interpret(self, type_: int, request: int, body: bytes) -> Message:
        """Decode a message, which must be legal now, and do what it does to the session."""
        kind = self._answers.get(type_)
        if kind is not None and request in self.waiting:
            message = _decoded(kind, body)
            del self.waiting[request]
            return message
        kind = MESSAGES.get(type_)
        if kind is None:
            raise _broken(Code.UNKNOWN_MESSAGE, f"message id {type_} is not known")
        after = self._check_legal(kind, request)
        message = _decoded(kind, body)
        if kind.KIND == "handshake":
            self._check_handshake(message, body)
        self._after(kind, after, request, body)
        return message

    def _check_legal(self, kind: type[Message], request: int) -> SessionState:
        """Check that a message may come now, with this request id; returns the state after it."""
        after = self._legal.get(_SYMBOLS[kind])
        if after is None or self._source == kind.SOURCE:
            raise _broken(Code.UNEXPECTED_MESSAGE, f"a {kind.__name__} came in state {self._state.value!r}")
        # a Rejected for a message that is no request has no id
        is_numbered = kind.KIND in ("request", "answer") and (kind is not Rejected or request != 0)
        if is_numbered != (request != 0) and kind.KIND != "oneway":  # a target may have a number
            raise _broken(Code.UNEXPECTED_MESSAGE, f"a {kind.__name__} with request id {request}")
        if kind.KIND == "answer" and is_numbered and request not in self.waiting:
            raise _broken(Code.UNEXPECTED_MESSAGE, f"an answer to request {request}, which was not made")
        if kind.KIND == "request" and request in self.waiting:
            raise _broken(Code.UNEXPECTED_MESSAGE, f"request id {request} is in use")
        return after

    def _count_received(self) -> None:
        self.counts[RECEIVED] = (self.counts[RECEIVED] + 1) & _WRAP
        if self.counts[RECEIVED] == 0 and self._reader.tag is not None:
            self._reader.tag.begin_round()

    def _check_handshake(self, message: Message, body: bytes) -> None:
        """Check the part of a handshake message that concerns the key."""
        exchange = self._exchange
        if isinstance(message, Hello | Challenge):
            if len(message.nonce) != NONCE:
                raise _broken(Code.BAD_LENGTH, f"a nonce must have {NONCE} bytes, got {len(message.nonce)}")
            if message.nonce == self._nonce:
                raise _broken(Code.WRONG_KEY, "the other side sent the nonce of this side back")
            self._other_nonce = message.nonce
        elif exchange is None:
            return
        elif isinstance(message, Proof):
            self.is_proven = hmac.compare_digest(message.mac, exchange.client_mac())
        elif isinstance(message, Welcome):
            mac = exchange.cabinet_mac(Welcome.TYPE, without_mac(body))
            self.is_proven = self._state is SessionState.PROVED and hmac.compare_digest(message.mac, mac)
            if not self.is_proven:
                raise _broken(Code.WRONG_KEY, "the cabinet failed to prove that it knows the key")

    def _enter(self, state: SessionState) -> None:
        self._state, self._legal = state, TRANSITIONS[state]
        self.simple_requests, self._answers = _plain(state, self._source)
        self.takes_states = _SYMBOLS[State] in self._legal and self._source != State.SOURCE
        self._packers = {
            kind: pack
            for kind, pack in self._one_way.items()
            if kind.SOURCE in (self._source, "both") and _SYMBOLS[kind] in self._legal
        }

    def _after(self, kind: type[Message], after: SessionState, request: int, body: bytes) -> None:
        if kind.KIND == "handshake" and self._exchange is not None:
            self._exchange.add(kind.TYPE, body)
            if kind is Welcome:
                self._begin_tags(self._exchange)
        if after is not self._state:
            self._enter(after)
        if kind.KIND == "request":
            self.waiting[request] = kind
        elif kind.KIND == "answer":
            self.waiting.pop(request, None)

    def _begin_tags(self, exchange: KeyExchange) -> None:
        """Tag every frame from here on, in both directions."""
        if self._side is Side.CLIENT:
            ours, theirs = exchange.tags(self._nonce, self._other_nonce)
        else:
            theirs, ours = exchange.tags(self._other_nonce, self._nonce)
        self._tag, self._reader.tag = ours, theirs
        self.tags += ours, theirs
        self._one_way = {kind: packer(kind, self._tag) for kind in ONE_WAY}

    def _illegal(self, kind: type[Message]) -> LocalProtocolError:
        if kind.SOURCE not in (self._source, "both"):
            return LocalProtocolError(f"the {self._source} may not send a {kind.__name__}")
        return LocalProtocolError(f"a {kind.__name__} may not be sent in state {self._state.value!r}")


@functools.cache
def _plain(state: SessionState, source: str) -> tuple[frozenset[type[Message]], dict[int, type[Message]]]:
    """Requests that a side may send, and answers that it may get, by their ids: those that keep the state as it is."""
    legal = TRANSITIONS[state]
    kept = [kind for kind in MESSAGES.values() if legal.get(_SYMBOLS[kind]) is state]
    requests = (kind for kind in kept if kind.KIND == "request" and kind.SOURCE in (source, "both"))
    answers = (kind for kind in kept if kind.KIND == "answer" and source != kind.SOURCE)
    return frozenset(requests), {kind.TYPE: kind for kind in answers}


def _decoded(kind: type[Message], body: bytes) -> Message:
    try:
        return kind.decode(body)
    except DecodeError as error:
        raise _broken(Code.BAD_BODY, f"{kind.__name__}: {error}") from error


def _broken(code: Code, text: str) -> RemoteProtocolError:
    return RemoteProtocolError(text, code=int(code), hint="check that both sides have the same version")
