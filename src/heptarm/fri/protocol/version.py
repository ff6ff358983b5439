"""FRI versions: how each frames a datagram, what it can carry, and how to tell them apart from the first datagram."""

from __future__ import annotations

import enum
import zlib
from dataclasses import dataclass

from heptarm.fri.protobuf import BYTES, MalformedMessage, fields

MONITORING_ID = 0x245142
COMMAND_ID = 0x34001
MAX_DATAGRAM = 1500


@dataclass(frozen=True, slots=True)
class Traits:
    """What a version can carry."""

    io: bool
    quaternions: bool
    framed: bool


class Version(enum.Enum):
    """A wire format of FRI; releases that share one are named together."""

    V1_11 = "1.11"
    V1_15 = "1.14-1.16"
    V2_5 = "2.5"
    V2_7 = "2.7"

    @property
    def traits(self) -> Traits:
        """What this version can carry."""
        return _TRAITS[self]

    @classmethod
    def of(cls, release: str) -> Version:
        """The wire format of a release such as "1.15" or "3.0" (KUKA's name for 2.7).

        Raises:
            ValueError: no such release; the text lists the known ones.
        """
        try:
            return _RELEASES[release]
        except KeyError:
            raise ValueError(f"FRI {release!r} is not known; choose one of {', '.join(_RELEASES)}") from None


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
    """Whether a datagram carries length and CRC (2.7) around its message."""
    return len(datagram) >= 8 and int.from_bytes(datagram[:4], "little") == len(datagram) - 8


def wrap(message: bytes, version: Version) -> bytes:
    """The datagram of a message: 2.7 puts the length before it and its CRC-32 (IEEE) behind it.

    Raises:
        ValueError: the datagram would not fit one Ethernet frame.
    """
    if version.traits.framed:
        message = len(message).to_bytes(4, "little") + message + zlib.crc32(message).to_bytes(4, "little")
    if len(message) > MAX_DATAGRAM:
        raise ValueError(
            f"FRI datagram of {len(message)} octets; at most {MAX_DATAGRAM}: "
            "use fewer or shorter IO names and transformations"
        )
    return message


def unwrap(datagram: bytes, version: Version) -> bytes:
    """The message in a datagram.

    Raises:
        MalformedMessage: framing or CRC are wrong, or the datagram is of another version; the text says which.
    """
    if version.traits.framed:
        if not is_framed(datagram):
            if datagram[:1] == b"\x0a":
                raise MalformedMessage(
                    "the other side speaks FRI 1.x or 2.5 (no length before the message), this side FRI 2.7: "
                    "set the same version on both"
                )
            raise MalformedMessage(
                f"FRI 2.7 datagram of {len(datagram)} octets: the length before the message does not fit"
            )
        message = datagram[4:-4]
        if zlib.crc32(message) != int.from_bytes(datagram[-4:], "little"):
            raise MalformedMessage("FRI 2.7 datagram: wrong CRC, it was damaged under way")
        return message
    if is_framed(datagram) or datagram[:1] != b"\x0a":
        if is_framed(datagram):
            raise MalformedMessage(
                f'the other side speaks FRI 2.7 ("3.0"), this side FRI {version.value}: set the same version on both'
            )
        raise MalformedMessage("datagram is no FRI message: it does not begin with a header")
    return datagram


def recognise(datagram: bytes) -> Version:
    """The version of a controller, from one of its monitoring datagrams.

    2.7 is framed; monitor data with a commanded joint position (tag 3) is 1.x, with a Cartesian pose (9, 10) or without
    either is 2.5. 1.11 differs from 1.14 by the absence of IO only, so 1.x is taken as 1.14 unless asked otherwise.

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
    raise MalformedMessage("monitoring message without monitor data: the version cannot be told from it")
