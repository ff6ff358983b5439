"""A client made of a socket and frames: it can send what a real client never would."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, TypeVar

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.datagrams import Datagrams
from heptarm.wire.frames import Frame, FrameReader, pack
from heptarm.wire.key import FrameTag, KeyExchange, datagram_tags

M = TypeVar("M")
NONCE = bytes(range(32))


class Closed(Exception):
    """The cabinet has closed the connection."""


class Busy(Exception):
    """The cabinet has waited too long for the handshake."""


def is_of(number: int) -> Callable[[Any], bool]:
    """Whether a message is about this motion."""
    return lambda message: number == (message.servo if isinstance(message, wire.ServoStatus) else message.id)


class Peer:
    """One connection. `seen` keeps every message with its frame."""

    def __init__(self, port: int, *, hello: bool = True, name: str = "peer", key: str = "") -> None:
        self._port = port
        self._connect()
        while hello:
            try:
                self.welcome = self.greet(name=name, key=key)
                break
            except Busy:  # this machine held up the client for longer than the cabinet waits
                self.socket.close()
                self._connect()

    def _connect(self) -> None:
        self.socket = socket.create_connection(("127.0.0.1", self._port), timeout=30)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.reader = FrameReader()
        self.seen: list[tuple[Frame, Any]] = []
        self._next = 0
        self._request = 0
        self._seq = 0
        self._tag: FrameTag | None = None
        self._secret: bytes | None = None

    def greet(self, *, name: str = "peer", key: str = "", major: int = wire.MAJOR) -> wire.Welcome:
        hello = self.hello = wire.Hello(major=major, minor=0, name=name, version="0", nonce=NONCE)
        self.send(hello)
        message = self.next()
        if isinstance(message, wire.Challenge):
            exchange = KeyExchange(key.encode())
            for one in (hello, message):
                exchange.add(one.TYPE, one.encode())
            tags = exchange.tags(NONCE, message.nonce)
            self._secret = exchange.secret(NONCE, message.nonce)
            self.send(wire.Proof(mac=exchange.client_mac()))
            message = self.next()
            self._tag, self.reader.tag = tags
        if isinstance(message, wire.Refusal) and message.code == Code.SILENT:
            raise Busy
        assert isinstance(message, wire.Welcome), message
        return message

    def pack(self, message: Any, request: int = 0) -> bytes:
        self._seq += 1
        return pack(message.TYPE, message.encode(), seq=self._seq - 1, request=request, tag=self._tag)

    def send(self, message: Any, request: int = 0) -> None:
        self.socket.sendall(self.pack(message, request))

    def ask(self, message: Any) -> Any:
        """Sends a request; returns its answer."""
        self._request += 1
        self.send(message, self._request)
        return self.answer(self._request)

    def take_control(self, *, watchdog: float = 10.0) -> None:
        """Takes control; waits if the cabinet has not yet noticed that the previous controller is gone."""
        deadline = time.monotonic() + 30.0
        while not isinstance(answer := self.ask(wire.TakeControl(watchdog=watchdog)), wire.Accepted):
            assert answer.code == Code.CONTROL_TAKEN and time.monotonic() < deadline, answer
            time.sleep(0.01)

    def open_datagrams(self) -> Datagrams:
        """The client's end of datagrams of this session."""
        token = self.ask(wire.OpenDatagrams()).token
        return Datagrams(self.welcome.session, "client", *datagram_tags(self._secret, token))

    def answer(self, request: int) -> Any:
        wanted = request
        return self.wait(lambda frame, _: frame.request == wanted, since=0)

    def next(self, timeout: float = 30.0) -> Any:
        """The next message that was not returned by `next` before."""
        self._fill(self._next + 1, timeout)
        self._next += 1
        return self.seen[self._next - 1][1]

    def wait_for(
        self, kind: type[M], where: Callable[[M], bool] = lambda _: True, timeout: float = 30.0
    ) -> M:
        """The first message of a kind, also one received earlier."""
        found: M = self.wait(lambda _, message: isinstance(message, kind) and where(message), timeout=timeout)
        return found

    def wait(self, where: Callable[[Frame, Any], bool], *, since: int = 0, timeout: float = 30.0) -> Any:
        deadline = time.monotonic() + timeout
        index = since
        while True:
            self._fill(index + 1, deadline - time.monotonic())
            if where(*self.seen[index]):
                return self.seen[index][1]
            index += 1

    def signals(self) -> dict[str, float]:
        """The signals by name, all of them read after the last frame that was received; they are subscribed."""
        now = self.seen[-1][0].time
        state = self.wait(
            lambda _, one: isinstance(one, wire.State) and one.io is not None and one.io.stamp > now
        )
        return {self.welcome.signals[one.index].name: one.value for one in state.io.values}

    def all(self, kind: type[M]) -> list[M]:
        return [message for _, message in self.seen if isinstance(message, kind)]

    def read_for(self, seconds: float, *, silent: bool = False) -> None:
        """Reads all messages for a while; sends something now and then unless it is to be silent."""
        deadline = time.monotonic() + seconds
        spoke = 0.0
        while (left := deadline - time.monotonic()) > 0:
            if not silent and time.monotonic() > spoke + 0.3:
                self.send(wire.Pong(sent=0, received=0))
                spoke = time.monotonic()
            try:
                self._fill(len(self.seen) + 1, min(left, 0.3))
            except TimeoutError:
                continue

    def is_closed(self, timeout: float = 30.0) -> bool:
        """Whether the cabinet closes the connection in time."""
        try:
            while True:
                self._fill(len(self.seen) + 1, timeout)
        except Closed:
            return True
        except TimeoutError:
            return False

    def _fill(self, count: int, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while len(self.seen) < count:
            frame = self.reader.read()
            if frame is not None:
                self.seen.append((frame, wire.MESSAGES[frame.type].decode(frame.body)))
                continue
            left = deadline - time.monotonic()
            if left <= 0:
                raise TimeoutError(f"nothing came; so far {[type(m).__name__ for _, m in self.seen[-10:]]}")
            self.socket.settimeout(left)
            try:
                data = self.socket.recv(65536)
            except ConnectionError:
                data = b""
            if not data:
                raise Closed
            self.reader.feed(data)

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> Peer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def ptp(*q: float) -> wire.Item:
    """A PTP to seven joint positions; the last ones may be left out."""
    return wire.Item(motion=wire.Ptp(q=(*q, *(0.0,) * (7 - len(q)))))


def run(*items: wire.Item, when: wire.When = wire.When.QUEUE) -> wire.Run:
    return wire.Run(items=items, when=when)
