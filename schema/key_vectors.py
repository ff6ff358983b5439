"""One handshake with a key and its first frames, computed here independently of the Python and the Java implementation."""

from __future__ import annotations

import hashlib
import hmac
import struct
from typing import Any

from sample_bodies import Maker
from spec import Spec

KEY = b"a key of a lab, 32 bytes or more"
CLIENT_NONCE = bytes(range(32))
CABINET_NONCE = bytes(range(0x80, 0xA0))
TIME = 1_234_567_890


def _bytes(value: bytes) -> bytes:
    return struct.pack(">I", len(value)) + value


def _text(value: str) -> bytes:
    return struct.pack(">H", len(value.encode())) + value.encode()


def _part(number: int, content: bytes) -> bytes:
    return struct.pack(">HI", number, len(content)) + content


def _mac(key: bytes, data: bytes) -> bytes:
    return hmac.new(key, data, hashlib.sha256).digest()


def _sealed(spec: Spec, key: bytes, number: int, content: bytes, seq: int, request: int) -> bytes:
    p = spec.protocol
    header = struct.pack(">HBBHIIIq", p["magic"], p["major"], 1, number, len(content), seq, request, TIME)
    frame = header + content
    return frame + _mac(key, struct.pack(">I", 0) + frame)[: p["tag"]]


def vectors(spec: Spec) -> dict[str, Any]:
    """The bytes of a handshake with a key, of the keys of the session and of one frame in each direction."""
    p, ids = spec.protocol, {name: one.id for name, one in spec.messages.items()}
    hello = struct.pack(">HH", p["major"], p["minor"]) + _text("vector") + _text("1.0") + _bytes(CLIENT_NONCE)
    challenge = _bytes(CABINET_NONCE)
    both = _part(ids["Hello"], hello) + _part(ids["Challenge"], challenge)
    client_mac = _mac(KEY, b"heptarm client\0" + both)
    proof = _bytes(client_mac)
    bare = Maker(spec, "key", 1).fields(spec.messages["Welcome"].fields[:-1]) + _bytes(b"")
    all_four = both + _part(ids["Proof"], proof) + _part(ids["Welcome"], bare)
    cabinet_mac = _mac(KEY, b"heptarm cabinet\0" + all_four)
    secret = _mac(CLIENT_NONCE + CABINET_NONCE, KEY)
    client_key = _mac(secret, b"heptarm client to cabinet\x01")
    cabinet_key = _mac(secret, b"heptarm cabinet to client\x01")
    stop, accepted = bytes([0]), struct.pack(">I", 0)
    return {
        name: value.hex()
        for name, value in {
            "key": KEY,
            "hello": hello,
            "challenge": challenge,
            "proof": proof,
            "welcome": bare[:-4] + _bytes(cabinet_mac),
            "client_mac": client_mac,
            "cabinet_mac": cabinet_mac,
            "client_key": client_key,
            "cabinet_key": cabinet_key,
            "stop_frame": _sealed(spec, client_key, ids["Stop"], stop, 2, 1),
            "accepted_frame": _sealed(spec, cabinet_key, ids["Accepted"], accepted, 2, 1),
        }.items()
    }


def page(spec: Spec) -> list[str]:
    """The section of the protocol page about the key."""
    p = spec.protocol
    lines = f"""## The key

A cabinet may have a pre-shared key: the bytes of its text in UTF-8. Both sides prove that they know it, and from the
Welcome on every frame is protected. Nothing is encrypted. `‖` joins bytes, `HMAC` is HMAC-SHA-256, and
`part(m)` is the id of a message (u16), the length of its body (u32) and its body.

1. The nonces of Hello and Challenge are {p["nonce"]} random bytes. A client refuses a Challenge with its own nonce.
2. `Proof.mac = HMAC(key, "heptarm client" ‖ 00 ‖ part(Hello) ‖ part(Challenge))`
3. `Welcome.mac = HMAC(key, "heptarm cabinet" ‖ 00 ‖ part(Hello) ‖ part(Challenge) ‖ part(Proof) ‖ part(Welcome with an
   empty mac))`. So each side proves its own role, and neither hello (versions, names, capabilities) can be changed unnoticed.
   A client that was given a key accepts no Welcome without this proof.
4. The session has two keys, by HKDF-SHA-256 (RFC 5869) with the salt `Hello.nonce ‖ Challenge.nonce`, 32 bytes each:
   the info is `"heptarm client to cabinet"` or `"heptarm cabinet to client"`.
5. After the Welcome each frame of both directions has the flag 1 and ends with a tag of {p["tag"]} bytes, which `length` does not
   count: the first bytes of `HMAC(key of the direction, n ‖ header ‖ body)`. `n` (u32) is how often the sequence number of
   this direction has wrapped.
6. A frame with a wrong tag, without a tag or out of sequence is not executed. It ends the session with the code `forged_frame`; if
   the client controlled the robot, the arm stops. Without a key no frame has a tag, and a tag ends the session.

A Halt needs no key: anyone who can reach the port can stop the arm.

One handshake with its first two frames, as hexadecimal bytes; an implementation can check itself against them
(`schema/golden/key.json`):

| | bytes |
|---|---|""".splitlines()
    lines += [f"| {name} | `{value}` |" for name, value in vectors(spec).items() if name != "welcome"]
    return [*lines, ""]
