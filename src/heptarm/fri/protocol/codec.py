"""The controller's side of the FRI messages, for all versions: it writes monitoring messages and reads commands.

Encoding writes the same bytes as KUKA's controllers, decoding is strict. The client's side is native/fri_message.c.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import TypeVar

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import JOINTS, MAX_IO, MAX_NAME, MAX_TRANSFORMATIONS
from heptarm.fri.protocol.protobuf import (
    BYTES,
    FIXED64,
    VARINT,
    MalformedMessage,
    Raw,
    doubles,
    fields,
    put_bytes,
    put_double,
    put_packed,
    put_unpacked,
    put_varint,
)
from heptarm.fri.protocol.version import COMMAND_ID, MONITORING_ID, Version, unwrap, wrap

_T = TypeVar("_T")


def _put(tag: int, body: bytes | None) -> bytes:
    return b"" if body is None else put_bytes(tag, body)


def _put_int(tag: int, value: int | None) -> bytes:
    return b"" if value is None else put_varint(tag, int(value))


def _put_joints(tag: int, values: m.Joints | None) -> bytes:
    if values is None:
        return b""
    if len(values) != JOINTS:
        raise ValueError(f"a joint array must have {JOINTS} values, got {len(values)}")
    return put_bytes(tag, put_unpacked(1, values))


def _put_name(name: str) -> bytes:
    if len(name) > MAX_NAME:  # as in decoding: what a controller sends can be sent back
        raise ValueError(f"a name must have at most {MAX_NAME} characters, got {len(name)}: {name!r}")
    return put_bytes(1, name.encode())


def _put_stamp(tag: int, stamp: m.TimeStamp | None) -> bytes:
    return (
        b""
        if stamp is None
        else put_bytes(tag, put_varint(1, stamp.seconds) + put_varint(2, stamp.nanoseconds))
    )


def _put_transformation(tag: int, value: m.Transformation | None) -> bytes:
    if value is None:
        return b""
    values = put_packed(2, value.values) if value.values else b""
    return put_bytes(tag, _put_name(value.name) + values + _put_stamp(3, value.stamp))


def _put_redundancy(tag: int, value: m.Redundancy | None) -> bytes:
    return (
        b"" if value is None else put_bytes(tag, put_varint(1, value.strategy) + put_double(2, value.value))
    )


def _put_io(tag: int, value: m.IoValue) -> bytes:
    content = (
        put_double(5, float(value.value))
        if value.type is m.IoType.ANALOG
        else put_varint(4, int(value.value))
    )
    return put_bytes(
        tag, _put_name(value.name) + put_varint(2, value.type) + put_varint(3, value.direction) + content
    )


def _put_header(header: m.Header, message_id: int) -> bytes:
    return put_bytes(
        1, put_varint(1, message_id) + put_varint(2, header.sequence) + put_varint(3, header.reflected)
    )


def _few(values: tuple[_T, ...], most: int, name: str) -> tuple[_T, ...]:
    if len(values) > most:
        raise ValueError(f"a message must have at most {most} {name}, got {len(values)}")
    return values


def _join(values: tuple[_T, ...], put: Callable[[_T], bytes]) -> bytes:
    return b"".join(put(value) for value in values)


def _refuse(condition: object, what: str, version: Version) -> None:
    if condition:
        raise ValueError(f"FRI {version.value} cannot carry {what}")


def encode_monitoring(message: m.Monitoring, version: Version) -> bytes:
    """Encode a monitoring message, byte for byte as a controller of this version does.

    Raises:
        ValueError: the version cannot carry a field, or a name or list is too long.
    """
    traits = version.traits
    parts = [_put_header(message.header, MONITORING_ID)]
    if (robot := message.robot) is not None:
        drives = _join(robot.drives, lambda drive: put_varint(5, drive))
        parts.append(
            put_bytes(
                2,
                _put_int(1, robot.joints)
                + _put_int(2, robot.safety)
                + drives
                + _put_int(6, robot.operation_mode)
                + _put_int(7, robot.control_mode),
            )
        )
    if (data := message.monitor) is not None:
        _refuse(data.io and not traits.io, "IO", version)
        _refuse(data.q_cmd is not None and traits.quaternions, "a commanded joint position", version)
        _refuse((data.pose or data.redundancy) and not traits.quaternions, "a Cartesian pose", version)
        _refuse(data.wrench is not None and not traits.framed, "an external force", version)
        body = b"".join(_put_joints(tag, getattr(data, name)) for name, (tag, _) in m.MONITORED.items())
        body += _put(6, None if data.wrench is None else put_packed(1, data.wrench))
        body += _join(_few(data.io, MAX_IO, "IO values"), lambda value: _put_io(8, value))
        body += (
            _put_transformation(9, data.pose)
            + _put_redundancy(10, data.redundancy)
            + _put_stamp(15, data.stamp)
        )
        parts.append(put_bytes(3, body))
    if (link := message.connection) is not None:
        parts.append(
            put_bytes(
                4,
                put_varint(1, link.state)
                + put_varint(2, link.quality)
                + _put_int(3, link.period_ms)
                + _put_int(4, link.multiplier),
            )
        )
    if (ipo := message.ipo) is not None:
        _refuse((ipo.pose or ipo.redundancy) and not traits.quaternions, "a Cartesian pose", version)
        body = _put_joints(1, ipo.q) + _put_transformation(2, ipo.pose) + _put_redundancy(3, ipo.redundancy)
        body += _put_int(10, ipo.command_mode) + _put_int(11, ipo.overlay)
        body += b"" if ipo.tracking is None else put_double(12, ipo.tracking)
        parts.append(put_bytes(5, body))
    parts.append(
        _join(
            _few(message.requested, MAX_TRANSFORMATIONS, "transformations"),
            lambda value: _put_transformation(6, value),
        )
    )
    return wrap(b"".join(parts), version)


_E = TypeVar("_E", bound=enum.IntEnum)
_Collected = dict[int, list[tuple[int, Raw]]]


def _collect(data: bytes) -> _Collected:
    found: _Collected = {}
    for tag, kind, value in fields(data):
        found.setdefault(tag, []).append((kind, value))
    return found


def _last(found: _Collected, tag: int, kind: int, name: str) -> Raw | None:
    """Get the last occurrence of a field, as proto2 requires; None if absent."""
    if tag not in found:
        return None
    seen, value = found[tag][-1]
    if seen != kind:
        raise MalformedMessage(f"FRI message: the wire type of {name} must be {kind}, got {seen}")
    return value


def _integer(found: _Collected, tag: int, name: str) -> int | None:
    value = _last(found, tag, VARINT, name)
    return None if value is None else int.from_bytes(value, "little") if isinstance(value, bytes) else value


def _word(found: _Collected, tag: int, name: str) -> int | None:
    """Get an integer of 32 bits."""
    value = _integer(found, tag, name)
    if value is not None and value >> 32:
        raise MalformedMessage(f"FRI message: {name} must be below 2**32, got {value}")
    return value


def _needed(value: int | None, name: str) -> int:
    if value is None:
        raise MalformedMessage(f"FRI message: {name} is missing")
    return value


def _member(found: _Collected, tag: int, kind: type[_E], name: str) -> _E | None:
    value = _integer(found, tag, name)
    if value is None:
        return None
    try:
        return kind(value)
    except ValueError:
        raise MalformedMessage(
            f"FRI message: {name} must be one of {', '.join(str(int(v)) for v in kind)}, got {value}"
        ) from None


def _sub(found: _Collected, tag: int, name: str) -> _Collected | None:
    value = _last(found, tag, BYTES, name)
    return _collect(value) if isinstance(value, bytes) else None


def _subs(found: _Collected, tag: int, name: str, most: int) -> list[_Collected]:
    chunks = found.get(tag, [])
    if len(chunks) > most:
        raise MalformedMessage(f"FRI message: there must be at most {most} {name}, got {len(chunks)}")
    for kind, value in chunks:
        if kind != BYTES or not isinstance(value, bytes):
            raise MalformedMessage(f"FRI message: the wire type of {name} must be {BYTES}, got {kind}")
    return [_collect(value) for _, value in chunks if isinstance(value, bytes)]


def _joints(found: _Collected, tag: int, name: str) -> m.Joints | None:
    sub = _sub(found, tag, name)
    return None if sub is None else doubles(sub.get(1, []), name, exactly=JOINTS)


def _double(found: _Collected, tag: int, name: str) -> float | None:
    value = _last(found, tag, FIXED64, name)
    return doubles([(FIXED64, value)], name)[0] if value is not None else None


def _name(found: _Collected) -> str:
    value = _last(found, 1, BYTES, "a name")
    if not isinstance(value, bytes):
        raise MalformedMessage("FRI message: a name is missing")
    try:
        name = value.decode()
    except UnicodeDecodeError:
        raise MalformedMessage("FRI message: a name is not UTF-8") from None
    if len(name) > MAX_NAME:
        raise MalformedMessage(
            f"FRI message: a name must have at most {MAX_NAME} characters, got {len(name)}: {name[:20]!r}…"
        )
    return name


def _stamp(found: _Collected, tag: int) -> m.TimeStamp | None:
    sub = _sub(found, tag, "a time stamp")
    if sub is None:
        return None
    return m.TimeStamp(
        _needed(_word(sub, 1, "seconds"), "seconds"),
        _needed(_word(sub, 2, "nanoseconds"), "nanoseconds"),
    )


def _transformation(found: _Collected, *, quaternion: bool) -> m.Transformation:
    size = 7 if quaternion else 12
    return m.Transformation(
        _name(found), doubles(found.get(2, []), "a transformation", exactly=size), _stamp(found, 3)
    )


def _redundancy(found: _Collected, tag: int) -> m.Redundancy | None:
    sub = _sub(found, tag, "redundancy")
    if sub is None:
        return None
    strategy, value = (
        _member(sub, 1, m.RedundancyStrategy, "redundancy strategy"),
        _double(sub, 2, "redundancy value"),
    )
    if strategy is None or value is None:
        raise MalformedMessage("FRI message: redundancy is incomplete")
    return m.Redundancy(strategy, value)


def _io(found: _Collected) -> m.IoValue:
    kind, direction = _member(found, 2, m.IoType, "IO type"), _member(found, 3, m.IoDirection, "IO direction")
    if kind is None or direction is None:
        raise MalformedMessage("FRI message: an IO value has no type or no direction")
    value: int | float | None
    value = (
        _double(found, 5, "an analog value")
        if kind is m.IoType.ANALOG
        else _integer(found, 4, "a digital value")
    )
    return m.IoValue(_name(found), kind, direction, 0 if value is None else value)


def _header(found: _Collected, expected: int) -> m.Header:
    sub = _sub(found, 1, "header")
    if sub is None:
        raise MalformedMessage("FRI message: no header")
    seen = _word(sub, 1, "message id")
    if seen != expected:
        raise MalformedMessage(f"FRI message: the id must be {expected}, got {seen}")
    return m.Header(
        _needed(_word(sub, 2, "sequence"), "sequence"), _needed(_word(sub, 3, "reflected"), "reflected")
    )


def decode_command(datagram: bytes, version: Version) -> m.Command:
    """Decode a datagram of the client.

    Raises:
        MalformedMessage: it is not a legal command message of this version; the text names the cause.
    """
    found = _collect(unwrap(datagram, version))
    header = _header(found, COMMAND_ID)
    data = _sub(found, 2, "command data")
    if data is None:
        return m.Command(header)
    quaternion = version.traits.quaternions
    wrench, pose = _sub(data, 2, "wrench"), _sub(data, 6, "pose")
    return m.Command(
        header=header,
        q=_joints(data, 1, "commanded position"),
        wrench=None if wrench is None else doubles(wrench.get(1, []), "wrench", exactly=6),
        tau=_joints(data, 3, "commanded torque"),
        transformations=tuple(
            _transformation(part, quaternion=quaternion)
            for part in _subs(data, 4, "transformations", MAX_TRANSFORMATIONS)
        ),
        io=tuple(_io(part) for part in _subs(data, 5, "IO values", MAX_IO)),
        pose=None if pose is None else _transformation(pose, quaternion=True),
        redundancy=_redundancy(data, 7),
    )
