"""The first frames of a connection: versions, key, allow-list, and bytes that are no frame."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.frames import pack
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import NONCE, Peer

Connect = Callable[..., Peer]


def test_welcome_names_the_robot_and_what_it_can_do(connect: Connect) -> None:
    welcome = connect().welcome
    assert (welcome.major, welcome.minor) == (wire.MAJOR, wire.MINOR)
    assert welcome.robot.model == "iiwa14"
    assert welcome.robot.q_max[0] == pytest.approx(2.96)
    assert "ptp" in welcome.capabilities
    assert welcome.controller == ""
    assert welcome.mac == b""


@pytest.mark.parametrize("major", [0, 2, 65535])
def test_another_major_version_is_refused_and_both_are_named(connect: Connect, major: int) -> None:
    peer = connect(hello=False)
    peer.send(wire.Hello(major=major, minor=3, name="old", version="0", nonce=NONCE))
    refusal = peer.wait_for(wire.Refusal)
    assert refusal.code == Code.WRONG_VERSION
    assert f"{major}.3" in refusal.text
    assert f"{wire.MAJOR}.{wire.MINOR}" in refusal.text
    assert (refusal.major, refusal.minor) == (wire.MAJOR, wire.MINOR)
    assert peer.is_closed()


def test_another_version_in_the_header_is_refused_too(connect: Connect) -> None:
    peer = connect(hello=False)
    frame = bytearray(pack(wire.Hello.TYPE, b"the body of another version", seq=0))
    frame[2] = 9
    peer.socket.sendall(frame)
    refusal = peer.wait_for(wire.Refusal)
    assert refusal.code == Code.WRONG_VERSION
    assert "9" in refusal.text


def test_a_request_before_hello_is_refused(connect: Connect) -> None:
    peer = connect(hello=False)
    peer.send(wire.Stop())
    assert peer.wait_for(wire.Refusal).code == Code.UNEXPECTED_MESSAGE
    assert peer.is_closed()


def test_a_second_hello_is_refused_and_the_session_goes_on(connect: Connect) -> None:
    peer = connect()
    peer.send(wire.Hello(major=wire.MAJOR, minor=0, name="twice", version="0", nonce=NONCE), 5)
    assert isinstance(peer.answer(5), wire.Rejected)
    assert isinstance(peer.ask(wire.Stop()), wire.Accepted)


@pytest.mark.parametrize(
    "octets",
    [
        b"GET / HTTP/1.1\r\nHost: cabinet\r\n\r\n",
        b"\x00" * 64,
        struct.pack(">HBBHI", 0x4837, 1, 0, 37, 2**31) + b"\0" * 16,
    ],
)
@pytest.mark.parametrize("greeted", ["greeted", "not greeted"])
def test_octets_that_are_no_frame_end_that_connection_with_a_reason(
    connect: Connect, octets: bytes, greeted: str
) -> None:
    other = connect(name="other")
    peer = connect(hello=greeted == "greeted")
    peer.socket.sendall(octets)
    assert peer.wait_for(wire.Goodbye).code == Code.BAD_FRAME
    assert peer.is_closed()
    assert isinstance(other.ask(wire.Stop()), wire.Accepted)


def test_key_is_proved_both_ways(make: Callable[..., FakeCabinet]) -> None:
    import hashlib
    import hmac

    cabinet = make(key="sesame Äpfel")
    with Peer(cabinet.port, key="sesame Äpfel") as peer:
        challenge = peer.wait_for(wire.Challenge)
        proof = hmac.new("sesame Äpfel".encode(), NONCE + challenge.nonce, hashlib.sha256).digest()
        assert peer.welcome.mac == proof
    with Peer(cabinet.port, hello=False) as peer:
        with pytest.raises(AssertionError, match="Refusal"):
            peer.greet(key="wrong")
        assert peer.wait_for(wire.Refusal).code == Code.WRONG_KEY
        assert peer.is_closed()
    with Peer(cabinet.port, hello=False) as peer:  # a proof before the hello
        peer.send(wire.Proof(mac=b"x" * 32))
        assert peer.wait_for(wire.Refusal).code == Code.UNEXPECTED_MESSAGE
    with Peer(cabinet.port, hello=False) as peer:  # a request instead of the proof
        peer.send(wire.Hello(major=wire.MAJOR, minor=0, name="x", version="0", nonce=NONCE))
        peer.wait_for(wire.Challenge)
        peer.send(wire.Stop(), 1)
        assert peer.wait_for(wire.Refusal).code == Code.UNEXPECTED_MESSAGE
        assert peer.is_closed()


def test_an_address_that_is_not_on_the_list_is_refused(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(allow="10.0.0.1, 10.0.0.2")
    for _ in range(5):  # the refusal arrives every time, also when the client has already sent something
        with Peer(cabinet.port, hello=False) as peer:
            peer.send(wire.Hello(major=wire.MAJOR, minor=0, name="x", version="0", nonce=NONCE))
            assert peer.wait_for(wire.Refusal).code == Code.NOT_ALLOWED
            assert "127.0.0.1" in peer.wait_for(wire.Refusal).text
            assert peer.is_closed()


def test_only_so_many_clients_and_places_become_free_again(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    peers = [Peer(cabinet.port) for _ in range(16)]
    with Peer(cabinet.port, hello=False) as late:
        assert late.wait_for(wire.Refusal).code == Code.TOO_MANY_CLIENTS
        assert late.is_closed()
    for peer in peers:
        peer.close()
    deadline = time.monotonic() + 30.0
    while any("reader" in name for name in cabinet.threads()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    with Peer(cabinet.port) as peer:
        assert isinstance(peer.ask(wire.Stop()), wire.Accepted)


def test_a_connection_that_never_says_hello_is_closed(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with Peer(cabinet.port, hello=False) as peer:
        began = time.monotonic()
        hello = pack(wire.Hello.TYPE, b"\0" * 1000, seq=0)
        peer.socket.sendall(hello[:1])
        closed = False
        while not closed and time.monotonic() < began + 30.0:  # byte by byte it is no hello either
            peer.socket.sendall(hello[1 + int(time.monotonic() - began) :][:1])
            closed = peer.is_closed(0.5)
        assert closed and time.monotonic() - began > 4.0
