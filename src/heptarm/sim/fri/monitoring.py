"""Monitoring messages of a session: their content in each version, encoded at up to 1 kHz."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import encode_monitoring
from heptarm.fri.protocol.protobuf import fields, put_bytes, put_double, put_packed, put_varint, varint
from heptarm.fri.protocol.version import MONITORING_ID, Version, unwrap, wrap
from heptarm.sim.fri import cartesian
from heptarm.sim.fri.overlay import MotionOverlay, Reading
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.values.robot import RobotModel


@dataclass(frozen=True, slots=True)
class SessionStatus:
    """State of the session in its messages; `tracking` only while commanding is active."""

    state: m.SessionState
    quality: m.Quality
    overlay: MotionOverlay | None
    tracking: float | None


def report(
    reading: Reading,
    *,
    header: m.Header,
    stamp: m.TimeStamp,
    status: SessionStatus,
    configuration: SessionConfiguration,
    robot: RobotModel,
    signals: tuple[m.IoValue, ...],
    requested: tuple[m.Transformation, ...],
) -> m.Monitoring:
    """The monitoring message of a tick."""
    traits = configuration.version.traits
    return m.Monitoring(
        header,
        robot=m.RobotInfo(
            7, reading.safety, (reading.drives,) * 7, reading.operation_mode, reading.control_mode
        ),
        monitor=m.MonitorData(
            **{
                name: getattr(reading, name)
                for name in m.MONITORED
                if name != "q_cmd" or not traits.quaternions
            },
            wrench=reading.wrench if traits.framed else None,
            io=signals,
            pose=cartesian.transformation(robot, reading.q) if traits.quaternions else None,
            redundancy=_redundancy(reading.q) if traits.quaternions else None,
            stamp=stamp,
        ),
        connection=m.ConnectionInfo(
            status.state, status.quality, configuration.period_ms, configuration.multiplier
        ),
        ipo=_ipo(reading, status, robot),
        requested=requested,
    )


def _ipo(reading: Reading, status: SessionStatus, robot: RobotModel) -> m.IpoData:
    """Interpolator's data, with positions only while there is an overlay."""
    overlay = status.overlay
    if overlay is None:
        return m.IpoData(command_mode=m.CommandMode.NO_COMMAND, overlay=m.Overlay.NONE)
    pose = redundancy = None
    if overlay.kind is m.Overlay.CARTESIAN:
        pose, redundancy = cartesian.transformation(robot, reading.q_ipo), _redundancy(reading.q_ipo)
    return m.IpoData(reading.q_ipo, pose, redundancy, overlay.mode, overlay.kind, status.tracking)


def _redundancy(q: tuple[float, ...]) -> m.Redundancy:
    return m.Redundancy(m.RedundancyStrategy.E1, q[2])


_ARRAY = struct.Struct("<BB" + "Bd" * 7)
_FIXED64 = 1 << 3 | 1
_HEAD = put_varint(1, MONITORING_ID) + b"\x10"

#: Size of the cache of encoded sections.
KEPT = 64


def _array(tag: int, joints: m.Joints | None) -> bytes:
    """A joint array as a field, 65 bytes."""
    if joints is None:
        return b""
    a, b, c, d, e, f, g = joints
    k = _FIXED64
    return _ARRAY.pack(tag << 3 | 2, 63, k, a, k, b, k, c, k, d, k, e, k, f, k, g)


def _stamp(tag: int, stamp: m.TimeStamp | None) -> bytes:
    if stamp is None:
        return b""
    return put_bytes(tag, b"\x08" + varint(stamp.seconds) + b"\x10" + varint(stamp.nanoseconds))


def _pose(tag: int, pose: m.Transformation | None) -> bytes:
    if pose is None:
        return b""
    return put_bytes(
        tag, put_bytes(1, pose.name.encode()) + put_packed(2, pose.values) + _stamp(3, pose.stamp)
    )


