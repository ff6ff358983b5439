"""The program at the other end of a bridge: what it has sent so far, and whether it is still there."""

from __future__ import annotations

from heptarm.errors import ConnectionLost
from heptarm.io.tcp import TcpTransport

#: Bytes read at once, and the most that a program may send without being answered.
_CHUNK, _MOST = 4096, 65536


class Peer:
    """Messages of a program over a transport, cut out of its stream of bytes however they arrive.

    Args:
        transport: connected; the peer closes it.
    """

    def __init__(self, transport: TcpTransport) -> None:
        self._transport = transport
        self._chunk = memoryview(bytearray(_CHUNK))
        self._received = bytearray()

    @property
    def name(self) -> str:
        """Its address and port."""
        return self._transport.peer

    @property
    def waiting(self) -> bytes:
        """What has been received and not taken."""
        return bytes(self._received)

    def receive(self, *, wait: bool = True) -> bool:
        """Receive bytes; with `wait`, wait for them for up to 0.1 s.

        Returns:
            Whether any came.

        Raises:
            ConnectionLost: the program has gone, or sends without reading.
        """
        size = self._transport.receive_into(self._chunk, wait=wait)
        self._received += self._chunk[:size]
        if len(self._received) > _MOST:
            raise ConnectionLost(
                f"{self.name} has sent more than {_MOST} bytes without waiting for an answer"
            )
        return size > 0

    def take(self, size: int) -> bytes | None:
        """Take so many bytes; None: they are not there yet."""
        if len(self._received) < size:
            return None
        taken = bytes(self._received[:size])
        del self._received[:size]
        return taken

    def next_line(self) -> str | None:
        """The next line of ASCII, without its end; None: it is not there yet."""
        line, end, _ = self._received.partition(b"\n")
        return line.decode("ascii", errors="replace").strip() if end else None

    def take_line(self) -> str | None:
        """Take the next line."""
        line = self.next_line()
        if line is not None:
            del self._received[: self._received.index(b"\n") + 1]
        return line

    def send(self, data: bytes) -> None:
        """Send an answer in one piece.

        Raises:
            ConnectionLost: the program has gone, or does not read.
        """
        self._transport.send(data)

    def close(self) -> None:
        """Close the connection."""
        self._transport.close()
