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
TOKEN = bytes(range(0x40, 0x60))
SESSION = 5
_UP, _DOWN = b"heptarm client to cabinet", b"heptarm cabinet to client"


def _bytes(value: bytes) -> bytes:
    return struct.pack(">I", len(value)) + value


def _text(value: str) -> bytes:
    return struct.pack(">H", len(value.encode())) + value.encode()


def _part(number: int, content: bytes) -> bytes:
    return struct.pack(">HI", number, len(content)) + content


def _mac(key: bytes, data: bytes) -> bytes:
    return hmac.new(key, data, hashlib.sha256).digest()


def _sealed(
    spec: Spec, key: bytes, number: int, content: bytes, seq: int, request: int, *, wraps: int = 0
) -> bytes:
    p = spec.protocol
    header = struct.pack(">HBBHIIIq", p["magic"], p["major"], 1, number, len(content), seq, request, TIME)
    frame = header + content
    return frame + _mac(key, struct.pack(">I", wraps) + frame)[: p["tag"]]


def _datagram(
    spec: Spec, secret: bytes, label: bytes, number: int, content: bytes, seq: int, request: int
) -> bytes:
    key = _mac(secret, label + b" datagrams" + TOKEN + b"\x01")
    return struct.pack(">I", SESSION) + _sealed(spec, key, number, content, seq, request)


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
    client_key = _mac(secret, _UP + b"\x01")
    cabinet_key = _mac(secret, _DOWN + b"\x01")
    target = struct.pack(">Id7d", 9, 0.2, *(0.1 * axis for axis in range(7)))
    pong = struct.pack(">qq", TIME - 1000, TIME)
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
            "stop_frame_after_wrap": _sealed(spec, client_key, ids["Stop"], stop, 2, 1, wraps=1),
            "accepted_frame": _sealed(spec, cabinet_key, ids["Accepted"], accepted, 2, 1),
            "token": TOKEN,
            "target_datagram": _datagram(spec, secret, _UP, ids["ServoJoints"], target, 3, 17),
            "pong_datagram": _datagram(spec, secret, _DOWN, ids["Pong"], pong, 4, 0),
            "target_datagram_without_key": _datagram(spec, TOKEN, _UP, ids["ServoJoints"], target, 3, 17),
            "pong_datagram_without_key": _datagram(spec, TOKEN, _DOWN, ids["Pong"], pong, 4, 0),
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
    return [*lines, "", *_datagrams(spec), ""]


def _datagrams(spec: Spec) -> list[str]:
    """The section of the protocol page about datagrams."""
    p = spec.protocol
    names = ", ".join(
        f"[{message.name}](#{message.name.lower()})" for message in spec.messages.values() if message.datagram
    )
    return f"""## Datagrams

TCP delivers everything in order, so one lost packet delays all that follow by its retransmission: on a network that loses
packets, for longer than a servo motion waits for a target. Beside the session, which stays on TCP, a client may therefore open
datagrams: UDP, with the number of the TCP port, at most {p["max_datagram"]} bytes each. They may contain {names}; all else stays on TCP.

1. The client sends OpenDatagrams in its session; the answer is a random token of {p["token"]} bytes. A cabinet without a UDP port
   refuses.
2. A datagram is the number of the session (u32, of Welcome), then one frame with the flag 1 and a tag. `seq` counts the
   datagrams of one direction and token, from 0, and never wraps; `time` is in both directions of the cabinet's
   clock, which the client estimates from its pings.
3. Each direction has a key: `HMAC(S, "heptarm client to cabinet datagrams" ‖ token ‖ 01)` or `HMAC(S, "heptarm cabinet to
   client datagrams" ‖ token ‖ 01)`. With a pre-shared key, S is the secret of which the keys of the session follow (step 4
   above, before the info is applied); without one it is the token. The tag is computed as above, with n = 0.
4. The receiver ignores, and counts, a datagram that is damaged, that has a wrong tag, that is not newer (by `seq`) than every
   accepted one of its stream, or that is too old (by `time`): for the cabinet, than the watchdog time of the client in control, 0.5 s
   for others; for the client, than 1 s. A stream is: all servo targets;
   Stop and Cancel; each other message. The cabinet also ignores what does not come from the address of the session. An ignored
   datagram has no other effect; it never ends a session.
5. Each side sends Ping as datagram a few times a second; the other one answers with Pong by datagram. While its pings are
   answered, the cabinet sends states as datagrams (those that fit into one), otherwise over TCP. The client sends each
   target as datagram, and over TCP as well unless an answer came recently, so that it falls back without waiting.
6. A target that may come twice has a number (`request`) that rises with each target of the session. The cabinet follows a target
   only if its number is 0 or higher than that of every target before.
7. Stop and Cancel always go over TCP, with their answer. A client may also send them as datagrams, repeatedly, with the same
   `request`. The cabinet executes such a datagram unless that request, or a later one, has already come; it does not answer it.
8. An accepted datagram is a sign of life of its sender as of its `time`. A session in which TCP is silent for 10 s ends nevertheless.
""".splitlines()
