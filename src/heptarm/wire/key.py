"""The pre-shared key: both sides prove that they know it, and every frame of their session carries a tag.

The formulas and test vectors are on the page about the protocol; schema/key_vectors.py computes the vectors.
"""

from __future__ import annotations

import hashlib
import hmac
import struct

from heptarm.wire.messages import NONCE, TAG

_CLIENT, _CABINET = b"heptarm client\0", b"heptarm cabinet\0"
_UP, _DOWN = b"heptarm client to cabinet\x01", b"heptarm cabinet to client\x01"
_UP_DATAGRAMS, _DOWN_DATAGRAMS = (
    b"heptarm client to cabinet datagrams",
    b"heptarm cabinet to client datagrams",
)
_PART = struct.Struct(">HI")
_ROUND = struct.Struct(">I")
_NO_MAC = bytes(4)
_INNER, _OUTER = bytes(byte ^ 0x36 for byte in range(256)), bytes(byte ^ 0x5C for byte in range(256))


class KeyExchange:
    """What a key proves in one handshake, for either side.

    Args:
        key: pre-shared key.
    """

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._parts = b""

    def add(self, number: int, body: bytes) -> None:
        """Add the next message of the handshake: its id and its body."""
        self._parts += _PART.pack(number, len(body)) + body

    def client_mac(self) -> bytes:
        """The client's proof, after Hello and Challenge."""
        return hmac.digest(self._key, _CLIENT + self._parts, "sha256")

    def cabinet_mac(self, number: int, welcome: bytes) -> bytes:
        """The cabinet's proof, after Hello, Challenge and Proof.

        Args:
            number: message id of the Welcome.
            welcome: its body with an empty mac.
        """
        return hmac.digest(
            self._key, _CABINET + self._parts + _PART.pack(number, len(welcome)) + welcome, "sha256"
        )

    def tags(self, client_nonce: bytes, cabinet_nonce: bytes) -> tuple[FrameTag, FrameTag]:
        """Derive the keys of the session; returns the tags of the client's frames and of the cabinet's."""
        secret = self.secret(client_nonce, cabinet_nonce)
        up, down = (hmac.digest(secret, label, "sha256") for label in (_UP, _DOWN))
        return FrameTag(up), FrameTag(down)

    def secret(self, client_nonce: bytes, cabinet_nonce: bytes) -> bytes:
        """The secret of which all keys of the session follow."""
        return hmac.digest(client_nonce + cabinet_nonce, self._key, "sha256")


def datagram_tags(secret: bytes | None, token: bytes) -> tuple[FrameTag, FrameTag]:
    """Derive the keys of a session's datagrams; returns the tags of the client's and of the cabinet's.

    Args:
        secret: of the session; None: it has no key, and all depends on the token.
        token: that the cabinet sent in the session.
    """
    base = token if secret is None else secret
    up, down = (
        hmac.digest(base, label + token + b"\x01", "sha256") for label in (_UP_DATAGRAMS, _DOWN_DATAGRAMS)
    )
    return FrameTag(up), FrameTag(down)


def without_mac(welcome: bytes) -> bytes:
    """The body of a Welcome with an empty mac."""
    return welcome[: -NONCE - len(_NO_MAC)] + _NO_MAC


class FrameTag:
    """Tags of the frames of one direction: truncated HMAC-SHA-256 (RFC 2104) from hash states prepared once.

    Args:
        key: the key of this direction [32 bytes].
    """

    __slots__ = ("_hashes", "_key", "_round")

    def __init__(self, key: bytes) -> None:
        self._key = key.ljust(64, b"\0")
        self._round = -1
        self.begin_round()

    def begin_round(self) -> None:
        """Begin to count the frames from 0; called again each time their sequence number wraps."""
        self._round += 1
        begins = self._key.translate(_INNER) + _ROUND.pack(self._round), self._key.translate(_OUTER)
        self._hashes = tuple(hashlib.sha256(begin).copy for begin in begins)

    def of(self, frame: bytes | bytearray | memoryview) -> bytes:
        """The tag of a frame: of its header and its body."""
        copy_inner, copy_outer = self._hashes
        inner, outer = copy_inner(), copy_outer()
        inner.update(frame)
        outer.update(inner.digest())
        return outer.digest()[:TAG]
