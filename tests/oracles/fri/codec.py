"""The client's side of the FRI messages, in Python: what native/fri_message.c has to do. Decoding is strict."""

from __future__ import annotations

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import *  # noqa: F403
from heptarm.fri.protocol.codec import (
    _collect,
    _Collected,
    _double,
    _few,
    _header,
    _integer,
    _io,
    _join,
    _joints,
    _member,
    _name,
    _put,
    _put_header,
    _put_io,
    _put_joints,
    _put_redundancy,
    _put_transformation,
    _redundancy,
    _refuse,
    _stamp,
    _sub,
    _subs,
    _transformation,
    _word,
    decode_command,
    encode_monitoring,
)
from heptarm.fri.protocol.messages import MAX_IO, MAX_TRANSFORMATIONS
from heptarm.fri.protocol.protobuf import BYTES, VARINT, MalformedMessage, doubles, put_bytes, put_packed
from heptarm.fri.protocol.version import COMMAND_ID, MONITORING_ID, Version, unwrap, wrap

__all__ = ["decode_command", "decode_monitoring", "encode_command", "encode_monitoring"]


def encode_command(message: m.Command, version: Version) -> bytes:
    """Encode a command message, byte for byte as a client of this version does.

    Raises:
        ValueError: the version cannot carry a field, or a name, list or joint array has the wrong length.
    """
    traits = version.traits
    _refuse(message.io and not traits.io, "IO", version)
    _refuse((message.pose or message.redundancy) and not traits.quaternions, "a Cartesian pose", version)
    if message.wrench is not None and len(message.wrench) != 6:
        raise ValueError(f"a wrench must have 6 values, got {len(message.wrench)}")
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


def _request(found: _Collected, *, quaternion: bool) -> m.Transformation:
    """Decode a requested transformation, whose values may be absent."""
    size = 7 if quaternion else 12
    return m.Transformation(
        _name(found), doubles(found.get(2, []), "a transformation", most=size), _stamp(found, 3)
    )


def _robot(sub: _Collected) -> m.RobotInfo:
    drives: list[m.DriveState] = []
    for kind, value in sub.get(5, []):
        states = value if isinstance(value, bytes) else bytes([value & 0xFF])
        if kind not in (VARINT, BYTES) or any(state > max(m.DriveState) for state in states):
            raise MalformedMessage("FRI message: unknown drive state")
        drives.extend(m.DriveState(state) for state in states)
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
        **{name: _joints(sub, tag, text) for name, (tag, text) in m.MONITORED.items()},
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
    """Decode a datagram of the controller.

    Raises:
        MalformedMessage: it is not a legal monitoring message of this version; the text names the cause.
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
            _request(one, quaternion=quaternion)
            for one in _subs(found, 6, "transformations", MAX_TRANSFORMATIONS)
        ),
    )
