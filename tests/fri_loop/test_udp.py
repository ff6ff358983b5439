"""UDP: receive times, and the errors of a taken port and a closed socket."""

from __future__ import annotations

import socket
import sys
import time

import pytest

from heptarm.errors import ConnectFailed, ConnectionLost
from heptarm.io.udp import ALL_INTERFACES, UdpSocket, address_to_bind, own_address


def test_a_datagram_comes_with_the_time_of_its_arrival_not_of_its_reading() -> None:
    one, other = UdpSocket(0, host="127.0.0.1"), UdpSocket(0, host="127.0.0.1")
    for _ in range(100):  # the kernel starts to add time stamps a moment after the request
        before = time.monotonic_ns()
        assert other.send(b"hello", ("127.0.0.1", one.port))
        sent = time.monotonic_ns()
        time.sleep(0.05)
        got = one.receive()
        assert got is not None
        data, received, sender = got
        assert data == b"hello" and sender == ("127.0.0.1", other.port)
        assert received >= before - 1_000_000
        if not one.stamps or received <= sent + 20_000_000:
            break
    else:
        pytest.fail("50 ms of sleep count")
    one.close()
    other.close()


def test_nothing_comes_within_the_patience() -> None:
    one = UdpSocket(0, host="127.0.0.1", patience=0.01)
    assert one.receive() is None
    one.close()
    one.close()
    with pytest.raises(ConnectionLost, match="is closed"):
        one.receive()
    with pytest.raises(ConnectionLost, match="is closed"):
        one.send(b"", ("127.0.0.1", 9))


def test_a_taken_port_is_named_with_a_remedy() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(ConnectFailed, match=f"UDP port {port}") as caught:
            UdpSocket(port, host="127.0.0.1")
    assert "another program" in caught.value.hint


def test_an_own_address_is_bound_and_an_address_of_a_router_means_all() -> None:
    assert address_to_bind("127.0.0.1") == "127.0.0.1"
    assert address_to_bind("localhost") == "127.0.0.1"
    assert address_to_bind("203.0.113.1") == ALL_INTERFACES
    assert own_address("127.0.0.1") == "127.0.0.1"


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
def test_an_address_of_no_card_is_named() -> None:
    with pytest.raises(ConnectFailed) as caught:
        UdpSocket(0, host="203.0.113.1")
    assert "no network card" in caught.value.hint
