"""TCP: the transport to a cabinet. No OSError leaves this module."""

from __future__ import annotations

import contextlib
import errno
import select
import socket
import struct
import sys
from collections.abc import Iterator

from heptarm.errors import ConnectFailed, ConnectionLost

#: A cabinet that reads nothing for this long is lost [s].
SEND_TIMEOUT = 2.0
_DO_NOT_WAIT: int = getattr(socket, "MSG_DONTWAIT", 0)  # without it, the patience bounds the wait
_NO_DATA = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ETIMEDOUT)


def connect(host: str, port: int, *, timeout: float = 5.0) -> TcpTransport:
    """Connect to a listening cabinet.

    Args:
        host: name or address.
        port: TCP port.
        timeout: how long to try [s].

    Raises:
        ConnectFailed: nobody answers there; the text says why and what to check.
    """
    try:
        return TcpTransport(socket.create_connection((host, port), timeout=timeout))
    except OSError as error:
        raise ConnectFailed(
            f"no cabinet answers at {host}:{port}: {_reason(error, timeout)}", hint=_advice(error)
        ) from error


class TcpTransport:
    """A connected TCP socket.

    Args:
        sock: the socket; it belongs to the transport from now on.
    """

    __slots__ = ("_closed", "_poll", "_sock", "peer")

    peer: str

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._closed = False
        # time-outs live in the kernel: Python's own cost a poll() before each call
        sock.settimeout(None)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, _interval(SEND_TIMEOUT))
        self.set_patience(0.1)
        self._poll = select.poll() if hasattr(select, "poll") else None
        if self._poll is not None:
            self._poll.register(sock, select.POLLIN)
        name = sock.getpeername()
        self.peer = f"{name[0]}:{name[1]}" if isinstance(name, tuple) else "peer"

    def send(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._sock.sendall(data)
        except OSError as error:
            raise self._lost(error) from error

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Octets that came; with `wait`, for up to the patience."""
        try:
            size = self._sock.recv_into(buffer, 0, 0 if wait else _DO_NOT_WAIT)
        except OSError as error:
            if error.errno in _NO_DATA and not self._closed:
                return 0
            raise self._lost(error) from error
        if size == 0:
            raise self._lost(None)
        return size

    def wait_readable(self, seconds: float) -> bool:
        """Wait until there is something to receive."""
        try:
            if self._poll is None:  # Windows
                return bool(select.select([self._sock], [], [], seconds)[0])
            return bool(self._poll.poll(max(seconds, 0.0) * 1e3))
        except (OSError, ValueError):
            return True  # closed: receiving tells

    def set_patience(self, seconds: float) -> None:
        """How long `receive_into` waits for octets."""
        with contextlib.suppress(OSError):  # a lost connection shows at the next call
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _interval(max(seconds, 1e-3)))

    def close(self) -> None:
        """End it."""
        self._closed = True
        with contextlib.suppress(OSError):  # the other side may have been faster
            self._sock.shutdown(socket.SHUT_RDWR)
        self._sock.close()

    def _lost(self, error: OSError | None) -> ConnectionLost:
        if self._closed:
            return ConnectionLost(f"the connection to {self.peer} is closed")
        reason = "it closed the connection" if error is None else _reason(error, SEND_TIMEOUT)
        return ConnectionLost(f"the connection to {self.peer} is lost: {reason}")


class TcpListener:
    """A listening socket: the cabinet's side, for tests and tools.

    Args:
        host: address to listen on.
        port: TCP port; 0 for any free one.
    """

    __slots__ = ("_sock", "port")

    def __init__(self, *, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            self._sock = socket.create_server((host, port))
        except OSError as error:
            raise ConnectFailed(f"cannot listen on {host}:{port}: {error.strerror or error}") from error
        self.port: int = self._sock.getsockname()[1]

    def accept(self, *, timeout: float = 5.0) -> TcpTransport:
        """The next client.

        Raises:
            ConnectFailed: nobody came in time.
        """
        self._sock.settimeout(timeout)
        try:
            return TcpTransport(self._sock.accept()[0])
        except OSError as error:
            raise ConnectFailed(f"nobody connected: {_reason(error, timeout)}") from error

    def close(self) -> None:
        """Stop listening."""
        self._sock.close()


@contextlib.contextmanager
def listening(*, host: str = "127.0.0.1", port: int = 0) -> Iterator[TcpListener]:
    """A listener for the length of a block."""
    listener = TcpListener(host=host, port=port)
    try:
        yield listener
    finally:
        listener.close()


def _interval(seconds: float) -> bytes | int:
    """A time-out as the socket option wants it."""
    if sys.platform == "win32":
        return max(1, round(seconds * 1000))
    micros = max(1, round(seconds * 1e6))
    return struct.pack("@ll", micros // 1_000_000, micros % 1_000_000)


def _reason(error: OSError, timeout: float) -> str:
    if isinstance(error, TimeoutError) or error.errno in _NO_DATA:
        return f"no answer within {timeout:g} s"
    if isinstance(error, socket.gaierror):
        return "there is no host of that name"
    return (error.strerror or str(error)).lower()


def _advice(error: OSError) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "start the heptarm application on the cabinet, or `heptarm sim`, and check the port"
    if isinstance(error, socket.gaierror):
        return "check the spelling, or give the address in numbers"
    return "check the cable, the cabinet's address and this machine's own address in its network"
