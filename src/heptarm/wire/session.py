"""The session machine of the wire protocol, for both sides: octets in, events out, messages to octets.

It holds no socket, no clock and no thread::

    session = Session(Side.CLIENT)
    data = session.send(session.hello(name="me"))
    session.receive_data(octets)
    for event in session.events():
        ...
"""

from __future__ import annotations

import enum
import hmac
import secrets
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codec import DecodeError
from heptarm.wire.codes import Code
from heptarm.wire.frames import Frame, FrameReader, pack, packer
from heptarm.wire.messages import (
    MAJOR,
    MESSAGES,
    MINOR,
    ONE_WAY,
    Challenge,
    Hello,
    Message,
    OneWay,
    Proof,
    Refusal,
    Rejected,
    State,
    Welcome,
)
from heptarm.wire.transitions import TRANSITIONS, SessionState, symbol

_WRAP = 0xFFFFFFFF
_SYMBOLS = {kind: symbol(kind) for kind in MESSAGES.values()}
_PACKERS = {kind: packer(kind) for kind in ONE_WAY}
#: Messages that a peer of another major version may send, so that both versions can be named.
_FROZEN = (Hello.TYPE, Refusal.TYPE)


class Side(enum.Enum):
    """Which end of the connection this is."""

    CLIENT = "client"
    CABINET = "cabinet"


class Received(NamedTuple):
    """A message came.

    Attributes:
        message: what it says.
        request: id of the request that it is or answers; 0 elsewhere.
        time: sender's clock [ns].
    """

    message: Message
    request: int
    time: int


class StateReceived(NamedTuple):
    """A pushed state came; it is decoded when somebody wants it.

    Attributes:
        body: octets of the State message.
        time: sender's clock [ns].
    """

    body: bytes
    time: int

    def decode(self) -> State:
        """The state.

        Raises:
            RemoteProtocolError: the octets are no state.
        """
        try:
            return State.decode(self.body)
        except DecodeError as error:
            raise _broken(Code.BAD_BODY, f"State: {error}") from error


