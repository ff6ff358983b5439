"""Versions of FRI: framing of datagrams, features, and recognition from the first datagram."""

from __future__ import annotations

import enum
import zlib
from dataclasses import dataclass

from heptarm.fri.protocol.protobuf import BYTES, MalformedMessage, fields

MONITORING_ID = 0x245142
COMMAND_ID = 0x34001
MAX_DATAGRAM = 1500


@dataclass(frozen=True, slots=True)
class Traits:
    """Features of a version."""

    io: bool
    quaternions: bool
    framed: bool


class Version(enum.Enum):
    """Wire format of FRI; releases with the same format are one member."""

    V1_11 = "1.11"
    V1_15 = "1.14-1.16"
    V2_5 = "2.5"
    V2_7 = "2.7"

    @property
    def traits(self) -> Traits:
        """Features of this version."""
        return _TRAITS[self]

    @classmethod
    def of(cls, release: str) -> Version:
        """Find the wire format of a release such as "1.15" or "3.0" (KUKA's name for 2.7).

        Raises:
            ValueError: the release is unknown; the text lists the known ones.
        """
        try:
            return _RELEASES[release]
        except KeyError:
            raise ValueError(
                f"the FRI version must be one of {', '.join(_RELEASES)}, got {release!r}"
            ) from None


_TRAITS = {
    Version.V1_11: Traits(io=False, quaternions=False, framed=False),
    Version.V1_15: Traits(io=True, quaternions=False, framed=False),
    Version.V2_5: Traits(io=True, quaternions=True, framed=False),
    Version.V2_7: Traits(io=True, quaternions=True, framed=True),
}

_RELEASES = {
    "1.11": Version.V1_11,
    "1.14": Version.V1_15,
    "1.15": Version.V1_15,
    "1.16": Version.V1_15,
    "2.5": Version.V2_5,
    "2.7": Version.V2_7,
    "3.0": Version.V2_7,
}


def is_framed(datagram: bytes) -> bool:
    """Whether a datagram has length and CRC (2.7) around its message."""
    return len(datagram) >= 8 and int.from_bytes(datagram[:4], "little") == len(datagram) - 8


def wrap(message: bytes, version: Version) -> bytes:
    """Make the datagram of a message; 2.7 adds the length before it and its CRC-32 (IEEE) behind it.

    Raises:
        ValueError: the datagram does not fit into one Ethernet frame.
    """
    if version.traits.framed:
        message = len(message).to_bytes(4, "little") + message + zlib.crc32(message).to_bytes(4, "little")
    if len(message) > MAX_DATAGRAM:
        raise ValueError(
            f"an FRI datagram must have at most {MAX_DATAGRAM} bytes, got {len(message)}: "
            "use fewer or shorter IO names and transformations"
        )
    return message


def unwrap(datagram: bytes, version: Version) -> bytes:
    """Extract the message of a datagram.

    Raises:
        MalformedMessage: framing, CRC or version are wrong; the text names the defect.
    """
    if version.traits.framed:
        if not is_framed(datagram):
            if datagram[:1] == b"\x0a":
                raise MalformedMessage(
                    "the other side speaks FRI 1.x or 2.5 (no length before the message), this side FRI 2.7: "
                    "set the same version on both"
                )
            raise MalformedMessage(
                f"FRI 2.7 datagram of {len(datagram)} bytes: the length before the message is wrong"
            )
        message = datagram[4:-4]
        if zlib.crc32(message) != int.from_bytes(datagram[-4:], "little"):
            raise MalformedMessage("FRI 2.7 datagram: wrong CRC, the datagram was damaged")
        return message
    if is_framed(datagram) or datagram[:1] != b"\x0a":
        if is_framed(datagram):
            raise MalformedMessage(
                f'the other side speaks FRI 2.7 ("3.0"), this side FRI {version.value}: set the same version on both'
            )
        raise MalformedMessage("the datagram is no FRI message: it does not begin with a header")
    return datagram


def recognise(datagram: bytes) -> Version:
    """Recognise the version of a controller from one of its monitoring datagrams.

    2.7 is framed. Monitor data with a commanded joint position (tag 3) is 1.x, any other is 2.5. 1.11 differs from 1.14
    only by the absence of IO, so 1.x is taken for 1.14.

    Raises:
        MalformedMessage: not a monitoring message of any known version.
    """
    if is_framed(datagram):
        unwrap(datagram, Version.V2_7)
        return Version.V2_7
    message = unwrap(datagram, Version.V1_15)
    for tag, kind, value in fields(message):
        if tag == 3 and kind == BYTES and isinstance(value, bytes):
            tags = {inner for inner, _, _ in fields(value)}
            return Version.V1_15 if 3 in tags else Version.V2_5
    raise MalformedMessage("the monitoring message has no monitor data: its version cannot be recognised")


def spoken_version(datagram: bytes) -> Version | None:
    """Version of a legal monitoring message; None for any other datagram."""
    try:
        return recognise(datagram)
    except MalformedMessage:
        return None
