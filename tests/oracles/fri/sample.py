"""Codec of the 1 kHz path of FRI: fixed layouts for the frequent datagrams.

`CommandTemplate` writes a joint (and torque or wrench) command. `MonitoringReader` reads the joint arrays of a
monitoring message in one `struct` call and compares what seldom changes (robot info, connection, keys) with the
previous message. Both agree with `heptarm.fri.protocol.codec`, to which the reader falls back when anything else
differs.
"""

from __future__ import annotations

import math
import struct
import zlib

import numpy as np
import numpy.typing as npt

from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.protobuf import (
    MalformedMessage,
    fields,
    put_bytes,
    put_packed,
    put_unpacked,
    put_varint,
    read_varint,
    varint,
)
from heptarm.fri.protocol.version import COMMAND_ID, MONITORING_ID, Version, unwrap

_ZERO = (0.0,) * 7
_COMMAND_HEAD = put_varint(1, COMMAND_ID) + b"\x10"  # then sequence, 0x18, reflected
_MONITORING_HEAD = put_varint(1, MONITORING_ID) + b"\x10"

Floats = npt.NDArray[np.float64]


class CommandTemplate:
    """Encoder of commands with a fixed set of fields.

    Args:
        version: wire format.
        torque: the command carries superposed joint torques.
        wrench: the command carries a Cartesian wrench.

    Attributes:
        q: shape (7,) [rad], a view into the message: assign with `q[:] = …`.
        tau: shape (7,) [Nm], or None.
        wrench: shape (6,) [N, Nm], or None.
    """

    __slots__ = ("_body", "_framed", "q", "tau", "wrench")

    def __init__(self, version: Version, *, torque: bool = False, wrench: bool = False) -> None:
        body = put_bytes(1, put_unpacked(1, _ZERO))
        wrench_at = len(body) + 4
        if wrench:
            body += put_bytes(2, put_packed(1, (0.0,) * 6))
        tau_at = len(body) + 3
        if torque:
            body += put_bytes(3, put_unpacked(1, _ZERO))
        head = put_bytes(2, body)[: -len(body)]
        self._body = bytearray(head + body)
        self._framed = version.traits.framed
        shift = len(head)
        self.q: Floats = np.ndarray(7, "<f8", self._body, shift + 3, (9,))
        self.tau: Floats | None = np.ndarray(7, "<f8", self._body, shift + tau_at, (9,)) if torque else None
        self.wrench: Floats | None = np.ndarray(6, "<f8", self._body, shift + wrench_at) if wrench else None

    def encode(self, sequence: int, reflected: int) -> bytes:
        """Encode the current content of the arrays."""
        counters = varint(sequence) + b"\x18" + varint(reflected)
        head = bytes((0x0A, len(_COMMAND_HEAD) + len(counters))) + _COMMAND_HEAD + counters
        message = head + self._body
        if self._framed:
            return len(message).to_bytes(4, "little") + message + zlib.crc32(message).to_bytes(4, "little")
        return message


class Sample:
    """Values of a monitoring message that a control law needs, without the cost of decoding all of it.

    Joint arrays are tuples of 7, None where the message has none: those of `messages.MONITORED`, and `q_ipo`.

    Attributes:
        sequence: the controller's counter.
        robot: robot info.
        connection: session state, quality, period.
        stamp: controller's clock, (s, ns); (0, 0) if absent.
        tracking: tracking performance; NaN if absent.
    """

    __slots__ = (
        "_datagram",
        "_full",
        "_version",
        "connection",
        "q_ipo",
        "robot",
        "sequence",
        "stamp",
        "tracking",
        *m.MONITORED,
    )

    q: m.Joints | None
    tau: m.Joints | None
    q_cmd: m.Joints | None
    tau_cmd: m.Joints | None
    tau_ext: m.Joints | None
    q_ipo: m.Joints | None
    sequence: int
    robot: m.RobotInfo | None
    connection: m.ConnectionInfo | None
    stamp: tuple[int, int]
    tracking: float
    _datagram: bytes
    _full: m.Monitoring | None
    _version: Version

    @property
    def is_full(self) -> bool:
        """Whether the message is decoded in full; otherwise it has no signals, poses or requests."""
        return self._full is not None

    @property
    def message(self) -> m.Monitoring:
        """Full message, decoded when first needed."""
        if self._full is None:
            self._full = codec.decode_monitoring(self._datagram, self._version)
        return self._full


def _sample(datagram: bytes, version: Version, full: m.Monitoring) -> Sample:
    """Make the sample of a fully decoded message."""
    sample = Sample()
    monitor, ipo = full.monitor or m.MonitorData(), full.ipo or m.IpoData()
    sample._datagram, sample._version, sample._full = datagram, version, full
    sample.sequence, sample.robot, sample.connection = full.header.sequence, full.robot, full.connection
    for name in m.MONITORED:
        setattr(sample, name, getattr(monitor, name))
    sample.q_ipo = ipo.q
    sample.stamp = (monitor.stamp.seconds, monitor.stamp.nanoseconds) if monitor.stamp else (0, 0)
    sample.tracking = math.nan if ipo.tracking is None else ipo.tracking
    return sample


def _varint_at(data: bytes, pos: int) -> tuple[int, int]:
    """Read a varint of a datagram that is long enough for any; the fast case is one byte."""
    byte = data[pos]
    return (byte, pos + 1) if byte < 0x80 else read_varint(data, pos, len(data))


