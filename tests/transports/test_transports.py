"""Both transports pass the suite; and features of TCP alone."""

from __future__ import annotations

import socket
import time

import pytest

from heptarm.errors import ConnectFailed, ConnectionLost
from heptarm.io import tcp
from heptarm.io.transport import memory_pair
from tests.transports.conformance import Conformance, Pair


class TestMemory(Conformance):
    def make(self) -> Pair:
        return memory_pair()


class TestMemoryInPieces(Conformance):
    def make(self) -> Pair:
        return memory_pair(chunk=7)

    MUCH = 4  # seven bytes at a time are slow


class TestTcp(Conformance):
    def make(self) -> Pair:
        with tcp.listening() as listener:
            ours = tcp.connect("127.0.0.1", listener.port)
            return ours, listener.accept()


def test_nobody_listens() -> None:
    with tcp.listening() as listener:
        port = listener.port
    with pytest.raises(ConnectFailed, match="refused") as error:
        tcp.connect("127.0.0.1", port, timeout=1.0)
    assert "heptarm sim" in error.value.hint


def test_no_such_host() -> None:
    with pytest.raises(ConnectFailed, match="no host|answer"):
        tcp.connect("no-such-host.invalid", 1, timeout=1.0)


def test_a_port_that_is_taken() -> None:
    with tcp.listening() as listener, pytest.raises(ConnectFailed, match="cannot listen"):
        tcp.TcpListener(port=listener.port)


def test_nobody_comes() -> None:
    with tcp.listening() as listener, pytest.raises(ConnectFailed, match="no client connected"):
        listener.accept(timeout=0.01)


def test_a_peer_that_reads_nothing_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tcp, "SEND_TIMEOUT", 0.1)
    ours, theirs = TestTcp().make()
    began = time.monotonic()
    with pytest.raises(ConnectionLost, match="no answer"):
        ours.send(bytes(64 << 20))
    assert time.monotonic() - began < 30.0
    ours.close()
    theirs.close()


def test_a_reset_connection_is_lost() -> None:
    with tcp.listening() as listener:
        raw = socket.create_connection(("127.0.0.1", listener.port))
        theirs = listener.accept()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
    raw.close()
    with pytest.raises(ConnectionLost, match="reset"):
        theirs.receive_into(memoryview(bytearray(8)))
    theirs.close()


def test_small_frames_leave_at_once() -> None:
    ours, theirs = TestTcp().make()
    assert ours._sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)  # type: ignore[attr-defined]
    ours.close()
    theirs.close()
