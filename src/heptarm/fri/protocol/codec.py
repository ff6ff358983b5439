"""Strict decoding of FRI messages, one table-driven walk for all versions.

Strict means: the message id is right, joint arrays have exactly 7 doubles, enumerations have known values,
names fit 63 characters, at most 10 signals and 5 transformations. Packed and unpacked doubles are both read;
unknown fields are skipped. The hot path has its own reader in `heptarm.fri.template`.
"""

from __future__ import annotations

import enum
from typing import TypeVar

from heptarm.fri import messages as m
from heptarm.fri.messages import JOINTS, MAX_IO, MAX_NAME, MAX_TRANSFORMATIONS
from heptarm.fri.protobuf import BYTES, FIXED64, VARINT, MalformedMessage, Raw, doubles, fields
from heptarm.fri.version import COMMAND_ID, MONITORING_ID, Version, unwrap

_E = TypeVar("_E", bound=enum.IntEnum)
_Collected = dict[int, list[tuple[int, Raw]]]


def _collect(data: bytes) -> _Collected:
    found: _Collected = {}
    for tag, kind, value in fields(data):
        found.setdefault(tag, []).append((kind, value))
    return found


def _last(found: _Collected, tag: int, kind: int, name: str) -> Raw | None:
    """The last occurrence of a field, as proto2 says; None if absent."""
    if tag not in found:
        return None
    seen, value = found[tag][-1]
    if seen != kind:
        raise MalformedMessage(f"FRI message: {name} has wire type {seen}, {kind} is legal")
    return value


def _integer(found: _Collected, tag: int, name: str) -> int | None:
    value = _last(found, tag, VARINT, name)
    return None if value is None else int.from_bytes(value, "little") if isinstance(value, bytes) else value


def _word(found: _Collected, tag: int, name: str) -> int | None:
    """An integer of 32 bits."""
    value = _integer(found, tag, name)
    if value is not None and value >> 32:
        raise MalformedMessage(f"FRI message: {name} is {value}, which is more than 32 bits hold")
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
            f"FRI message: {name} is {value}; legal are {', '.join(str(int(v)) for v in kind)}"
        ) from None


def _sub(found: _Collected, tag: int, name: str) -> _Collected | None:
    value = _last(found, tag, BYTES, name)
    return _collect(value) if isinstance(value, bytes) else None


def _subs(found: _Collected, tag: int, name: str, most: int) -> list[_Collected]:
    chunks = found.get(tag, [])
    if len(chunks) > most:
        raise MalformedMessage(f"FRI message: {len(chunks)} {name}, at most {most} are legal")
    for kind, value in chunks:
        if kind != BYTES or not isinstance(value, bytes):
            raise MalformedMessage(f"FRI message: {name} has wire type {kind}")
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
            f"FRI message: the name {name[:20]!r}… has {len(name)} characters, at most {MAX_NAME} are legal"
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


