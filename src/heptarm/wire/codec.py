"""What the generated codec stands on: decoding errors, violations, and the checks of ranges."""

from __future__ import annotations

import enum
from math import inf, isnan
from struct import Struct
from typing import Any, TypeVar

E = TypeVar("E", bound=enum.IntEnum)

_U16 = Struct(">H")
_U32 = Struct(">I")

NOT_FINITE, OUT_OF_RANGE, BAD_LENGTH, NOT_NORMALISED = 1, 2, 3, 4


class DecodeError(ValueError):
    """Octets that are not a body of the message that they claim to be."""


class Violation(ValueError):
    """A field outside what the schema allows.

    Attributes:
        code: number in the table of codes.
        parameter: path of the field, such as items[2].motion.q[3].
        value: as text.
        allowed: as text.
    """

    def __init__(self, code: int, parameter: str, value: str, allowed: str) -> None:
        super().__init__(f"{parameter} is {value}; allowed is {allowed}")
        self.code = code
        self.parameter = parameter
        self.value = value
        self.allowed = allowed


def unpack(layout: Struct, data: bytes, pos: int) -> tuple[Any, ...]:
    """Unpack, or say that the body is cut."""
    if pos + layout.size > len(data):
        raise DecodeError(f"body is cut: {layout.size} octets wanted at {pos}, {len(data) - pos} left")
    return layout.unpack_from(data, pos)


def read_bool(value: int) -> bool:
    """A strict boolean."""
    if value > 1:
        raise DecodeError(f"a boolean is {value}; 0 and 1 are legal")
    return value == 1


def read_enum(kind: type[E], value: int) -> E:
    """A known member of an enumeration."""
    try:
        return kind(value)
    except ValueError:
        raise DecodeError(f"{kind.__name__} is {value}; legal are {[int(v) for v in kind]}") from None


def read_flag(data: bytes, pos: int) -> tuple[bool, int]:
    """A strict presence octet."""
    if pos >= len(data):
        raise DecodeError(f"body is cut at {pos}")
    return read_bool(data[pos]), pos + 1


def read_count(data: bytes, pos: int) -> tuple[int, int]:
    """Number of entries of a list."""
    return unpack(_U16, data, pos)[0], pos + 2


def read_tag(data: bytes, pos: int) -> tuple[int, int]:
    """Tag of a union."""
    if pos >= len(data):
        raise DecodeError(f"body is cut at {pos}")
    return data[pos], pos + 1


def read_bytes(data: bytes, pos: int) -> tuple[bytes, int]:
    """Octets with their length before them."""
    size = unpack(_U32, data, pos)[0]
    pos += 4
    if pos + size > len(data):
        raise DecodeError(f"body is cut: {size} octets wanted at {pos}, {len(data) - pos} left")
    return bytes(data[pos : pos + size]), pos + size


def read_str(data: bytes, pos: int) -> tuple[str, int]:
    """UTF-8 text with its length before it."""
    size = unpack(_U16, data, pos)[0]
    pos += 2
    if pos + size > len(data):
        raise DecodeError(f"body is cut: {size} octets wanted at {pos}, {len(data) - pos} left")
    try:
        return bytes(data[pos : pos + size]).decode(), pos + size
    except UnicodeDecodeError:
        raise DecodeError(f"a text at {pos} is not UTF-8") from None


def put_str(value: str) -> bytes:
    """UTF-8 text with its length before it; longer ones than a u16 can count are cut at a character."""
    octets = value.encode()
    if len(octets) > 65535:
        octets = octets[:65535].decode(errors="ignore").encode()
    return _U16.pack(len(octets)) + octets


def put_bytes(value: bytes) -> bytes:
    """Octets with their length before them."""
    return _U32.pack(len(value)) + value


def put_count(size: int) -> bytes:
    """Number of entries of a list."""
    if size > 65535:
        raise ValueError(f"a list has {size} entries; the protocol carries 65535")
    return _U16.pack(size)


def end(data: bytes, pos: int, name: str) -> None:
    """The body must end here."""
    if pos != len(data):
        raise DecodeError(f"{name}: {len(data) - pos} octets behind its end")


def check(value: float, path: str, low: float, high: float, low_open: bool, nan: bool) -> None:
    """A number is finite and within its range.

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
    """Every number of an array is finite and within its range."""
    for index, value in enumerate(values):
        check(value, f"{path}[{index}]", low, high, low_open, nan)


def check_norm(values: tuple[float, ...], path: str) -> None:
    """A quaternion has unit norm within 1e-6."""
    norm = sum(value * value for value in values) ** 0.5
    if abs(norm - 1.0) > 1e-6:
        raise Violation(NOT_NORMALISED, path, f"of norm {norm:g}", "norm 1")


def check_length(size: int, path: str, low: int, high: int) -> None:
    """A text or a list has a legal length."""
    if not low <= size <= high:
        raise Violation(BAD_LENGTH, path, f"{size} long", f"{low} to {high} long")
