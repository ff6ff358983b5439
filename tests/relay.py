"""Somebody in the middle who has no key: passes frames and datagrams on, and tampers with those of one direction."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Literal

from heptarm.wire.messages import HEADER, TAG

Direction = Literal["up", "down"]
#: From the frames so far, the last one just received, what is passed on instead of the last one.
Attack = Callable[[list[bytes]], bytes]


class Relay:
    """Listens on a port and connects every client with the cabinet.

    Args:
        port: of the cabinet.

    Attributes:
        cabinet: that port.
        port: its own.
    """

    def __init__(self, port: int) -> None:
        self.cabinet = port
        self._attacks: dict[Direction, Attack] = {}
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self._sockets: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._accept, name="relay")]
        self._threads[0].start()

    def attack(self, direction: Direction, attack: Attack) -> None:
        """Tamper with every frame of one direction from now on."""
        self._attacks[direction] = attack

    def _accept(self) -> None:
        while True:
            try:
                client = self._server.accept()[0]
            except OSError:
                return
            cabinet = socket.create_connection(("127.0.0.1", self.cabinet))
            self._sockets += [client, cabinet]
            paths: list[tuple[Direction, socket.socket, socket.socket]] = [
                ("up", client, cabinet),
                ("down", cabinet, client),
            ]
            for direction, source, sink in paths:
                thread = threading.Thread(target=self._pass, args=(direction, source, sink), name="relay")
                self._threads.append(thread)
                thread.start()

    def _pass(self, direction: Direction, source: socket.socket, sink: socket.socket) -> None:
        data, seen = bytearray(), []
        try:
            sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while received := source.recv(65536):
                data += received
                while (size := _size(data)) and len(data) >= size:
                    seen.append(bytes(data[:size]))
                    del data[:size]
                    attack = self._attacks.get(direction)
                    sink.sendall(seen[-1] if attack is None else attack(seen))
        except OSError:
            pass
        for one in (source, sink):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue  # it was closed already

    def __enter__(self) -> Relay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for one in (self._server, *self._sockets):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue
        for thread in self._threads:
            thread.join(10.0)
        for one in (self._server, *self._sockets):
            one.close()


#: From the datagrams so far, the last one just received, what is passed on instead of the last one.
DatagramAttack = Callable[[list[bytes]], list[bytes]]


class DatagramRelay:
    """Beside a `Relay`, on the UDP port of the same number; for one client.

    Args:
        relay: that of the TCP connection.

    Attributes:
        seen: all datagrams received so far, by direction.
    """

    def __init__(self, relay: Relay) -> None:
        self.seen: dict[Direction, list[bytes]] = {"up": [], "down": []}
        self._attacks: dict[Direction, DatagramAttack] = {}
        self._client: tuple[str, int] | None = None
        self._down = _bound(relay.port)
        self._up = _bound(0)
        self._up.connect(("127.0.0.1", relay.cabinet))
        self._closed = False
        ends: list[tuple[Direction, socket.socket]] = [("up", self._down), ("down", self._up)]
        self._threads = [
            threading.Thread(target=self._pass, args=(direction, source), name="datagram relay")
            for direction, source in ends
        ]
        for thread in self._threads:
            thread.start()

    def attack(self, direction: Direction, attack: DatagramAttack | None) -> None:
        """Tamper with every datagram of one direction from now on; None: no longer."""
        if attack is None:
            self._attacks.pop(direction, None)
        else:
            self._attacks[direction] = attack

    def inject(self, direction: Direction, data: bytes) -> None:
        """Send a datagram that nobody sent."""
        with contextlib.suppress(OSError):  # nobody listens
            if direction == "up":
                self._up.send(data)
            elif self._client is not None:
                self._down.sendto(data, self._client)

    def _pass(self, direction: Direction, source: socket.socket) -> None:
        seen = self.seen[direction]
        while not self._closed:
            try:
                data, sender = source.recvfrom(65536)
            except OSError:
                continue  # nothing came, or nobody listens
            if direction == "up":
                self._client = sender
            seen.append(data)
            attack = self._attacks.get(direction)
            for one in [data] if attack is None else attack(seen):
                self.inject(direction, one)

    def __enter__(self) -> DatagramRelay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closed = True
        for thread in self._threads:
            thread.join(10.0)
        for one in (self._up, self._down):
            one.close()


def _bound(port: int) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", port))
    sock.settimeout(0.1)
    return sock


def _size(data: bytearray) -> int:
    """Size of the first frame; 0 before its header is complete."""
    if len(data) < HEADER.size:
        return 0
    flags, length = data[3], int.from_bytes(data[6:10], "big")
    return HEADER.size + length + (TAG if flags else 0)
