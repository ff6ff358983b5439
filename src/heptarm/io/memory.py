"""A pair of transports joined in memory, for tests: no socket, no port, every split under control."""

from __future__ import annotations

import threading

from heptarm.errors import ConnectionLost


class _Pipe:
    """One direction."""

    def __init__(self) -> None:
        self.octets = bytearray()
        self.changed = threading.Condition()
        self.is_closed = False


class MemoryTransport:
    """One end of a pair; see `memory_pair`."""

    def __init__(self, incoming: _Pipe, outgoing: _Pipe, *, peer: str, chunk: int | None) -> None:
        self._in = incoming
        self._out = outgoing
        self._chunk = chunk
        self._patience = 0.1
        self._closed = False
        self.peer = peer

    def send(self, data: bytes) -> None:
        """Send all of it."""
        with self._out.changed:
            if self._out.is_closed:
                raise self._lost()
            self._out.octets += data
            self._out.changed.notify_all()

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Octets that came; with `wait`, for up to the patience."""
        pipe = self._in
        with pipe.changed:
            if wait and not pipe.octets and not pipe.is_closed:
                pipe.changed.wait(self._patience)
            if self._closed or (pipe.is_closed and not pipe.octets):
                raise self._lost()
            size = min(len(buffer), len(pipe.octets), self._chunk or len(buffer))
            buffer[:size] = pipe.octets[:size]
            del pipe.octets[:size]
            return size

    def wait_readable(self, seconds: float) -> bool:
        """Wait until there is something to receive."""
        pipe = self._in
        with pipe.changed:
            if not pipe.octets and not pipe.is_closed:
                pipe.changed.wait(max(seconds, 0.0))
            return bool(pipe.octets) or pipe.is_closed

    def set_patience(self, seconds: float) -> None:
        """How long `receive_into` waits for octets."""
        self._patience = seconds

    def close(self) -> None:
        """End it, both directions."""
        self._closed = True
        for pipe in (self._in, self._out):
            with pipe.changed:
                pipe.is_closed = True
                pipe.changed.notify_all()

    def _lost(self) -> ConnectionLost:
        if self._closed:
            return ConnectionLost(f"the connection to {self.peer} is closed")
        return ConnectionLost(f"the connection to {self.peer} is lost: it closed the connection")


def memory_pair(*, chunk: int | None = None) -> tuple[MemoryTransport, MemoryTransport]:
    """Two joined ends: (client, cabinet).

    Args:
        chunk: deliver at most this many octets at once; None for all there are.
    """
    up, down = _Pipe(), _Pipe()
    return (
        MemoryTransport(down, up, peer="memory cabinet", chunk=chunk),
        MemoryTransport(up, down, peer="memory client", chunk=chunk),
    )
