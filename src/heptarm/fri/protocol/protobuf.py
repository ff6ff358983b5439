"""The part of the protobuf wire format that FRI uses: varints, doubles, 32-bit words and length-delimited fields.

Source of the encoding: the public description of the protocol-buffers wire format (proto2). Bytes in, values out.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from heptarm.errors import RemoteProtocolError

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5

_DOUBLE = struct.Struct("<d")

#: A field's value as it stands on the wire: an int (varint, 32 bit) or the octets (64 bit, length-delimited).
Raw = int | bytes


class MalformedMessage(RemoteProtocolError):
    """Octets that are not a legal FRI message; the text says where and why."""


def read_varint(data: bytes, pos: int, end: int) -> tuple[int, int]:
    """Read one varint (at most 64 bit) at `pos`; returns it and the position behind it.

    Raises:
        MalformedMessage: it runs over `end` or is longer than ten octets.
    """
    value = shift = 0
    while pos < end:
        octet = data[pos]
        pos += 1
        value |= (octet & 0x7F) << shift
        if octet < 0x80:
            if value >> 64:
                break
            return value, pos
        shift += 7
        if shift > 63:
            break
    raise MalformedMessage(f"FRI message: varint at octet {pos} is cut or too long")


def varint(value: int) -> bytes:
    """The varint of a non-negative integer."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def fields(data: bytes, pos: int = 0, end: int | None = None) -> Iterator[tuple[int, int, Raw]]:
    """Walk the fields of a message: tag, wire type, value; unknown fields are the caller's to skip.

    Raises:
        MalformedMessage: a field is cut, or its wire type is none that protobuf knows.
    """
    end = len(data) if end is None else end
    while pos < end:
        key, pos = read_varint(data, pos, end)
        tag, kind = key >> 3, key & 7
        if kind == VARINT:
            value, pos = read_varint(data, pos, end)
            yield tag, kind, value
            continue
        if kind == BYTES:
            size, pos = read_varint(data, pos, end)
        elif kind == FIXED64:
            size = 8
        elif kind == FIXED32:
            size = 4
        else:
            raise MalformedMessage(f"FRI message: field {tag} at octet {pos} has wire type {kind}")
        if tag == 0 or pos + size > end:
            raise MalformedMessage(
                f"FRI message: field {tag} at octet {pos} is cut ({size} octets wanted, {end - pos} left)"
            )
        chunk = data[pos : pos + size]
        pos += size
        yield tag, kind, int.from_bytes(chunk, "little") if kind == FIXED32 else chunk


def doubles(
    chunks: list[tuple[int, Raw]], name: str, *, exactly: int | None = None, most: int | None = None
) -> tuple[float, ...]:
    """The doubles of a repeated field, packed or not.

    Args:
        chunks: wire type and value of each occurrence.
        name: of the field, for the error.
        exactly: number of doubles wanted.
        most: largest number allowed.

    Raises:
        MalformedMessage: another number of doubles, or another wire type.
    """
    values: list[float] = []
    for kind, chunk in chunks:
        if not isinstance(chunk, bytes) or kind not in (FIXED64, BYTES) or len(chunk) % 8:
            raise MalformedMessage(f"FRI message: {name} is not made of doubles")
        values.extend(struct.unpack(f"<{len(chunk) // 8}d", chunk))
    if exactly is not None and len(values) != exactly:
        raise MalformedMessage(f"FRI message: {name} has {len(values)} values, exactly {exactly} are legal")
    if most is not None and len(values) > most:
        raise MalformedMessage(f"FRI message: {name} has {len(values)} values, at most {most} are legal")
    return tuple(values)


def key(tag: int, kind: int) -> bytes:
    """The key octets of a field."""
    return varint(tag << 3 | kind)


def put_varint(tag: int, value: int) -> bytes:
    """A varint field."""
    return key(tag, VARINT) + varint(value)


def put_double(tag: int, value: float) -> bytes:
    """A double field."""
    return key(tag, FIXED64) + _DOUBLE.pack(value)


def put_bytes(tag: int, value: bytes) -> bytes:
    """A length-delimited field."""
    return key(tag, BYTES) + varint(len(value)) + value


def put_unpacked(tag: int, values: tuple[float, ...]) -> bytes:
    """A repeated double field, one key per value, as KUKA's joint arrays are written."""
    head = key(tag, FIXED64)
    return b"".join(head + _DOUBLE.pack(value) for value in values)


def put_packed(tag: int, values: tuple[float, ...]) -> bytes:
    """A repeated double field in one run."""
    return put_bytes(tag, struct.pack(f"<{len(values)}d", *values))