def _wanted(found: _Collected, *, quaternion: bool) -> m.Transformation:
    """A requested transformation: its values may be absent."""
    size = 7 if quaternion else 12
    return m.Transformation(
        _name(found), doubles(found.get(2, []), "a transformation", most=size), _stamp(found, 3)
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


def _header(found: _Collected, wanted: int) -> m.Header:
    sub = _sub(found, 1, "header")
    if sub is None:
        raise MalformedMessage("FRI message: no header")
    seen = _word(sub, 1, "message id")
    if seen != wanted:
        raise MalformedMessage(f"FRI message: id is {seen}, {wanted} is legal here")
    return m.Header(
        _needed(_word(sub, 2, "sequence"), "sequence"), _needed(_word(sub, 3, "reflected"), "reflected")
    )


def _robot(sub: _Collected) -> m.RobotInfo:
    drives: list[m.DriveState] = []
    for kind, value in sub.get(5, []):
        octets = value if isinstance(value, bytes) else bytes([value & 0xFF])
        if kind not in (VARINT, BYTES) or any(octet > max(m.DriveState) for octet in octets):
            raise MalformedMessage("FRI message: unknown drive state")
        drives.extend(m.DriveState(octet) for octet in octets)
    return m.RobotInfo(
        joints=_integer(sub, 1, "number of joints"),
        safety=_member(sub, 2, m.Safety, "safety state"),
        drives=tuple(drives),
        operation_mode=_member(sub, 6, m.OperationMode, "operation mode"),
        control_mode=_member(sub, 7, m.ControlMode, "control mode"),
    )


def _monitor(sub: _Collected) -> m.MonitorData:
    pose = _sub(sub, 9, "measured pose")
    wrench = _sub(sub, 6, "external force")
    return m.MonitorData(
        q=_joints(sub, 1, "measured position"),
        tau=_joints(sub, 2, "measured torque"),
        q_cmd=_joints(sub, 3, "commanded position"),
        tau_cmd=_joints(sub, 4, "commanded torque"),
        tau_ext=_joints(sub, 5, "external torque"),
        wrench=None if wrench is None else doubles(wrench.get(1, []), "external force", exactly=6),
        io=tuple(_io(one) for one in _subs(sub, 8, "IO values", MAX_IO)),
        pose=None if pose is None else _transformation(pose, quaternion=True),
        redundancy=_redundancy(sub, 10),
        stamp=_stamp(sub, 15),
    )


def _ipo(sub: _Collected) -> m.IpoData:
    pose = _sub(sub, 2, "interpolated pose")
    return m.IpoData(
        q=_joints(sub, 1, "interpolated position"),
        pose=None if pose is None else _transformation(pose, quaternion=True),
        redundancy=_redundancy(sub, 3),
        command_mode=_member(sub, 10, m.CommandMode, "command mode"),
        overlay=_member(sub, 11, m.Overlay, "overlay type"),
        tracking=_double(sub, 12, "tracking performance"),
    )


def _connection(sub: _Collected) -> m.ConnectionInfo:
    state, quality = _member(sub, 1, m.SessionState, "session state"), _member(sub, 2, m.Quality, "quality")
    if state is None or quality is None:
        raise MalformedMessage("FRI message: session state or quality is missing")
    return m.ConnectionInfo(state, quality, _word(sub, 3, "send period"), _word(sub, 4, "receive multiplier"))


def decode_monitoring(datagram: bytes, version: Version) -> m.Monitoring:
    """Decode a controller's datagram.

    Raises:
        MalformedMessage: it is not a legal monitoring message of this version; the text says why.
    """
    found = _collect(unwrap(datagram, version))
    robot, monitor, connection, ipo = (
        _sub(found, tag, name)
        for tag, name in ((2, "robot info"), (3, "monitor data"), (4, "connection info"), (5, "ipo data"))
    )
    quaternion = version.traits.quaternions
    return m.Monitoring(
        header=_header(found, MONITORING_ID),
        robot=None if robot is None else _robot(robot),
        monitor=None if monitor is None else _monitor(monitor),
        connection=None if connection is None else _connection(connection),
        ipo=None if ipo is None else _ipo(ipo),
        requested=tuple(
            _wanted(one, quaternion=quaternion)
            for one in _subs(found, 6, "transformations", MAX_TRANSFORMATIONS)
        ),
    )


def decode_command(datagram: bytes, version: Version) -> m.Command:
    """Decode a client's datagram.

    Raises:
        MalformedMessage: it is not a legal command message of this version; the text says why.
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
            _transformation(one, quaternion=quaternion)
            for one in _subs(data, 4, "transformations", MAX_TRANSFORMATIONS)
        ),
        io=tuple(_io(one) for one in _subs(data, 5, "IO values", MAX_IO)),
        pose=None if pose is None else _transformation(pose, quaternion=True),
        redundancy=_redundancy(data, 7),
    )
