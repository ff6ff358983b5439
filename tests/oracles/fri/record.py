"""Writer of states and events in the shared memory, in Python: what native/fri_cycle.c has to do."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.user_api import State
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import DriveState, IpoData, Monitoring, RobotInfo
from heptarm.fri.session.events import Kind

from .sample import Sample
from .session import Session

NAN7, NAN6 = (math.nan,) * 7, (math.nan,) * 6
_ROW = struct.Struct(f"={at.S_TRACKING - 1}q{at.STATE_WORDS - at.S_TRACKING}d")
_ARRAYS = attrgetter(*at.ARRAYS)
_KINDS = list(Kind)
_NO_SIGNALS = (math.nan,) * m.MAX_IO


@dataclass(slots=True)
class Sent:
    """Command that was sent in a cycle; NaN for quantities that were not commanded.

    Attributes:
        q: positions [rad].
        tau: torques [Nm].
        wrench: wrench [N, Nm].
        pose: pose in FRI's numbers.
        e1: redundancy angle of the pose [rad].
    """

    q: Sequence[float] = NAN7
    tau: Sequence[float] = NAN7
    wrench: Sequence[float] = NAN6
    pose: Sequence[float] = NAN7
    e1: float = math.nan


NOTHING_SENT = Sent()


class Record:
    """Writer of states and events in the shared memory.

    Args:
        layout: the shared memory.
        session: session of the messages.

    Attributes:
        info: robot and connection of the last message, and the values derived from them.
        dq: velocities by differences, shape (7,) [rad/s].
        state: state filled last, as a law sees it.
        flags: flags of the cycle.
        ticks: messages since commands became effective.
        sent: command of the cycle.
        ipo: interpolator's pose in FRI's numbers, in sessions that command poses.
        ipo_e1: its redundancy angle [rad].
        signals: values of the session's signals.
        wrench: external wrench of the message, sent or estimated [N, Nm].
    """

    def __init__(self, layout: at.Layout, session: Session) -> None:
        self._layout, self._session = layout, session
        self._slot = memoryview(bytearray(8 * at.STATE_WORDS))
        self.dq = np.zeros(7)
        self.state = State(np.frombuffer(self._slot, dtype=np.float64), dq=self.dq)
        self.info: tuple[object, object, tuple[int, ...]] = (None, None, ())
        self.flags = 0
        self.ticks = 0
        self.sent = NOTHING_SENT
        self.ipo: Sequence[float] = NAN7
        self.ipo_e1 = math.nan
        self.signals: Sequence[float] = ()
        self.wrench: Sequence[float] = NAN6
        self._trouble = session.trouble
        layout.trouble.write(self._trouble)

    def fill(self, sample: Sample, latency: int) -> None:
        """Fill the state of a message.

        Args:
            sample: the message.
            latency: time from receipt to answer [ns].
        """
        session = self._session
        robot, link = sample.robot, sample.connection
        self.info = (robot, link, information(sample.message))
        seconds, nanos = sample.stamp
        pose: Sequence[float] = NAN7
        e1, strategy = math.nan, at.ABSENT
        if session.version is not None and session.version.traits.quaternions:
            monitor = sample.message.monitor or m.MonitorData()
            pose = monitor.pose.values if monitor.pose is not None else NAN7
            if monitor.redundancy is not None:
                e1, strategy = monitor.redundancy.value, monitor.redundancy.strategy
        overlay, safety, operation, control, drive, multiplier = self.info[2]
        sent, is_commanding = self.sent, session.is_commanding
        _ROW.pack_into(
            self._slot,
            8,
            session.received,
            sample.sequence,
            seconds * 1_000_000_000 + nanos,
            session.state,
            session.quality,
            session.mode,
            overlay,
            safety,
            operation,
            control,
            drive,
            session.period,
            multiplier,
            latency,
            self.flags,
            session.reflected,
            session.sent,
            max(0, self.ticks) if is_commanding else 0,
            strategy,
            sample.tracking,
            *(number for array in _ARRAYS(sample) for number in array or NAN7),
            *self.wrench,
            *pose,
            e1,
            *sent.q,
            *sent.tau,
            *sent.wrench,
            *(self.ipo if is_commanding else NAN7),
            *sent.pose,
            self.ipo_e1 if is_commanding else math.nan,
            sent.e1,
            *self.signals,
            *_NO_SIGNALS[len(self.signals) :],
        )

    def publish(self, sample: Sample, latency: int) -> None:
        """Publish the state of a message at the end of its cycle."""
        self.fill(sample, latency)
        ring = self._layout.states
        slot = ring.begin()
        ring.ints[slot, 1:] = self._slot[8:].cast("q")
        ring.end()

    def report(self, now: int, text: str, kind: Kind = Kind.CLIENT) -> None:
        """Publish an event."""
        ring = self._layout.events
        encoded = text.encode()[: at.EVENT_TEXT].ljust(at.EVENT_TEXT, b"\0")
        slot = ring.begin()
        ring.ints[slot, 1], ring.ints[slot, 2] = now, _KINDS.index(kind)
        ring.ints[slot, 3:] = memoryview(encoded).cast("q")
        ring.end()

    def report_all(self) -> None:
        """Publish the events of the session, and why there is no session."""
        for event in self._session.events():
            self.report(event.at, event.text, event.kind)
        if self._session.trouble != self._trouble:
            self._trouble = self._session.trouble
            self._layout.trouble.write(self._trouble)


def information(full: Monitoring) -> tuple[int, ...]:
    """Numbers of overlay, safety, operation mode, control mode, drive and multiplier of a message."""
    robot, ipo = full.robot or RobotInfo(), full.ipo or IpoData()
    drives = set(robot.drives)
    drive = None if not drives else drives.pop() if len(drives) == 1 else DriveState.TRANSITIONING
    multiplier = full.connection.multiplier if full.connection is not None else None
    values = (ipo.overlay, robot.safety, robot.operation_mode, robot.control_mode, drive, multiplier)
    return tuple(at.ABSENT if value is None else int(value) for value in values)
