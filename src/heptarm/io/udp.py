"""UDP with the kernel's receive times. No OSError leaves this module."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
import time

from heptarm.errors import ConnectFailed, ConnectionLost

#: Longer than any FRI datagram.
BUFFER = 2048
Address = tuple[str, int]

_NO_DATA = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ETIMEDOUT, errno.EINTR)
_STAMPNS: int = getattr(socket, "SO_TIMESTAMPNS", 35) if sys.platform == "linux" else 0
_STAMP = struct.Struct("@ll")
_ANCILLARY = socket.CMSG_SPACE(_STAMP.size) if hasattr(socket, "CMSG_SPACE") else 0
#: A stamp older than this means that the wall clock was set, not that a datagram waited [ns].
_TOO_OLD = 10_000_000_000


class UdpSocket:
    """A bound UDP socket.

    Args:
        port: UDP port; 0 for any free one.
        host: own address to bind to; "0.0.0.0" for all.
        patience: how long `receive` waits [s].

    Attributes:
        port: the port that is bound.
        stamps: the kernel tells when a datagram came.
        sock: the socket itself, for what polls it.

    Raises:
        ConnectFailed: the port cannot be had; the text says why and what to do.
    """

    def __init__(self, port: int, *, host: str = "0.0.0.0", patience: float = 0.1) -> None:
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._closed = False
        try:
            self.sock.bind((host, port))
        except OSError as error:
            self.sock.close()
            raise ConnectFailed(
                f"UDP port {port} cannot be bound on {host}: {(error.strerror or str(error)).lower()}",
                parameter="port",
                value=port,
                hint=_advice(error, port),
            ) from error
        self.port: int = self.sock.getsockname()[1]
        self.stamps = False
        if _STAMPNS and _ANCILLARY:
            with contextlib.suppress(OSError):  # then the time of the system call has to do
                self.sock.setsockopt(socket.SOL_SOCKET, _STAMPNS, 1)
                self.stamps = True
        self.set_patience(patience)
        self._buffer = bytearray(BUFFER)

    def set_patience(self, seconds: float) -> None:
        """How long `receive` waits for a datagram."""
        if sys.platform == "win32":
            self.sock.settimeout(max(seconds, 1e-3))
            return
        micros = max(1, round(seconds * 1e6))
        interval = struct.pack("@ll", micros // 1_000_000, micros % 1_000_000)
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, interval)

    def receive(self) -> tuple[bytes, int, Address] | None:
        """The next datagram, when it came [ns, monotonic clock] and who sent it; None if none came in time.

        Raises:
            ConnectionLost: the socket is closed or broken.
        """
        try:
            if not self.stamps:
                data, sender = self.sock.recvfrom(BUFFER)
                return data, time.monotonic_ns(), sender
            data, ancillary, _, sender = self.sock.recvmsg(BUFFER, _ANCILLARY)
        except OSError as error:
            if isinstance(error, TimeoutError) or (error.errno in _NO_DATA and not self._closed):
                return None
            if (
                error.errno == errno.ECONNREFUSED
            ):  # an earlier answer found nobody: the other side is not there
                return None
            raise self._lost(error) from error
        now = time.monotonic_ns()
        for level, kind, octets in ancillary:
            if level == socket.SOL_SOCKET and kind == _STAMPNS and len(octets) == _STAMP.size:
                seconds, nanos = _STAMP.unpack(octets)
                age = time.time_ns() - seconds * 1_000_000_000 - nanos
                if 0 <= age < _TOO_OLD:
                    return data, now - age, sender
        return data, now, sender

    def send(self, data: bytes, address: Address) -> bool:
        """Send a datagram; False if the network refused it, as it does where nobody listens.

        Raises:
            ConnectionLost: the socket is closed.
        """
        try:
            self.sock.sendto(data, address)
        except OSError as error:
            if self._closed:
                raise self._lost(error) from error
            return False
        return True

    def close(self) -> None:
        """End it. Closing twice is legal."""
        self._closed = True
        self.sock.close()

    def _lost(self, error: OSError) -> ConnectionLost:
        if self._closed:
            return ConnectionLost(f"UDP port {self.port} is closed")
        return ConnectionLost(f"UDP port {self.port} fails: {(error.strerror or str(error)).lower()}")


def _advice(error: OSError, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"another program on this machine uses it, perhaps another FRI client: end it (`ss -ulpn | grep {port}` "
            "names it), or choose another port here and in the cabinet's FRI configuration"
        )
    if error.errno == errno.EADDRNOTAVAIL:
        return "no network card of this machine has that address"
    if error.errno == errno.EACCES:
        return "ports below 1024 are for root; FRI uses 30200 to 30209"
    return "choose another port here and in the cabinet's FRI configuration"


def own_address(peer: str) -> str:
    """The address of this machine from which it reaches another one; nothing is sent.

    Raises:
        ConnectFailed: there is no way to that machine, or it has no IPv4 address.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((peer, 9))
        except OSError as error:
            raise ConnectFailed(
                f"this machine's address towards {peer} is not known: {(error.strerror or str(error)).lower()}",
                hint="name the address under which the cabinet reaches this machine",
            ) from error
        return str(probe.getsockname()[0])
