"""Interface of a transport, and a connected pair in memory.

`heptarm.io.tcp` has the TCP transport; tests/transports/conformance.py tests both.
"""

from __future__ import annotations

import threading
from typing import Protocol

from heptarm.errors import ConnectionLost


class Transport(Protocol):
    """Reliable, ordered stream of bytes in both directions.

    One thread may send while another one receives; two threads must not send, or receive, at the same time.
    """

    @property
    def peer(self) -> str:
        """Name of the other end, for messages."""
        ...

    def send(self, data: bytes) -> None:
        """Send all the data.

        Raises:
            ConnectionLost: the other side has closed, or does not read within the time-out.
        """
        ...

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Receive bytes into a buffer; an interrupted wait loses nothing.

        Args:
            buffer: where to write them.
            wait: wait for up to the patience if there are none.

        Returns:
            Number of bytes received; 0 if none.

        Raises:
            ConnectionLost: the connection is lost, or either side has closed it.
        """
        ...

    def wait_readable(self, seconds: float) -> bool:
        """Wait until bytes (or the end) can be received, without receiving them; for one thread at a time."""
        ...

    def set_patience(self, seconds: float) -> None:
        """Set how long `receive_into` waits for bytes [s]."""
        ...

    def fileno(self) -> int:
        """Descriptor of the connected stream socket; -1: there is none, or it is closed."""
        ...

    def lost(self, error: OSError) -> ConnectionLost:
        """The error of a connection whose socket has this error."""
        ...

    def close(self) -> None:
        """Close the connection; a waiting `receive_into` raises ConnectionLost. Closing twice is allowed."""
        ...

    def abandon(self) -> None:
        """Give up the copy that a fork of the process has; the connection of the original process stays."""
        ...

    def datagrams(self) -> DatagramSocket | None:
        """Open a socket for datagrams to the other end; None: this transport has none."""
        ...


class DatagramSocket(Protocol):
    """Unreliable, unordered datagrams in both directions; `heptarm.io.udp.ConnectedUdp` is one."""

    def send(self, data: bytes) -> bool:
        """Send a datagram without waiting; False if the system does not take it."""
        ...

    def receive(self, seconds: float) -> bytes | None:
        """Wait for a datagram [s]; None: none came.

        Raises:
            ConnectionLost: the socket is closed.
        """
        ...

    def close(self) -> None:
        """Close the socket. Closing twice is allowed."""
        ...


class _Pipe:
    """One direction of a pair."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.changed = threading.Condition()
        self.is_closed = False


class MemoryTransport:
    """One end of a connected pair; see `memory_pair`."""

    def __init__(self, incoming: _Pipe, outgoing: _Pipe, *, peer: str, chunk: int | None) -> None:
        self._in = incoming
        self._out = outgoing
        self._chunk = chunk
        self._patience = 0.1
        self._closed = False
        self.peer = peer

    def send(self, data: bytes) -> None:
        """Send all the data."""
        with self._out.changed:
            if self._out.is_closed:
                raise self.lost()
            self._out.data += data
            self._out.changed.notify_all()

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Receive bytes; with `wait`, wait for up to the patience."""
        pipe = self._in
        with pipe.changed:
            if wait and not pipe.data and not pipe.is_closed:
                pipe.changed.wait(self._patience)
            if self._closed or (pipe.is_closed and not pipe.data):
                raise self.lost()
            size = min(len(buffer), len(pipe.data), self._chunk or len(buffer))
            buffer[:size] = pipe.data[:size]
            del pipe.data[:size]
            return size

    def wait_readable(self, seconds: float) -> bool:
        """Wait until bytes (or the end) can be received."""
        pipe = self._in
        with pipe.changed:
            if not pipe.data and not pipe.is_closed:
                pipe.changed.wait(max(seconds, 0.0))
            return bool(pipe.data) or pipe.is_closed

    def set_patience(self, seconds: float) -> None:
        """Set how long `receive_into` waits for bytes [s]."""
        self._patience = seconds

    def fileno(self) -> int:
        """-1: there is no socket."""
        return -1

    def lost(self, error: OSError | None = None) -> ConnectionLost:
        """The error of a connection that has ended."""
        if self._closed:
            return ConnectionLost(f"the connection to {self.peer} is closed")
        return ConnectionLost(f"the connection to {self.peer} is lost: the other side closed it")

    def close(self) -> None:
        """Close both directions."""
        self._closed = True
        for pipe in (self._in, self._out):
            with pipe.changed:
                pipe.is_closed = True
                pipe.changed.notify_all()

    def abandon(self) -> None:
        """Give up the copy that a fork of the process has; its memory is a copy, too."""
        self._closed = True

    def datagrams(self) -> DatagramSocket | None:
        """None: there are no datagrams in memory."""
        return None


def memory_pair(*, chunk: int | None = None) -> tuple[MemoryTransport, MemoryTransport]:
    """Create two connected ends: (client, cabinet).

    Args:
        chunk: largest number of bytes delivered at once; None: no limit.
    """
    up, down = _Pipe(), _Pipe()
    return (
        MemoryTransport(down, up, peer="memory cabinet", chunk=chunk),
        MemoryTransport(up, down, peer="memory client", chunk=chunk),
    )
