"""TCP transport to a cabinet, and listener for the cabinet's side."""

from __future__ import annotations

import contextlib
import errno
import select
import socket
import struct
import sys
from collections.abc import Callable, Iterator

from heptarm.errors import ConnectFailed, ConnectionLost, shortage
from heptarm.io.udp import ConnectedUdp

#: The connection is lost if the other side reads nothing for this long [s].
SEND_TIMEOUT = 2.0
#: A flag of recv(2).
MSG_DONTWAIT: int = getattr(socket, "MSG_DONTWAIT", 0)  # without it, the patience bounds the wait
_NO_DATA = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ETIMEDOUT)


def connect(host: str, port: int, *, timeout: float = 5.0) -> TcpTransport:
    """Connect to a listening cabinet.

    Args:
        host: name or address.
        port: TCP port.
        timeout: how long to try [s].

    Raises:
        ConnectFailed: no cabinet answers there; the text names the cause and what to check.
    """
    try:
        return TcpTransport(socket.create_connection((host, port), timeout=timeout))
    except OSError as error:
        raise ConnectFailed(
            f"no cabinet answers at {host}:{port}: {_reason(error, timeout)}", hint=_advice(error)
        ) from error


class TcpTransport:
    """Transport over a connected TCP socket.

    Args:
        sock: the socket; the transport closes it.
    """

    __slots__ = ("_closed", "_poll", "_sock", "fileno", "peer")

    peer: str
    fileno: Callable[[], int]

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self.fileno = sock.fileno  # not a method: every request calls it
        self._closed = False
        # time-outs are set in the kernel: Python's own cost a poll() before each call
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
        """Send all the data."""
        try:
            self._sock.sendall(data)
        except OSError as error:
            raise self.lost(error) from error

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Receive bytes; with `wait`, wait for up to the patience."""
        try:
            size = self._sock.recv_into(buffer, 0, 0 if wait else MSG_DONTWAIT)
        except OSError as error:
            if error.errno in _NO_DATA and not self._closed:
                return 0
            raise self.lost(error) from error
        if size == 0:
            raise self.lost(None)
        return size

    def wait_readable(self, seconds: float) -> bool:
        """Wait until bytes (or the end) can be received."""
        try:
            if self._poll is None:  # Windows
                return bool(select.select([self._sock], [], [], seconds)[0])
            return bool(self._poll.poll(max(seconds, 0.0) * 1e3))
        except (OSError, ValueError):
            return True  # closed: receiving raises the error

    def set_patience(self, seconds: float) -> None:
        """Set how long `receive_into` waits for bytes [s]."""
        with contextlib.suppress(OSError):  # a lost connection shows at the next call
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _interval(max(seconds, 1e-3)))

    def lost(self, error: OSError | None) -> ConnectionLost:
        """The error of a connection whose socket has this error; None: of one that the other side has closed."""
        if self._closed:
            return ConnectionLost(f"the connection to {self.peer} is closed")
        reason = "the other side closed it" if error is None else _reason(error, SEND_TIMEOUT)
        return ConnectionLost(f"the connection to {self.peer} is lost: {reason}")

    def close(self) -> None:
        """Close the connection. Closing twice is allowed."""
        self._closed = True
        with contextlib.suppress(OSError):  # the other side may have been faster
            self._sock.shutdown(socket.SHUT_RDWR)
        self._sock.close()

    def abandon(self) -> None:
        """Give up the copy that a fork of the process has; the connection of the original process stays."""
        self._closed = True
        self._sock.close()  # without shutdown, which would end the connection for both processes

    def datagrams(self) -> ConnectedUdp | None:
        """Open a UDP socket between the addresses of this connection, to the same port; None: that is impossible."""
        try:
            return ConnectedUdp(self._sock.getsockname(), self._sock.getpeername(), family=self._sock.family)
        except (OSError, ConnectFailed):  # the connection has ended, or is no connection of the network
            return None


class TcpListener:
    """Listening socket: the cabinet's side, for tests and tools.

    Args:
        host: address to listen on.
        port: TCP port; 0 for any free one.
    """

    __slots__ = ("_sock", "port")

    def __init__(self, *, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            self._sock = socket.create_server((host, port))
        except OSError as error:
            raise ConnectFailed(
                f"cannot listen on {host}:{port}: {error.strerror or error}", hint=shortage(error)
            ) from error
        self.port: int = self._sock.getsockname()[1]

    def accept(self, *, timeout: float = 5.0) -> TcpTransport:
        """Wait for the next client.

        Raises:
            ConnectFailed: no client connected in time.
        """
        self._sock.settimeout(timeout)
        try:
            return TcpTransport(self._sock.accept()[0])
        except OSError as error:
            raise ConnectFailed(f"no client connected: {_reason(error, timeout)}") from error

    def close(self) -> None:
        """Stop listening."""
        self._sock.close()


@contextlib.contextmanager
def listening(*, host: str = "127.0.0.1", port: int = 0) -> Iterator[TcpListener]:
    """Listen for the duration of a `with` block."""
    listener = TcpListener(host=host, port=port)
    try:
        yield listener
    finally:
        listener.close()


def _interval(seconds: float) -> bytes | int:
    """Value of a socket option for a time-out [s]."""
    if sys.platform == "win32":
        return max(1, round(seconds * 1000))
    micros = max(1, round(seconds * 1e6))
    return struct.pack("@ll", micros // 1_000_000, micros % 1_000_000)


def _reason(error: OSError, timeout: float) -> str:
    if isinstance(error, TimeoutError) or error.errno in _NO_DATA:
        return f"no answer within {timeout:g} s"
    if isinstance(error, socket.gaierror):
        return "no host has that name"
    return (error.strerror or str(error)).lower()


def _advice(error: OSError) -> str:
    if remedy := shortage(error):
        return remedy
    if isinstance(error, ConnectionRefusedError):
        return "start the heptarm application on the cabinet, or `heptarm sim`, and check the port"
    if isinstance(error, socket.gaierror):
        return "check the spelling, or use the IP address; `heptarm targets` lists the names of saved robots"
    return "check the cable, the cabinet's address and this machine's own address in its network"