class _Layout:
    """Places of all fields in a message as KUKA writes it, and the bytes to compare.

    For messages with header, robot info, monitor data of joint arrays and a stamp, connection, ipo data of a joint
    array and enumerations. Messages with IO, poses or transformations have no layout and are decoded in full.
    """

    def __init__(self, datagram: bytes, full: m.Monitoring, version: Version) -> None:
        self._version = version
        self._robot, self._connection = full.robot, full.connection
        message = unwrap(datagram, version)
        sections = {tag: value for tag, _, value in fields(message) if isinstance(value, bytes)}
        monitor, ipo = full.monitor, full.ipo
        if monitor is None or monitor.stamp is None or set(sections) - {1, 2, 3, 4, 5} or 4 not in sections:
            raise MalformedMessage("no fixed layout")
        self._before = (put_bytes(2, sections[2]) if 2 in sections else b"") + b"\x1a"
        present = {name: tag for name, (tag, _) in m.MONITORED.items() if getattr(monitor, name) is not None}
        arrays = b"".join(put_bytes(tag, put_unpacked(1, _ZERO)) for tag in present.values())
        if monitor.io or monitor.wrench or monitor.pose or monitor.redundancy:  # variable positions
            raise MalformedMessage("no fixed layout")
        tracked = ipo is not None and ipo.tracking is not None
        ipo_array = put_bytes(1, put_unpacked(1, _ZERO)) if ipo is not None and ipo.q is not None else b""
        enums = sections[5][len(ipo_array) : len(sections[5]) - 9 * tracked] if 5 in sections else b""
        after = put_bytes(4, sections[4])
        if 5 in sections:
            after += (
                b"\x2a"
                + varint(len(sections[5]))
                + ipo_array
                + enums
                + (b"\x61" + bytes(8) if tracked else b"")
            )
        self._front, self._front_runs = _struct_of(arrays, len(present) * 7)
        self._back, self._back_runs = _struct_of(after, 7 * bool(ipo_array) + tracked)
        self._slots = [(name, 7 * index) for index, name in enumerate(present)]
        self._absent = [name for name in m.MONITORED if name not in present]
        self._has_ipo, self._tracked = bool(ipo_array), tracked

    def read(self, message: bytes, datagram: bytes) -> Sample | None:
        """Read a message of this layout; None if it differs in anything that must be equal."""
        if message[0] != 0x0A or message[2:8] != _MONITORING_HEAD:
            return None
        sequence, pos = _varint_at(message, 8)
        if message[pos] != 0x18:
            return None
        reflected, pos = _varint_at(message, pos + 1)
        if pos != 2 + message[1] or not message.startswith(self._before, pos):
            return None
        size, pos = _varint_at(message, pos + len(self._before))
        end = pos + size
        front = self._front.unpack_from(message, pos)
        pos += self._front.size
        if (
            front[::2] != self._front_runs
            or message[pos] != 0x7A
            or message[pos + 1] != end - pos - 2
            or message[pos + 2] != 0x08
        ):
            return None
        seconds, pos = _varint_at(message, pos + 3)
        if message[pos] != 0x10:
            return None
        nanoseconds, pos = _varint_at(message, pos + 1)
        if pos != end or len(message) - end != self._back.size:
            return None
        if (sequence | reflected | seconds | nanoseconds) >> 32:
            return None
        back = self._back.unpack_from(message, end)
        if back[::2] != self._back_runs:
            return None
        values, tail = front[1::2], back[1::2]
        sample = Sample()
        sample._datagram, sample._version, sample._full = datagram, self._version, None
        sample.sequence, sample.robot, sample.connection = sequence, self._robot, self._connection
        for name, at in self._slots:
            setattr(sample, name, values[at : at + 7])
        for name in self._absent:
            setattr(sample, name, None)
        sample.q_ipo = tail[:7] if self._has_ipo else None
        sample.tracking = tail[-1] if self._tracked else math.nan
        sample.stamp = (seconds, nanoseconds)
        return sample


def _struct_of(body: bytes, doubles: int) -> tuple[struct.Struct, tuple[bytes, ...]]:
    """Make a struct that reads `body` as fixed runs around `doubles` zeroed doubles; return it and the runs."""
    runs: list[bytes] = []
    rest = body
    for _ in range(doubles):
        run, _, rest = rest.partition(bytes(8))
        runs.append(run)
    runs.append(rest)
    return struct.Struct("<" + "d".join(f"{len(run)}s" for run in runs)), tuple(runs)


class MonitoringReader:
    """Decoder of the monitoring messages of one session.

    The first message of a layout is decoded in full. As long as only counters, stamps and doubles change, later ones
    are read from known positions; on any other difference a message is decoded in full again.
    """

    def __init__(self, version: Version) -> None:
        self._version = version
        self._layout: _Layout | None = None

    def read(self, datagram: bytes) -> Sample:
        """Decode a datagram of the controller.

        Raises:
            MalformedMessage: it is not a legal monitoring message of this version.
        """
        if self._layout is not None:
            try:
                sample = self._layout.read(unwrap(datagram, self._version), datagram)
            except (IndexError, struct.error):  # shorter than the layout: the full decoder names the defect
                sample = None
            if sample is not None:
                return sample
        full = codec.decode_monitoring(datagram, self._version)
        try:
            self._layout = _Layout(datagram, full, self._version)
        except MalformedMessage:
            self._layout = None
        return _sample(datagram, self._version, full)
