"""The first frames of a connection: versions, key, allow-list, and bytes that are no frame."""

from __future__ import annotations

import hmac
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.frames import pack
from heptarm.wire.key import KeyExchange, without_mac
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


@pytest.mark.parametrize("major", [0, 1, 3, 65535])
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
    "raw",
    [
        b"GET / HTTP/1.1\r\nHost: cabinet\r\n\r\n",
        b"\x00" * 64,
        struct.pack(">HBBHI", 0x4837, wire.MAJOR, 0, 37, 2**31) + b"\0" * 16,
    ],
)
@pytest.mark.parametrize("greeted", ["greeted", "not greeted"])
def test_bytes_that_are_no_frame_end_that_connection_with_a_reason(
    connect: Connect, raw: bytes, greeted: str
) -> None:
    other = connect(name="other")
    peer = connect(hello=greeted == "greeted")
    peer.socket.sendall(raw)
    assert peer.wait_for(wire.Goodbye).code == Code.BAD_FRAME
    assert peer.is_closed()
    assert isinstance(other.ask(wire.Stop()), wire.Accepted)


def test_a_frame_out_of_sequence_ends_the_session(connect: Connect) -> None:
    peer = connect()
    first, second = peer.pack(wire.SetOverride(value=0.5), 1), peer.pack(wire.Stop(), 2)
    peer.socket.sendall(second + first)
    assert peer.wait_for(wire.Goodbye).code == Code.FORGED_FRAME
    assert peer.is_closed()
    assert not peer.all(wire.Accepted) and not peer.all(wire.Rejected)


KEY = "sesame Äpfel"


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FakeCabinet]:
    with FakeCabinet(log=tmp_path_factory.mktemp("keyed") / "log", key=KEY) as cabinet:
        yield cabinet


def test_the_key_is_proved_both_directions_and_tags_every_frame(keyed: FakeCabinet) -> None:
    with Peer(keyed.port, key=KEY) as peer:
        challenge = peer.wait_for(wire.Challenge)
        exchange = KeyExchange(KEY.encode())
        exchange.add(wire.Hello.TYPE, peer.hello.encode())
        exchange.add(wire.Challenge.TYPE, challenge.encode())
        exchange.add(wire.Proof.TYPE, wire.Proof(mac=exchange.client_mac()).encode())
        body = next(frame.body for frame, message in peer.seen if isinstance(message, wire.Welcome))
        assert peer.welcome.mac == exchange.cabinet_mac(wire.Welcome.TYPE, without_mac(body))
        assert isinstance(peer.ask(wire.Stop()), wire.Accepted)  # its reader accepts tagged frames only


def _proofs(hello: wire.Hello, challenge: wire.Challenge) -> dict[str, bytes]:
    def exchange(key: str, first: wire.Hello) -> KeyExchange:
        made = KeyExchange(key.encode())
        made.add(first.TYPE, first.encode())
        made.add(challenge.TYPE, challenge.encode())
        return made

    return {
        "of another key": exchange("other", hello).client_mac(),
        "of another Hello": exchange(KEY, replace(hello, minor=9)).client_mac(),
        "of the cabinet's role": exchange(KEY, hello).cabinet_mac(wire.Welcome.TYPE, b""),
        "of version 1": hmac.digest(KEY.encode(), challenge.nonce + hello.nonce, "sha256"),
        "of the nonce": challenge.nonce,
    }


@pytest.mark.parametrize(
    "case", _proofs(wire.Hello(major=2, minor=0, nonce=NONCE), wire.Challenge(nonce=NONCE))
)
def test_a_wrong_proof_is_refused(keyed: FakeCabinet, case: str) -> None:
    with Peer(keyed.port, hello=False) as peer:
        hello = wire.Hello(major=wire.MAJOR, minor=0, name="x", version="0", nonce=NONCE)
        peer.send(hello)
        challenge = peer.wait_for(wire.Challenge)
        assert challenge.nonce != NONCE and len(challenge.nonce) == wire.NONCE
        peer.send(wire.Proof(mac=_proofs(hello, challenge)[case]))
        assert peer.wait_for(wire.Refusal).code == Code.WRONG_KEY
        assert peer.is_closed()


def test_no_two_challenges_are_the_same(keyed: FakeCabinet) -> None:
    """A proof that was overheard opens nothing later."""
    nonces = set()
    for _ in range(3):
        with Peer(keyed.port, key=KEY) as peer:
            nonces.add(peer.wait_for(wire.Challenge).nonce)
    assert len(nonces) == 3


def test_what_may_not_come_before_the_proof(keyed: FakeCabinet) -> None:
    hello = wire.Hello(major=wire.MAJOR, minor=0, name="x", version="0", nonce=NONCE)
    with Peer(keyed.port, hello=False) as peer:  # a proof before the hello
        peer.send(wire.Proof(mac=b"x" * 32))
        assert peer.wait_for(wire.Refusal).code == Code.UNEXPECTED_MESSAGE
    with Peer(keyed.port, hello=False) as peer:  # a request instead of the proof
        peer.send(hello)
        peer.wait_for(wire.Challenge)
        peer.send(wire.Stop(), 1)
        assert peer.wait_for(wire.Refusal).code == Code.UNEXPECTED_MESSAGE
        assert peer.is_closed()
    for nonce in (b"", bytes(31)):
        with Peer(keyed.port, hello=False) as peer:
            peer.send(replace(hello, nonce=nonce))
            assert peer.wait_for(wire.Refusal).code == Code.BAD_LENGTH


def test_an_address_that_is_not_on_the_list_is_refused(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(allow="10.0.0.1, 10.0.0.2")
    for _ in range(5):  # the refusal arrives every time, also when the client has already sent something
        with Peer(cabinet.port, hello=False) as peer:
            peer.send(wire.Hello(major=wire.MAJOR, minor=0, name="x", version="0", nonce=NONCE))
            assert peer.wait_for(wire.Refusal).code == Code.NOT_ALLOWED
            assert "127.0.0.1" in peer.wait_for(wire.Refusal).text
            assert peer.is_closed()


def test_a_connection_that_never_sends_hello_is_closed(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with Peer(cabinet.port, hello=False) as peer:
        began = time.monotonic()
        hello = pack(wire.Hello.TYPE, b"\0" * 900, seq=0)
        closed = False
        while not closed and time.monotonic() < began + 30.0:  # byte by byte it is no hello either
            peer.socket.sendall(hello[int(5 * (time.monotonic() - began)) :][:1])
            closed = peer.is_closed(0.2)
        assert closed and time.monotonic() - began > 0.9
        assert peer.wait_for(wire.Refusal).code == Code.SILENT
