"""What the loop leaves for the user's process: a row for each message, events, and why no session stands."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heptarm.fri import messages as m
from heptarm.fri.event import Kind
from heptarm.fri.session import Session
from heptarm.fri.template import Sample
from heptarm.rt import layout as at
from heptarm.rt.state import State, information

NAN7, NAN6 = (math.nan,) * 7, (math.nan,) * 6
_ROW = struct.Struct(f"=18q{at.STATE_WORDS - 19}d")
_KINDS = list(Kind)
_NO_SIGNALS = (math.nan,) * m.MAX_IO


@dataclass(slots=True)
class Sent:
    """What was commanded in a turn; NaN where nothing was.

    Attributes:
        q: positions [rad].
        tau: torques [Nm].
        wrench: wrench [N, Nm].
        pose: FRI's numbers of the pose.
        e1: its redundancy angle [rad].
    """

    q: Sequence[float] = NAN7
    tau: Sequence[float] = NAN7
    wrench: Sequence[float] = NAN6
    pose: Sequence[float] = NAN7
    e1: float = math.nan


NOTHING_SENT = Sent()


class Record:
    """Writes the shared memory's states and events.

    Args:
        layout: the shared memory.
        session: whose messages they are.

    Attributes:
        info: robot and connection of the last message, and what seldom changes.
        state: the row that was filled last, as a law sees it.
        flags: of the turn.
        ticks: messages since commands became effective.
        sent: what was commanded.
        ipo: interpolator's pose as it came, where poses are commanded.
        ipo_e1: its redundancy angle [rad].
        signals: values of the session's signals.
    """

    def __init__(self, layout: at.Layout, session: Session) -> None:
        self._layout, self._session = layout, session
        self._slot = memoryview(bytearray(8 * at.STATE_WORDS))
        self.state = State(np.frombuffer(self._slot, dtype=np.float64))
        self.info: tuple[object, object, tuple[int, ...]] = (None, None, ())
        self.flags = 0
        self.ticks = 0
        self.sent = NOTHING_SENT
        self.ipo: Sequence[float] = NAN7
        self.ipo_e1 = math.nan
        self.signals: Sequence[float] = ()
        self._trouble = session.trouble
        layout.trouble.write(self._trouble)

    def fill(self, sample: Sample, latency: int) -> None:
        """The row of a message.

        Args:
            sample: the message.
            latency: of its answer [ns].
        """
        session = self._session
        robot, link = sample.robot, sample.connection
        if self.info[0] is not robot or self.info[1] is not link:
            self.info = (robot, link, information(sample.message))
        seconds, nanos = sample.stamp
        wrench: Sequence[float] = NAN6
        pose: Sequence[float] = NAN7
        e1 = math.nan
        if session.version is not None and session.version.traits.quaternions:
            monitor = sample.message.monitor or m.MonitorData()
            wrench = monitor.wrench or NAN6
            pose = monitor.pose.values if monitor.pose is not None else NAN7
            e1 = monitor.redundancy.value if monitor.redundancy is not None else math.nan
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
            sample.tracking,
            *(sample.q or NAN7),
            *(sample.tau or NAN7),
            *(sample.tau_cmd or NAN7),
            *(sample.tau_ext or NAN7),
            *(sample.q_cmd or NAN7),
            *(sample.q_ipo or NAN7),
            *wrench,
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
        """Leave the row of a message whose turn is over."""
        self.fill(sample, latency)
        ring = self._layout.states
        slot = ring.begin()
        ring.ints[slot, 1:] = self._slot[8:].cast("q")
        ring.end()

    def tell(self, now: int, text: str, kind: Kind = Kind.CLIENT) -> None:
        """Leave an event."""
        ring = self._layout.events
        octets = text.encode()[: at.EVENT_TEXT].ljust(at.EVENT_TEXT, b"\0")
        slot = ring.begin()
        ring.ints[slot, 1], ring.ints[slot, 2] = now, _KINDS.index(kind)
        ring.ints[slot, 3:] = memoryview(octets).cast("q")
        ring.end()

    def tell_all(self) -> None:
        """Leave what the session has noticed, and its trouble."""
        for event in self._session.events():
            self.tell(event.at, event.text, event.kind)
        if self._session.trouble != self._trouble:
            self._trouble = self._session.trouble
            self._layout.trouble.write(self._trouble)
