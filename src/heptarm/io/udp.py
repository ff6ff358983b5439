"""UDP sockets: a bound one with the receive times of the kernel, and one connected to a cabinet."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
import time
from typing import Any

from heptarm.errors import ConnectFailed, ConnectionLost, system_errors

#: Size of the receive buffer; longer than any FRI datagram.
BUFFER = 2048
Address = tuple[str, int]

_DO_NOT_WAIT: int = getattr(socket, "MSG_DONTWAIT", 0)
_NO_DATA = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ETIMEDOUT, errno.EINTR)
_STAMPNS: int = getattr(socket, "SO_TIMESTAMPNS", 35) if sys.platform == "linux" else 0
_STAMP = struct.Struct("@ll")
_ANCILLARY = socket.CMSG_SPACE(_STAMP.size) if hasattr(socket, "CMSG_SPACE") else 0
#: Largest credible age of a time stamp [ns]; an older one means that the wall clock was set.
_TOO_OLD = 10_000_000_000


class UdpSocket:
    """Bound UDP socket.

    Args:
        port: UDP port; 0 for any free one.
        host: own address to bind to; "0.0.0.0" for all.
        patience: how long `receive` waits [s].

    Attributes:
        port: bound port.
        stamps: the kernel provides receive times.
        sock: the socket, for polling.

    Raises:
        ConnectFailed: the port cannot be bound; the text names the cause and the remedy.
    """

    def __init__(self, port: int, *, host: str = "0.0.0.0", patience: float = 0.1) -> None:
        self.sock = _datagram_socket()
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
            with contextlib.suppress(OSError):  # without it, the time of the system call is used
                self.sock.setsockopt(socket.SOL_SOCKET, _STAMPNS, 1)
                self.stamps = True
        self.set_patience(patience)
        self._buffer = bytearray(BUFFER)

    def set_patience(self, seconds: float) -> None:
        """Set how long `receive` waits for a datagram [s]."""
        _limit_wait(self.sock, seconds)

    def receive(self) -> tuple[bytes, int, Address] | None:
        """Receive a datagram, its receive time [ns, monotonic clock] and its sender; None if none came in time.

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
            if error.errno == errno.ECONNREFUSED:  # nobody received an earlier answer
                return None
            raise self._lost(error) from error
        now = time.monotonic_ns()
        for level, kind, content in ancillary:
            if level == socket.SOL_SOCKET and kind == _STAMPNS and len(content) == _STAMP.size:
                seconds, nanos = _STAMP.unpack(content)
                age = time.time_ns() - seconds * 1_000_000_000 - nanos
                if 0 <= age < _TOO_OLD:
                    return data, now - age, sender
        return data, now, sender

    def send(self, data: bytes, address: Address) -> bool:
        """Send a datagram; False if the network refuses it, for example because nobody listens.

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
        """Close the socket. Closing twice is allowed."""
        self._closed = True
        self.sock.close()

    def _lost(self, error: OSError) -> ConnectionLost:
        if self._closed:
            return ConnectionLost(f"UDP port {self.port} is closed")
        return ConnectionLost(f"UDP port {self.port} fails: {(error.strerror or str(error)).lower()}")


def _datagram_socket(family: int = socket.AF_INET) -> socket.socket:
    """A UDP socket.

    Raises:
        ConnectFailed: the system has none left.
    """
    with system_errors("a UDP socket cannot be opened", kind=ConnectFailed):
        return socket.socket(family, socket.SOCK_DGRAM)


def _limit_wait(sock: socket.socket, seconds: float) -> None:
    """Limit how long the socket waits for a datagram [s], in the kernel: Python's own limit costs a poll() per call."""
    if sys.platform == "win32":
        sock.settimeout(max(seconds, 1e-3))
        return
    micros = max(1, round(seconds * 1e6))
    interval = struct.pack("@ll", micros // 1_000_000, micros % 1_000_000)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, interval)


def _advice(error: OSError, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"another program on this machine uses it, perhaps another FRI client: end it (`ss -ulpn | grep {port}` "
            "names it), or choose another port here and in the cabinet's FRI configuration"
        )
    if error.errno == errno.EADDRNOTAVAIL:
        return "no network card of this machine has that address"
    if error.errno == errno.EACCES:
        return "ports below 1024 need root; FRI uses 30200 to 30209"
    return "choose another port here and in the cabinet's FRI configuration"


def own_address(peer: str) -> str:
    """Find the address from which this machine reaches another one; nothing is sent.

    Raises:
        ConnectFailed: the machine cannot be reached, or has no IPv4 address.
    """
    with _datagram_socket() as probe:
        try:
            probe.connect((peer, 9))
        except OSError as error:
            raise ConnectFailed(
                f"this machine's address towards {peer} is not known: {(error.strerror or str(error)).lower()}",
                hint="pass the address under which the cabinet reaches this machine",
            ) from error
        return str(probe.getsockname()[0])


#: Address that means every interface of this machine.
ALL_INTERFACES = "0.0.0.0"


def address_to_bind(host: str) -> str:
    """Find the address on which datagrams sent to `host`, an address of this machine, are received.

    Returns:
        That address, so that nobody in another network can send to the port. If no interface has it, because
        a router or a container translates addresses: all interfaces.
    """
    with _datagram_socket() as probe:
        try:
            probe.bind((host, 0))
        except OSError:
            return ALL_INTERFACES
        return str(probe.getsockname()[0])


class ConnectedUdp:
    """UDP socket from the local address of a connection to the address of its other end; only that end is received.

    Args:
        local: own address and port of the connection, as `socket.getsockname` returns it.
        peer: address and port of the other end; datagrams go to the same port.
        family: address family of the connection.

    Raises:
        ConnectFailed: the system refuses the socket.
    """

    __slots__ = ("_closed", "_sock")

    def __init__(self, local: tuple[Any, ...], peer: tuple[Any, ...], *, family: int) -> None:
        self._closed = False
        self._sock = _datagram_socket(family)
        try:
            self._sock.bind((local[0], 0, *local[2:]))
            self._sock.connect(peer)
        except OSError as error:
            self._sock.close()
            raise ConnectFailed(
                f"no UDP socket from {local[0]} to {peer[0]}:{peer[1]}: {(error.strerror or str(error)).lower()}"
            ) from error

    def send(self, data: bytes) -> bool:
        """Send a datagram without waiting; False if the system does not take it."""
        try:
            self._sock.send(data, _DO_NOT_WAIT)
        except OSError:  # nobody listens there, no buffer, closed: like a lost datagram
            return False
        return True

    def receive(self, seconds: float) -> bytes | None:
        """Wait for a datagram [s]; None: none came.

        Raises:
            ConnectionLost: the socket is closed.
        """
        try:
            _limit_wait(self._sock, seconds)
            return self._sock.recv(BUFFER)
        except OSError as error:
            if self._closed:
                raise ConnectionLost("the UDP socket is closed") from error
            if error.errno not in _NO_DATA:  # refused, or a network that is down: no reason for a busy loop
                time.sleep(min(seconds, 0.01))
            return None

    def close(self) -> None:
        """Close the socket. Closing twice is allowed; a waiting `receive` ends with its time."""
        self._closed = True
        self._sock.close()
