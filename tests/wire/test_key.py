"""The pre-shared key: golden vectors in both languages, reflection, downgrade, and frames that were tampered with."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codes import Code
from heptarm.wire.frames import pack
from heptarm.wire.key import KeyExchange, without_mac
from heptarm.wire.messages import HEADER, Accepted, Challenge, Hello, Ping, Proof, SetOverride, Stop, Welcome
from heptarm.wire.session import RECEIVED, SENT, Received, Session, Side
from heptarm.wire.states import SessionState
from tests.cabinet import fake
from tests.cabinet.fake import toolchain
from tests.wire.pairs import open_pair, pour, welcome

VECTORS = {
    name: bytes.fromhex(value)
    for name, value in json.loads(
        (Path(__file__).parents[2] / "schema" / "golden" / "key.json").read_text()
    ).items()
}
DATAGRAMS = [VECTORS[f"{name}_datagram{end}"] for end in ("", "_without_key") for name in ("target", "pong")]
KEY = b"k" * 32
NONCES = bytes(32), bytes(range(32))


# ------------------------------------------------------------------------------------ vectors


def test_python_computes_the_golden_vectors() -> None:
    v = VECTORS
    hello, challenge = Hello.decode(v["hello"]), Challenge.decode(v["challenge"])
    exchange = KeyExchange(v["key"])
    exchange.add(Hello.TYPE, v["hello"])
    exchange.add(Challenge.TYPE, v["challenge"])
    assert exchange.client_mac() == v["client_mac"] == Proof.decode(v["proof"]).mac
    exchange.add(Proof.TYPE, v["proof"])
    assert exchange.cabinet_mac(Welcome.TYPE, without_mac(v["welcome"])) == v["cabinet_mac"]
    up, down = exchange.tags(hello.nonce, challenge.nonce)
    assert up.of(v["stop_frame"][:-16]) == v["stop_frame"][-16:]
    assert down.of(v["accepted_frame"][:-16]) == v["accepted_frame"][-16:]
    up.begin_round()
    assert up.of(v["stop_frame"][:-16]) == v["stop_frame_after_wrap"][-16:]


def test_a_python_session_speaks_the_golden_vectors() -> None:
    v = VECTORS
    hello = Hello.decode(v["hello"])
    client = Session(Side.CLIENT, key=v["key"], nonce=hello.nonce)
    assert client.send(hello)[HEADER.size :] == v["hello"]
    pour(pack(Challenge.TYPE, v["challenge"], seq=0), client)
    assert client.send(client.proof())[HEADER.size :] == v["proof"]
    pour(pack(Welcome.TYPE, v["welcome"], seq=1), client)
    assert client.send(Stop(), request=1, time=1_234_567_890) == v["stop_frame"]
    assert pour(v["accepted_frame"], client) == [Received(Accepted(id=0), 1, 1_234_567_890)]


def test_java_computes_the_golden_vectors() -> None:
    v = VECTORS
    given = [v["hello"], v["challenge"], v["proof"], without_mac(v["welcome"])]
    nonces = Hello.decode(v["hello"]).nonce, Challenge.decode(v["challenge"]).nonce
    frames = v["stop_frame"][:-16], v["accepted_frame"][:-16]
    arguments = [
        v["key"].decode(),
        *(one.hex() for one in (*given, *nonces, *frames, v["token"], *DATAGRAMS)),
    ]
    command = [toolchain.find_jdk().java, "-cp", fake.classes(), "heptarm.fake.KeyProbe", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert [bytes.fromhex(line) for line in done.stdout.split()] == [
        v["client_mac"],
        v["cabinet_mac"],
        v["stop_frame"][-16:],
        v["stop_frame_after_wrap"][-16:],
        v["accepted_frame"][-16:],
        *4 * [b"\0\0\0\5"],
    ]


# ------------------------------------------------------------------------------------ proofs


def challenged(key: bytes = KEY, other: bytes = KEY) -> tuple[Session, Session]:
    client = Session(Side.CLIENT, key=key, nonce=NONCES[0])
    cabinet = Session(Side.CABINET, key=other, nonce=NONCES[1])
    pour(client.send(client.hello(name="t")), cabinet)
    pour(cabinet.send(cabinet.challenge()), client)
    return client, cabinet


def test_both_sides_prove_the_key() -> None:
    client, cabinet = challenged()
    pour(client.send(client.proof()), cabinet)
    assert cabinet.is_proven
    pour(cabinet.send(welcome()), client)
    assert client.is_proven and client.state is cabinet.state is SessionState.OPEN


def test_no_two_sessions_have_the_same_nonce() -> None:
    sessions = [Session(side, key=KEY) for side in Side for _ in range(3)]
    nonces = {one.hello(name="t").nonce for one in sessions} | {one.challenge().nonce for one in sessions}
    assert len(nonces) == len(sessions)


def test_a_wrong_key_proves_nothing() -> None:
    client, cabinet = challenged(other=b"other")
    pour(client.send(client.proof()), cabinet)
    assert not cabinet.is_proven
    with pytest.raises(LocalProtocolError, match="no Welcome"):
        cabinet.send(welcome())


def test_a_proof_without_a_key_is_a_bug() -> None:
    with pytest.raises(LocalProtocolError):
        Session(Side.CLIENT).proof()


def refuses(client: Session, *frames: bytes) -> int:
    with pytest.raises(RemoteProtocolError) as error:
        pour(b"".join(frames), client)
    assert client.state is SessionState.CLOSED
    assert error.value.code is not None
    return error.value.code


@pytest.mark.parametrize("knows", [False, True], ids=["rogue", "with the key"])
def test_a_client_with_a_key_opens_no_session_without_a_challenge(knows: bool) -> None:
    client, exchange = Session(Side.CLIENT, key=KEY), KeyExchange(KEY)
    hello = client.hello(name="t")
    client.send(hello)
    exchange.add(Hello.TYPE, hello.encode())
    mac = exchange.cabinet_mac(Welcome.TYPE, welcome(mac=b"").encode()) if knows else bytes(32)
    assert refuses(client, pack(Welcome.TYPE, welcome(mac=mac).encode(), seq=0)) == Code.WRONG_KEY


@pytest.mark.parametrize("nonce", [NONCES[0], b"", bytes(31), bytes(33)])
def test_a_rogue_cabinet_that_echoes_the_nonce_or_sends_a_short_one_is_refused(nonce: bytes) -> None:
    client = Session(Side.CLIENT, key=KEY, nonce=NONCES[0])
    client.send(client.hello(name="t"))
    code = refuses(client, pack(Challenge.TYPE, Challenge(nonce=nonce).encode(), seq=0))
    assert code == (Code.WRONG_KEY if len(nonce) == 32 else Code.BAD_LENGTH)


@pytest.mark.parametrize("case", ["the client's own", "of an oracle with the nonces swapped", "empty"])
def test_a_rogue_cabinet_cannot_reflect_a_mac(case: str) -> None:
    client, _ = challenged()
    proof = client.proof()
    client.send(proof)
    mac = proof.mac
    if case == "empty":
        mac = b""
    elif case.startswith(
        "of an oracle"
    ):  # a client of the same key that the rogue lets prove something to it
        oracle = Session(Side.CLIENT, key=KEY, nonce=NONCES[1])
        oracle.send(oracle.hello(name="t"))
        pour(pack(Challenge.TYPE, Challenge(nonce=NONCES[0]).encode(), seq=0), oracle)
        mac = oracle.proof().mac
    assert refuses(client, pack(Welcome.TYPE, welcome(mac=mac).encode(), seq=1)) == Code.WRONG_KEY


@pytest.mark.parametrize(
    "change", [{"minor": 9}, {"version": "0"}, {"name": "x"}, {"nonce": bytes([7] * 32)}]
)
def test_a_changed_hello_fails_the_proof(change: dict[str, object]) -> None:
    client, cabinet = Session(Side.CLIENT, key=KEY), Session(Side.CABINET, key=KEY)
    hello = client.hello(name="t", version="1")
    client.send(hello)
    pour(pack(Hello.TYPE, replace(hello, **change).encode(), seq=0), cabinet)  # type: ignore[arg-type]
    pour(cabinet.send(cabinet.challenge()), client)
    pour(client.send(client.proof()), cabinet)
    assert not cabinet.is_proven


@pytest.mark.parametrize(
    "change", [{"minor": 9}, {"software": "9"}, {"capabilities": ("ptp",)}, {"heartbeat": 9.0}]
)
def test_a_changed_welcome_is_refused(change: dict[str, object]) -> None:
    client, cabinet = challenged()
    pour(client.send(client.proof()), cabinet)
    honest = Welcome.decode(cabinet.send(welcome())[HEADER.size :])
    body = replace(honest, **change).encode()  # type: ignore[arg-type]
    assert refuses(client, pack(Welcome.TYPE, body, seq=1)) == Code.WRONG_KEY


# ------------------------------------------------------------------------------------ frames


def requests(client: Session, count: int = 3) -> list[bytes]:
    return [client.send(SetOverride(value=0.1), request=client.next_request()) for _ in range(count)]


ATTACKS: dict[str, Callable[[list[bytes]], list[bytes]]] = {
    "repeated": lambda f: [f[0], f[0]],
    "reordered": lambda f: [f[1], f[0]],
    "dropped": lambda f: [f[1]],
    "renumbered": lambda f: [f[1][:10] + bytes(3) + b"\2" + f[1][14:]],
    "without its tag": lambda f: [f[0][:3] + b"\0" + f[0][4:-16]],
    "made without the key": lambda _: [pack(Stop.TYPE, Stop().encode(), seq=2, request=9)],
    "changed": lambda f: [f[0][:-17] + bytes([f[0][-17] ^ 1]) + f[0][-16:]],
    "tagged by another": lambda f: [f[0][:-16] + bytes(16)],
}


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("side", [Side.CLIENT, Side.CABINET])
def test_an_attacked_line_ends_the_session(attack: str, side: Side) -> None:
    client, cabinet = open_pair(KEY)
    sender, receiver = (client, cabinet) if side is Side.CLIENT else (cabinet, client)
    frames = requests(client) if side is Side.CLIENT else [cabinet.send(Ping(sent=n)) for n in range(3)]
    first, *others = ATTACKS[attack](frames)
    if others and first is frames[0]:
        assert len(pour(first, receiver)) == 1
        first = others[0]
    assert refuses(receiver, first) == Code.FORGED_FRAME
    assert sender.state is SessionState.OPEN


def test_an_answer_after_a_lost_frame_is_refused() -> None:
    client, cabinet = open_pair(KEY)
    pour(requests(client, 1)[0], cabinet)
    cabinet.send(Ping(sent=1))  # lost
    assert refuses(client, cabinet.send(Accepted(id=0), request=1)) == Code.FORGED_FRAME


def test_a_frame_of_another_session_is_refused() -> None:
    client, _ = open_pair(KEY)
    _, cabinet = open_pair(KEY)
    assert refuses(cabinet, requests(client, 1)[0]) == Code.FORGED_FRAME


def test_a_frame_of_the_other_direction_is_refused() -> None:
    client, _ = open_pair(KEY)
    echoed = client.send(Ping(sent=1))
    assert refuses(client, echoed) == Code.FORGED_FRAME


@given(st.integers(0, 10**6), st.integers(1, 255))
def test_any_changed_byte_is_noticed(place: int, change: int) -> None:
    client, cabinet = open_pair(KEY)
    frame = bytearray(requests(client, 1)[0])
    frame[place % len(frame)] ^= change
    try:
        events = pour(bytes(frame) + client.send(Stop(), request=9), cabinet)
    except RemoteProtocolError:
        events = []
    assert events == []  # a longer announced length waits for bytes; nothing is handed over either way


def test_tags_go_on_after_the_sequence_number_wraps() -> None:
    client, cabinet = open_pair(KEY)
    client.counts[SENT] = cabinet.counts[RECEIVED] = 0xFFFFFFFF
    first = client.send(Ping(sent=1))
    second = client.send(Ping(sent=2))
    assert [one.message for one in pour(first + second, cabinet)] == [Ping(sent=1), Ping(sent=2)]
    up, _ = KeyExchange(KEY).tags(client._nonce, cabinet._nonce)
    assert up.of(second[:-16]) != second[-16:]  # what was sent before the wrap fits no more
    up.begin_round()
    assert up.of(second[:-16]) == second[-16:]
