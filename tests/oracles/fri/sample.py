"""Values of a monitoring message."""

from __future__ import annotations

import math

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version

from . import codec


class Sample:
    """Values of a monitoring message that a control law needs.

    Joint arrays are tuples of 7, None where the message has none: those of `messages.MONITORED`, and `q_ipo`.

    Attributes:
        message: all of it.
        sequence: the controller's counter.
        robot: robot info.
        connection: session state, quality, period.
        stamp: controller's clock, (s, ns); (0, 0) if absent.
        tracking: tracking performance; NaN if absent.
    """

    __slots__ = (
        "connection",
        "message",
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
    message: m.Monitoring


def sample_of(datagram: bytes, version: Version) -> Sample:
    """Decode a datagram of the controller.

    Raises:
        MalformedMessage: it is not a legal monitoring message of this version.
    """
    full = codec.decode_monitoring(datagram, version)
    sample = Sample()
    monitor, ipo = full.monitor or m.MonitorData(), full.ipo or m.IpoData()
    sample.message = full
    sample.sequence, sample.robot, sample.connection = full.header.sequence, full.robot, full.connection
    for name in m.MONITORED:
        setattr(sample, name, getattr(monitor, name))
    sample.q_ipo = ipo.q
    sample.stamp = (monitor.stamp.seconds, monitor.stamp.nanoseconds) if monitor.stamp else (0, 0)
    sample.tracking = math.nan if ipo.tracking is None else ipo.tracking
    return sample