def _redundancy_writer(tag: int, value: m.Redundancy | None) -> bytes:
    return (
        b"" if value is None else put_bytes(tag, put_varint(1, value.strategy) + put_double(2, value.value))
    )


class MonitoringEncoder:
    """Encodes monitoring messages of one version."""

    def __init__(self, version: Version) -> None:
        self._version = version
        self._kept: dict[object, bytes] = {}

    def encode(self, message: m.Monitoring) -> bytes:
        """The datagram of a message.

        Raises:
            ValueError: the version has no such field, or a name or list is too long.
        """
        counters = varint(message.header.sequence) + b"\x18" + varint(message.header.reflected)
        parts = [bytes((0x0A, len(_HEAD) + len(counters))), _HEAD, counters]
        if message.robot is not None:
            parts.append(self._section(2, message.robot, m.Monitoring(message.header, robot=message.robot)))
        if message.monitor is not None:
            parts.append(self._monitor(message.header, message.monitor))
        if message.connection is not None:
            parts.append(
                self._section(
                    4, message.connection, m.Monitoring(message.header, connection=message.connection)
                )
            )
        if message.ipo is not None:
            parts.append(self._ipo(message.header, message.ipo))
        if message.requested:
            whole = encode_monitoring(
                m.Monitoring(message.header, requested=message.requested), self._version
            )
            parts += [put_bytes(6, value) for value in self._values(whole, 6)]
        return wrap(b"".join(parts), self._version)

    def _monitor(self, header: m.Header, data: m.MonitorData) -> bytes:
        traits = self._version.traits
        if (
            (data.q_cmd is not None and traits.quaternions)
            or ((data.pose or data.redundancy) and not traits.quaternions)
            or (data.wrench is not None and not traits.framed)
        ):
            encode_monitoring(m.Monitoring(header, monitor=data), self._version)  # raises the error
        signals = b""
        if data.io:
            only = m.Monitoring(header, monitor=m.MonitorData(io=data.io))
            if any(
                value.type is m.IoType.ANALOG for value in data.io
            ):  # they change all the time, and -0.0 == 0.0
                signals = self._values(encode_monitoring(only, self._version), 3)[0]
            else:
                signals = self._section(3, data.io, only, inside=True)
        return put_bytes(
            3,
            b"".join(_array(tag, getattr(data, name)) for name, (tag, _) in m.MONITORED.items())
            + (b"" if data.wrench is None else put_bytes(6, put_packed(1, data.wrench)))
            + signals
            + _pose(9, data.pose)
            + _redundancy_writer(10, data.redundancy)
            + _stamp(15, data.stamp),
        )

    def _ipo(self, header: m.Header, ipo: m.IpoData) -> bytes:
        modes = m.IpoData(command_mode=ipo.command_mode, overlay=ipo.overlay)
        return put_bytes(
            5,
            _array(1, ipo.q)
            + _pose(2, ipo.pose)
            + _redundancy_writer(3, ipo.redundancy)
            + self._section(5, modes, m.Monitoring(header, ipo=modes), inside=True)
            + (b"" if ipo.tracking is None else put_double(12, ipo.tracking)),
        )

    def _section(self, tag: int, value: object, only: m.Monitoring, *, inside: bool = False) -> bytes:
        """The bytes of a section, from a message with only that section; `inside`: without key and length."""
        key = (tag, value)
        kept = self._kept.get(key)
        if kept is None:
            content = self._values(encode_monitoring(only, self._version), tag)[0]
            kept = content if inside else put_bytes(tag, content)
            if len(self._kept) >= KEPT:
                self._kept.clear()
            self._kept[key] = kept
        return kept

    def _values(self, datagram: bytes, wanted: int) -> list[bytes]:
        message = unwrap(datagram, self._version)
        return [value for tag, _, value in fields(message) if tag == wanted and isinstance(value, bytes)]
