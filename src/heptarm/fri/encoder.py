"""Encoding of FRI messages, octet for octet as KUKA's sides write them. The hot path has its own in `fri.template`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from heptarm.fri import messages as m
from heptarm.fri.messages import JOINTS, MAX_IO, MAX_NAME, MAX_TRANSFORMATIONS
from heptarm.fri.protobuf import put_bytes, put_double, put_packed, put_unpacked, put_varint
from heptarm.fri.version import COMMAND_ID, MONITORING_ID, Version, wrap

_T = TypeVar("_T")


def _put(tag: int, body: bytes | None) -> bytes:
    return b"" if body is None else put_bytes(tag, body)


def _put_int(tag: int, value: int | None) -> bytes:
    return b"" if value is None else put_varint(tag, int(value))


def _put_joints(tag: int, values: m.Joints | None) -> bytes:
    if values is None:
        return b""
    if len(values) != JOINTS:
        raise ValueError(f"a joint array has {len(values)} values, FRI wants exactly {JOINTS}")
    return put_bytes(tag, put_unpacked(1, values))


def _put_name(name: str) -> bytes:
    if not 0 < len(name.encode()) <= MAX_NAME:
        raise ValueError(f"the name {name!r} has {len(name.encode())} octets, FRI allows 1 to {MAX_NAME}")
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
        raise ValueError(f"{len(values)} {name}; FRI carries at most {most} in a message")
    return values


def _join(values: tuple[_T, ...], put: Callable[[_T], bytes]) -> bytes:
    return b"".join(put(value) for value in values)


def _refuse(condition: object, what: str, version: Version) -> None:
    if condition:
        raise ValueError(f"FRI {version.value} cannot carry {what}")


def encode_monitoring(message: m.Monitoring, version: Version) -> bytes:
    """The datagram of a monitoring message, byte for byte as a controller of this version writes it.

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
        joints = zip((1, 2, 3, 4, 5), (data.q, data.tau, data.q_cmd, data.tau_cmd, data.tau_ext), strict=True)
        body = b"".join(_put_joints(tag, values) for tag, values in joints)
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


def encode_command(message: m.Command, version: Version) -> bytes:
    """The datagram of a command message, byte for byte as a client of this version writes it.

    Raises:
        ValueError: the version cannot carry a field, or a name, list or joint array has the wrong length.
    """
    traits = version.traits
    _refuse(message.io and not traits.io, "IO", version)
    _refuse((message.pose or message.redundancy) and not traits.quaternions, "a Cartesian pose", version)
    if message.wrench is not None and len(message.wrench) != 6:
        raise ValueError(f"a wrench has {len(message.wrench)} values, FRI wants 6")
    body = (
        _put_joints(1, message.q)
        + _put(2, None if message.wrench is None else put_packed(1, message.wrench))
        + _put_joints(3, message.tau)
    )
    body += _join(
        _few(message.transformations, MAX_TRANSFORMATIONS, "transformations"),
        lambda value: _put_transformation(4, value),
    )
    body += _join(_few(message.io, MAX_IO, "IO values"), lambda value: _put_io(5, value))
    body += _put_transformation(6, message.pose) + _put_redundancy(7, message.redundancy)
    header = _put_header(message.header, COMMAND_ID)
    return wrap(header + (put_bytes(2, body) if body else b""), version)