class Session:
    """One session, seen from one side.

    Args:
        side: which end this is.
        key: pre-shared key; None for none.
        nonce: random octets for the proof of the key; made here unless given.
    """

    def __init__(self, side: Side, *, key: bytes | None = None, nonce: bytes | None = None) -> None:
        self._side = side
        self._source = side.value
        self._key = key
        self._nonce = secrets.token_bytes(32) if nonce is None else nonce
        self._other_nonce = b""
        self._enter(SessionState.START)
        self._reader = FrameReader()
        self._sent = 0
        self._received = 0
        self._last_request = 0
        self._waiting: dict[int, type[Message]] = {}
        self._failed: RemoteProtocolError | None = None

    @property
    def side(self) -> Side:
        """Which end this is."""
        return self._side

    @property
    def state(self) -> SessionState:
        """Where the session is."""
        return self._state

    # ------------------------------------------------------------------------------------- sending

    def next_request(self) -> int:
        """A fresh request id."""
        self._last_request = self._last_request % _WRAP + 1
        return self._last_request

    def send(self, message: Message, *, request: int = 0, time: int = 0) -> bytes:
        """The octets that say a message.

        Args:
            message: what to say.
            request: for a request its id (`next_request`), for an answer the id of its request.
            time: this side's clock [ns].

        Raises:
            LocalProtocolError: it is illegal here; nothing has changed.
        """
        kind = type(message)
        after = self._legal.get(_SYMBOLS[kind])
        if after is None or (self._source != kind.SOURCE and kind.SOURCE != "both"):
            raise self._illegal(kind)
        is_numbered = kind.KIND in ("request", "answer") and (kind is not Rejected or request != 0)
        if is_numbered != (request != 0):
            raise LocalProtocolError(f"a {kind.__name__} with request id {request}")
        if kind.KIND == "request" and request in self._waiting:
            raise LocalProtocolError(f"request id {request} is in use")
        if kind.KIND == "answer" and is_numbered and request not in self._waiting:
            raise LocalProtocolError(f"no request {request} waits for an answer")
        data = pack(kind.TYPE, message.encode(), seq=self._sent, request=request, time=time)
        self._sent = (self._sent + 1) & _WRAP
        self._after(kind, after, request)
        return data

    def send_numbers(self, kind: type[OneWay], numbers: Iterable[float], *, time: int) -> bytes:
        """The octets that `send` makes of a one-way message, packed at once from the numbers of its fields.

        It is for streams: a message that is sent once in some milliseconds finds cold caches, so that each step counts.

        Args:
            kind: what to say.
            numbers: its fields, one after the other.
            time: this side's clock [ns].

        Raises:
            LocalProtocolError: it is illegal here; nothing has changed.
        """
        data = self.pack_numbers(kind, numbers, time=time)
        self._sent = (self._sent + 1) & _WRAP
        return data

    def pack_numbers(self, kind: type[OneWay], numbers: Iterable[float], *, time: int) -> bytes:
        """What `send_numbers` would return now; nothing is taken for sent. Raises what it raises."""
        pack = self._packers.get(kind)
        if pack is None:
            raise self._illegal(kind)
        return pack(self._sent, 0, time, *numbers)

    def hello(self, *, name: str, version: str = "") -> Hello:
        """The client's first message; of a longer name its first 64 octets."""
        short = name.encode()[:64].decode(errors="ignore")
        return Hello(major=MAJOR, minor=MINOR, name=short, version=version[:32], nonce=self._nonce)

    def challenge(self) -> Challenge:
        """The cabinet's demand for a proof of the key."""
        return Challenge(nonce=self._nonce)

    def proof(self) -> Proof:
        """The client's answer to a Challenge.

        Raises:
            LocalProtocolError: this side has no key.
        """
        return Proof(mac=self._mac(self._other_nonce, self._nonce))

    def welcome_mac(self) -> bytes:
        """The cabinet's proof of the key, for its Welcome; empty without a key."""
        return self._mac(self._other_nonce, self._nonce) if self._key is not None else b""

    def is_proven(self, mac: bytes) -> bool:
        """Whether the other side's mac proves that it knows the key; without a key everybody is."""
        if self._key is None:
            return True
        return hmac.compare_digest(mac, self._mac(self._nonce, self._other_nonce))

    # ----------------------------------------------------------------------------------- receiving

    def receive_data(self, data: bytes | bytearray | memoryview) -> None:
        """Take octets from the other side; `events` says what they mean."""
        if self._state is not SessionState.CLOSED:
            self._reader.feed(data)

    def events(self) -> Iterator[Received | StateReceived]:
        """What the octets so far mean, each once.

        Raises:
            RemoteProtocolError: the other side broke the protocol; the session is over.
        """
        if self._failed is not None:
            raise self._failed
        while self._state is not SessionState.CLOSED:
            try:
                frame = self._reader.read()
                if frame is None:
                    return
                event = self._accept(frame)
            except RemoteProtocolError as error:
                self._failed = error
                self._enter(SessionState.CLOSED)
                raise
            yield event

    def _accept(self, frame: Frame) -> Received | StateReceived:
        if frame.version != MAJOR and frame.type not in _FROZEN:
            raise _broken(
                Code.WRONG_VERSION, f"a frame of protocol version {frame.version}; this side has {MAJOR}"
            )
        if frame.seq != self._received:
            raise _broken(Code.BAD_FRAME, f"frame {frame.seq} came where {self._received} was due")
        kind = MESSAGES.get(frame.type)
        if kind is None:
            raise _broken(Code.UNKNOWN_MESSAGE, f"message id {frame.type} is not known")
        after = self._legal.get(_SYMBOLS[kind])
        if after is None or self._source == kind.SOURCE:
            raise _broken(Code.UNEXPECTED_MESSAGE, f"a {kind.__name__} came in state {self._state.value!r}")
        # the refusal of a message that was no request carries no id
        is_numbered = kind.KIND in ("request", "answer") and (kind is not Rejected or frame.request != 0)
        if is_numbered != (frame.request != 0):
            raise _broken(Code.UNEXPECTED_MESSAGE, f"a {kind.__name__} with request id {frame.request}")
        if kind.KIND == "answer" and is_numbered and frame.request not in self._waiting:
            raise _broken(
                Code.UNEXPECTED_MESSAGE, f"an answer to request {frame.request}, which was not made"
            )
        if kind.KIND == "request" and frame.request in self._waiting:
            raise _broken(Code.UNEXPECTED_MESSAGE, f"request id {frame.request} is in use")
        self._received = (self._received + 1) & _WRAP
        if kind is State:
            return StateReceived(frame.body, frame.time)
        try:
            message = kind.decode(frame.body)
        except DecodeError as error:
            raise _broken(Code.BAD_BODY, f"{kind.__name__}: {error}") from error
        if isinstance(message, Hello | Challenge):
            self._other_nonce = message.nonce
        elif isinstance(message, Welcome) and not self.is_proven(message.mac):
            raise _broken(Code.WRONG_KEY, "the cabinet does not prove that it knows the key")
        self._after(kind, after, frame.request)
        return Received(message, frame.request, frame.time)

    def _enter(self, state: SessionState) -> None:
        self._state, self._legal = state, TRANSITIONS[state]
        self._packers = {
            kind: pack
            for kind, pack in _PACKERS.items()
            if kind.SOURCE in (self._source, "both") and _SYMBOLS[kind] in self._legal
        }

    def _after(self, kind: type[Message], after: SessionState, request: int) -> None:
        if after is not self._state:
            self._enter(after)
        if kind.KIND == "request":
            self._waiting[request] = kind
        elif kind.KIND == "answer":
            self._waiting.pop(request, None)

    def _illegal(self, kind: type[Message]) -> LocalProtocolError:
        if kind.SOURCE not in (self._source, "both"):
            return LocalProtocolError(f"the {self._source} may not send a {kind.__name__}")
        return LocalProtocolError(f"a {kind.__name__} may not be sent in state {self._state.value!r}")

    def _mac(self, first: bytes, second: bytes) -> bytes:
        if self._key is None:
            raise LocalProtocolError("there is no key to prove")
        return hmac.digest(self._key, first + second, "sha256")


def _broken(code: Code, text: str) -> RemoteProtocolError:
    return RemoteProtocolError(text, code=int(code), hint="check that both sides have the same version")
