"""Functions and errors that the generated codec uses to read, write and check values."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import fields
from math import inf, isnan
from struct import Struct
from typing import Any, TypeVar

from heptarm.errors import ShapeError

E = TypeVar("E", bound=enum.IntEnum)

_U16 = Struct(">H")
_U32 = Struct(">I")

NOT_FINITE, OUT_OF_RANGE, BAD_LENGTH, NOT_NORMALISED = 1, 2, 3, 4


class DecodeError(ValueError):
    """The bytes are not a legal body of their message."""


class Violation(ValueError):
    """A field is outside the range of the schema.

    Attributes:
        code: error code.
        parameter: path of the field, such as items[2].motion.q[3].
        value: the value, as text.
        allowed: the range, as text.
    """

    def __init__(self, code: int, parameter: str, value: str, allowed: str) -> None:
        super().__init__(f"{parameter} is {value}; allowed is {allowed}")
        self.code = code
        self.parameter = parameter
        self.value = value
        self.allowed = allowed


def unpack(layout: Struct, data: bytes, pos: int) -> tuple[Any, ...]:
    """Unpack a layout at a position; refuse a body that is too short."""
    if pos + layout.size > len(data):
        raise DecodeError(f"body is too short: {layout.size} bytes expected at {pos}, {len(data) - pos} left")
    return layout.unpack_from(data, pos)


def refuse_size(layout: Struct, data: bytes, name: str) -> None:
    """Raise DecodeError for a body that is one layout, and has another size."""
    unpack(layout, data, 0)
    end(data, layout.size, name)


def read_bool(value: int) -> bool:
    """Read a boolean: 0 or 1."""
    if value > 1:
        raise DecodeError(f"a boolean must be 0 or 1, got {value}")
    return value == 1


def read_enum(kind: type[E], value: int) -> E:
    """Read a member of an enumeration."""
    try:
        return kind(value)
    except ValueError:
        raise DecodeError(f"{kind.__name__} must be one of {[int(v) for v in kind]}, got {value}") from None


def read_flag(data: bytes, pos: int) -> tuple[bool, int]:
    """Read the byte that marks an optional value as present: 0 or 1."""
    if pos >= len(data):
        raise DecodeError(f"body is too short: 1 byte expected at {pos}, 0 left")
    return read_bool(data[pos]), pos + 1


def read_count(data: bytes, pos: int) -> tuple[int, int]:
    """Read the number of entries of a list."""
    return unpack(_U16, data, pos)[0], pos + 2


def read_tag(data: bytes, pos: int) -> tuple[int, int]:
    """Read the tag of a union."""
    if pos >= len(data):
        raise DecodeError(f"body is too short: 1 byte expected at {pos}, 0 left")
    return data[pos], pos + 1


def read_bytes(data: bytes, pos: int) -> tuple[bytes, int]:
    """Read bytes that follow their length."""
    size = unpack(_U32, data, pos)[0]
    pos += 4
    if pos + size > len(data):
        raise DecodeError(f"body is too short: {size} bytes expected at {pos}, {len(data) - pos} left")
    return bytes(data[pos : pos + size]), pos + size


def read_str(data: bytes, pos: int) -> tuple[str, int]:
    """Read UTF-8 text that follows its length."""
    size = unpack(_U16, data, pos)[0]
    pos += 2
    if pos + size > len(data):
        raise DecodeError(f"body is too short: {size} bytes expected at {pos}, {len(data) - pos} left")
    try:
        return bytes(data[pos : pos + size]).decode(), pos + size
    except UnicodeDecodeError:
        raise DecodeError(f"the text at {pos} is not UTF-8") from None


def put_str(value: str) -> bytes:
    """Write UTF-8 text after its length; cut it at a character if it exceeds 65535 bytes.

    Raises:
        ShapeError: it has half of a surrogate pair, which UTF-8 cannot carry.
    """
    try:
        encoded = value.encode()
    except UnicodeEncodeError:
        raise ShapeError(
            f"a text that is sent must have printable characters only, got {value[:100]!a}", value=value
        ) from None
    if len(encoded) > 65535:
        encoded = encoded[:65535].decode(errors="ignore").encode()
    return _U16.pack(len(encoded)) + encoded


def put_bytes(value: bytes) -> bytes:
    """Write bytes after their length."""
    return _U32.pack(len(value)) + value


def put_count(size: int) -> bytes:
    """Write the number of entries of a list."""
    if size > 65535:
        raise ValueError(f"a list must have at most 65535 entries, got {size}")
    return _U16.pack(size)


def setters(kind: type) -> tuple[Callable[[Any, Any], None], ...]:
    """What writes the slots of a frozen dataclass, in the order of its fields; for its constructor."""
    return tuple(getattr(kind, field.name).__set__ for field in fields(kind))


def end(data: bytes, pos: int, name: str) -> None:
    """Check that the body ends here."""
    if pos != len(data):
        raise DecodeError(f"{name}: {len(data) - pos} bytes behind its end")


def check(value: float, path: str, low: float, high: float, low_open: bool, nan: bool) -> None:
    """Check that a number is finite and within its range.

    Raises:
        Violation: it is not.
    """
    if isnan(value):
        if not nan:
            raise Violation(NOT_FINITE, path, "NaN", "a finite number")
        return
    if value in (inf, -inf):
        raise Violation(NOT_FINITE, path, str(value), "a finite number")
    if not (low < value if low_open else low <= value) or value > high:
        raise Violation(OUT_OF_RANGE, path, f"{value:g}", f"{'(' if low_open else '['}{low:g}, {high:g}]")


def check_array(
    values: tuple[float, ...], path: str, low: float, high: float, low_open: bool, nan: bool
) -> None:
    """Check that every number of an array is finite and within its range."""
    for index, value in enumerate(values):
        check(value, f"{path}[{index}]", low, high, low_open, nan)


def check_norm(values: tuple[float, ...], path: str) -> None:
    """Check that a quaternion has unit norm within 1e-6."""
    norm = sum(value * value for value in values) ** 0.5
    if abs(norm - 1.0) > 1e-6:
        raise Violation(NOT_NORMALISED, path, f"of norm {norm:g}", "norm 1")


def check_length(size: int, path: str, low: int, high: int) -> None:
    """Check the length of a text or a list."""
    if not low <= size <= high:
        raise Violation(BAD_LENGTH, path, f"{size} long", f"{low} to {high} long")
