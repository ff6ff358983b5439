"""Time to read a monitoring message and to write a command."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator

from heptarm.fri.protocol.fast_codec import CommandTemplate, MonitoringReader

from bench.measure.blocks import by_turns, placements
from bench.measure.figure import Figure, benchmark
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version

_JOINTS = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)


def _monitoring() -> bytes:
    monitor = m.MonitorData(
        q=_JOINTS,
        tau=_JOINTS,
        q_cmd=_JOINTS,
        tau_cmd=_JOINTS,
        tau_ext=_JOINTS,
        stamp=m.TimeStamp(1_700_000_000, 123_456_789),
    )
    robot = m.RobotInfo(
        7, m.Safety.NORMAL_OPERATION, (m.DriveState.ACTIVE,) * 7, m.OperationMode.AUT, m.ControlMode.POSITION
    )
    link = m.ConnectionInfo(m.SessionState.COMMANDING_ACTIVE, m.Quality.EXCELLENT, 1, 1)
    ipo = m.IpoData(q=_JOINTS, command_mode=m.CommandMode.POSITION, overlay=m.Overlay.JOINT, tracking=1.0)
    return codec.encode_monitoring(
        m.Monitoring(m.Header(70_000, 69_999), robot, monitor, link, ipo), Version.V1_15
    )


@benchmark("fri_codec")
def fri_codec() -> Iterator[Figure]:
    """Time to read a monitoring message and to write a joint command, pure Python, beside `struct` alone."""
    datagram, reader = _monitoring(), MonitoringReader(Version.V1_15)
    reader.read(datagram)
    template = CommandTemplate(Version.V1_15)
    numbers, joints = struct.Struct("<35d"), struct.Struct("<2I7d")
    buffer = bytearray(joints.size)

    def write() -> bytes:
        template.q[:] = _JOINTS
        return template.encode(70_000, 70_000)

    def pack() -> bytes:
        joints.pack_into(buffer, 0, 70_000, 70_000, *_JOINTS)
        return bytes(buffer)

    sides = {
        "decode": (lambda: reader.read(datagram), lambda: numbers.unpack_from(datagram), 16.0),
        "encode": (write, pack, 4.0),
    }
    for name, (call, floor, limit) in sides.items():
        for found in by_turns(
            lambda: _times(call),  # noqa: B023  called before the loop goes on
            lambda: _times(floor),  # noqa: B023
            lambda placement: None,
            where=placements()[:1],
        ):
            yield found.figure(f"fri_{name}", 50, "us", limit=limit)


def _times(call: Callable[[], object], count: int = 20_000) -> list[float]:
    """Duration of each call [us]."""
    taken = []
    for _ in range(count):
        begin = time.perf_counter_ns()
        call()
        taken.append((time.perf_counter_ns() - begin) / 1e3)
    return taken
