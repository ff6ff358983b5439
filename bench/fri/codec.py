"""C10: what it costs to read a monitoring message and to write a command."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from bench.registry import Figure, benchmark
from heptarm.fri import codec
from heptarm.fri import messages as m
from heptarm.fri.template import CommandTemplate, MonitoringReader
from heptarm.fri.version import Version

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


@benchmark("fri_codec", "C10")
def fri_codec() -> Iterator[Figure]:
    """Median time to read a monitoring message and to write a joint command, pure Python."""
    datagram, reader = _monitoring(), MonitoringReader(Version.V1_15)
    reader.read(datagram)
    template = CommandTemplate(Version.V1_15)

    def write() -> bytes:
        template.q[:] = _JOINTS
        return template.encode(70_000, 70_000)

    yield Figure("fri_decode", "C10", _median(lambda: reader.read(datagram)), "us", limit=6.0)
    yield Figure("fri_encode", "C10", _median(write), "us", limit=1.5)


def _median(call: Callable[[], object], times: int = 50_000) -> float:
    taken = []
    for _ in range(times):
        begin = time.perf_counter_ns()
        call()
        taken.append(time.perf_counter_ns() - begin)
    return float(np.median(taken)) / 1e3
