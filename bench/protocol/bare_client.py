"""The least Python that makes a request: what heptarm's client can never be faster than.

It speaks the protocol with the cabinet's application, and does nothing else: no check of the value, no second thread,
no Ctrl-C that waits for the end of a frame, no journal, no states.
"""

from __future__ import annotations

import socket
import time
from struct import Struct

from heptarm.wire import messages as wire
from heptarm.wire.frames import FrameReader, pack
from heptarm.wire.messages import HEADER, MAGIC, MAJOR, Message

_REQUEST = Struct(HEADER.format + "d")
_ANSWER = Struct(HEADER.format + "I")


class BareClient:
    """A client in control of a cabinet without a key.

    Args:
        port: of the cabinet on this machine.
    """

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=10.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader, self._sent = FrameReader(), 0
        self._send(wire.Hello(major=MAJOR, minor=wire.MINOR, name="bare", version="", nonce=bytes(32)))
        self._await(wire.Welcome)
        self._send(wire.TakeControl(watchdog=10.0), request=1)
        self._await(wire.Accepted)
        self._socket.settimeout(None)

    def set_override(self, value: float) -> None:
        """A request and its answer."""
        number = self._sent
        self._sent = number + 1
        now = time.monotonic_ns()
        self._socket.send(
            _REQUEST.pack(MAGIC, MAJOR, 0, wire.SetOverride.TYPE, 8, number, number, now, value)
        )
        data = self._socket.recv(4096)
        if len(data) != _ANSWER.size or _ANSWER.unpack(data)[6] != number:
            self._reader.feed(data)
            self._await(wire.Accepted)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _send(self, message: Message, request: int = 0) -> None:
        data = pack(message.TYPE, message.encode(), seq=self._sent, request=request, time=time.monotonic_ns())
        self._sent += 1
        self._socket.sendall(data)

    def _await(self, kind: type[Message]) -> None:
        """Read until a message of a kind comes, and answer pings; a request that was refused ends that by an error."""
        while True:
            frame = self._reader.read()
            if frame is None:
                self._reader.feed(self._socket.recv(4096))
                continue
            _, type_, _, _, _, body = frame
            if type_ == kind.TYPE:
                return
            if type_ == wire.Ping.TYPE:
                self._send(wire.Pong(sent=wire.Ping.decode(body).sent, received=time.monotonic_ns()))
            elif type_ == wire.Rejected.TYPE:
                raise RuntimeError(f"refused: {wire.Rejected.decode(body).text}")
