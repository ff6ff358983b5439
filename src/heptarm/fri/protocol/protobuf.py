"""Part of the protobuf wire format that FRI uses: varints, doubles, 32-bit words and length-delimited fields.

After the public description of the protocol-buffers wire format (proto2).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from heptarm.errors import RemoteProtocolError

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5

_DOUBLE = struct.Struct("<d")

#: Value of a field on the wire: an int (varint, 32 bit) or bytes (64 bit, length-delimited).
Raw = int | bytes


class MalformedMessage(RemoteProtocolError):
    """The bytes are not a legal FRI message; the text names the place and the cause."""


def read_varint(data: bytes, pos: int, end: int) -> tuple[int, int]:
    """Read a varint (at most 64 bit) at `pos`; return it and the position behind it.

    Raises:
        MalformedMessage: it extends beyond `end` or is longer than ten bytes.
    """
    value = shift = 0
    while pos < end:
        byte = data[pos]
        pos += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            if value >> 64:
                break
            return value, pos
        shift += 7
        if shift > 63:
            break
    raise MalformedMessage(f"FRI message: the varint that ends at byte {pos} is incomplete or too long")


def varint(value: int) -> bytes:
    """Encode a non-negative integer as a varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def fields(data: bytes, pos: int = 0, end: int | None = None) -> Iterator[tuple[int, int, Raw]]:
    """Iterate over the fields of a message: tag, wire type, value; the caller skips unknown fields.

    Raises:
        MalformedMessage: a field is incomplete, or its wire type is unknown.
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
            raise MalformedMessage(f"FRI message: field {tag} at byte {pos} has the unknown wire type {kind}")
        if tag == 0 or pos + size > end:
            raise MalformedMessage(
                f"FRI message: field {tag} at byte {pos} is incomplete ({size} bytes expected, {end - pos} left)"
            )
        chunk = data[pos : pos + size]
        pos += size
        yield tag, kind, int.from_bytes(chunk, "little") if kind == FIXED32 else chunk


def doubles(
    chunks: list[tuple[int, Raw]], name: str, *, exactly: int | None = None, most: int | None = None
) -> tuple[float, ...]:
    """Decode the doubles of a repeated field, packed or not.

    Args:
        chunks: wire type and value of each occurrence.
        name: of the field, for the error.
        exactly: required number of doubles.
        most: largest number allowed.

    Raises:
        MalformedMessage: another number of doubles, or another wire type.
    """
    values: list[float] = []
    for kind, chunk in chunks:
        if not isinstance(chunk, bytes) or kind not in (FIXED64, BYTES) or len(chunk) % 8:
            raise MalformedMessage(f"FRI message: {name} must consist of doubles")
        values.extend(struct.unpack(f"<{len(chunk) // 8}d", chunk))
    if exactly is not None and len(values) != exactly:
        raise MalformedMessage(f"FRI message: {name} must have {exactly} values, got {len(values)}")
    if most is not None and len(values) > most:
        raise MalformedMessage(f"FRI message: {name} must have at most {most} values, got {len(values)}")
    return tuple(values)


def key(tag: int, kind: int) -> bytes:
    """Encode the key of a field."""
    return varint(tag << 3 | kind)


def put_varint(tag: int, value: int) -> bytes:
    """Encode a varint field."""
    return key(tag, VARINT) + varint(value)


def put_double(tag: int, value: float) -> bytes:
    """Encode a double field."""
    return key(tag, FIXED64) + _DOUBLE.pack(value)


def put_bytes(tag: int, value: bytes) -> bytes:
    """Encode a length-delimited field."""
    return key(tag, BYTES) + varint(len(value)) + value


def put_unpacked(tag: int, values: tuple[float, ...]) -> bytes:
    """Encode a repeated double field with one key per value, as in KUKA's joint arrays."""
    head = key(tag, FIXED64)
    return b"".join(head + _DOUBLE.pack(value) for value in values)


def put_packed(tag: int, values: tuple[float, ...]) -> bytes:
    """Encode a packed repeated double field."""
    return put_bytes(tag, struct.pack(f"<{len(values)}d", *values))
