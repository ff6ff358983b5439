"""The client's side of an FRI session, sans IO: datagrams and times in, answers and events out.

The controller leads: it names the session state in every message and the client answers every multiplier-th one.
`receive` takes a datagram; if it says that an answer is due, `answer` makes it: nothing in IDLE, a bare header (1.x:
the commanded position too) while monitoring, a mirror of the interpolator in COMMANDING_WAIT, and the given setpoint,
with all that the client command mode needs, in COMMANDING_ACTIVE. Outputs and transformations go with any of them. A
session may end and another begin at any time.
"""

from __future__ import annotations

import math

from heptarm.fri import messages as m
from heptarm.fri.answers import Answers
from heptarm.fri.event import Event, Kind
from heptarm.fri.protobuf import MalformedMessage, read_varint
from heptarm.fri.setpoint import NOTHING, Setpoint
from heptarm.fri.statistics import Counters, Histogram
from heptarm.fri.template import MonitoringReader, Sample
from heptarm.fri.version import Version, recognise

#: A counter that goes back by no more than this is a message overtaken on its way, else the controller began anew.
OVERTAKEN = 64
#: After this long without a message, a lower counter means a new session in any case [ns].
SILENCE = 500_000_000
#: Events kept until somebody takes them.
MAX_EVENTS = 256

_WRAP = 1 << 32
_QUALITIES = ("poor", "fair", "good", "excellent")


class Session:
    """Client of one controller, over any number of its sessions.

    Args:
        version: wire format; None takes it from the first datagram.
        counters: where to count; None for own ones.
        latency: receipt to answer; None for an own histogram.
        jitter: deviation of the messages' distance from the send period; None for an own histogram.

    Attributes:
        version: wire format; None until it is known.
        state: as the last message said; IDLE before the first one.
        quality: as the last message said.
        mode: client command mode of the last message.
        sample: the last message; None before the first one.
        period: send period [ns], 0 until known.
        is_due: the last message wants an answer.
        trouble: why no session stands, in words; empty if one does.
    """

    def __init__(
        self,
        version: Version | None = None,
        *,
        counters: Counters | None = None,
        latency: Histogram | None = None,
        jitter: Histogram | None = None,
    ) -> None:
        self._wanted = version
        self.counters = counters or Counters()
        self.latency = latency or Histogram()
        self.jitter = jitter or Histogram()
        self.sent = 0  # counter of the next command
        self._events: list[Event] = []
        self.restart()

    def restart(self) -> None:
        """Forget the controller, as after a change of address; counts stay."""
        self.version: Version | None = None
        self.state = m.SessionState.IDLE
        self.quality = m.Quality.POOR
        self.mode = m.CommandMode.NO_COMMAND
        self.sample: Sample | None = None
        self.period = 0
        self.is_due = False
        self.trouble = "nothing has arrived from a controller yet"
        self.received = 0  # when the last message came
        self.waiting = 0  # messages since the last answer
        self.reflected = -1  # our counter, as the controller knows it
        self._safety: m.Safety | None = None
        self._reader: MonitoringReader | None = None
        self._answers: Answers | None = None

    @property
    def multiplier(self) -> int:
        """Every how manieth message is answered."""
        link = self.sample.connection if self.sample is not None else None
        return max(1, (link.multiplier or 1) if link is not None else 1)

    @property
    def is_commanding(self) -> bool:
        """Commands are effective."""
        return self.state is m.SessionState.COMMANDING_ACTIVE

    def events(self) -> list[Event]:
        """What happened since the last call, oldest first; at most 256, later ones are dropped."""
        taken, self._events = self._events, []
        return taken

    def receive(self, datagram: bytes, now: int) -> Sample | None:
        """Take a datagram of the controller.

        Args:
            datagram: its octets.
            now: the client's clock at its receipt [ns].

        Returns:
            The message if it is the newest one; None if it is to be ignored, with an event that says why.
        """
        self.is_due = False
        try:
            sample = self._read(datagram, now)
        except MalformedMessage as error:
            self.counters.malformed += 1
            if not _is_legal(datagram):
                self._tell(Kind.MALFORMED, str(error), now)
            elif self.trouble != str(error):  # told once, not a thousand times a second
                self.trouble = str(error)
                self._tell(Kind.WRONG_VERSION, self.trouble, now)
            return None
        if not self._count(sample, now):
            return None
        link = sample.connection
        if link is None:  # a legal message of a controller that has no session
            self._enter(m.SessionState.IDLE, now)
        else:
            self.period = (link.period_ms or 0) * 1_000_000
            counted = _QUALITIES[link.quality]
            setattr(self.counters, counted, getattr(self.counters, counted) + 1)
            if link.state is not self.state:
                self._enter(link.state, now)
            if link.quality is not self.quality:
                self._tell(Kind.QUALITY, f"quality {self.quality.name} -> {link.quality.name}", now)
                self.quality = link.quality
        self._look(sample, datagram, now)
        self.sample, self.received, self.trouble = sample, now, ""
        if self.state is not m.SessionState.IDLE:
            self.waiting += 1
            self.is_due = self.waiting >= self.multiplier
        else:
            self.waiting = 0
        return sample

    def answer(self, setpoint: Setpoint = NOTHING) -> bytes | None:
        """The answer to the last message; None if none is due.

        Raises:
            CommandRejected: the setpoint names outputs or transformations that the controller does not offer.
        """
        sample = self.sample
        if not self.is_due or sample is None or self._answers is None:
            return None
        if not setpoint.is_plain:
            setpoint.check(sample.message)
        octets = self._answers.make(
            sample, setpoint, m.Header(self.sent, sample.sequence), state=self.state, mode=self.mode
        )
        if self._answers.lack:
            self._tell(Kind.NO_IPO, self._answers.lack, self.received)
        self.sent = (self.sent + 1) % _WRAP
        self.waiting, self.is_due = 0, False
        self.counters.answered += 1
        if self.is_commanding:
            self.counters.commanded += 1
        return octets

    def answered(self, now: int) -> None:
        """The answer has left at `now` [ns]."""
        self.latency.add(now - self.received)

    # ------------------------------------------------------------------------------------------ receiving

    def _read(self, datagram: bytes, now: int) -> Sample:
        if self._reader is None:
            sample = self._begin(datagram, now)
        else:
            try:
                sample = self._reader.read(datagram)
            except MalformedMessage:
                # another application may have been started on the controller, with another version
                if self._wanted is not None or recognise(datagram) is self.version:
                    raise
                sample = self._begin(datagram, now)
        for values in (sample.q, sample.q_ipo):
            if values is not None and not math.isfinite(sum(values)):
                raise MalformedMessage("FRI message: a joint position is not finite")
        return sample

    def _begin(self, datagram: bytes, now: int) -> Sample:
        """The first datagram: find or check its version."""
        version = recognise(datagram) if self._wanted is None else self._wanted
        reader = MonitoringReader(version)
        sample = reader.read(datagram)
        full = sample.message
        monitor, ipo = full.monitor or m.MonitorData(), full.ipo or m.IpoData()
        spoken = None
        if version.traits.quaternions and monitor.q_cmd is not None:
            spoken = "1.x"
        elif not version.traits.quaternions and (monitor.pose or monitor.redundancy or ipo.pose):
            spoken = "2.5"
        if spoken is not None:
            raise MalformedMessage(
                f"the controller speaks FRI {spoken}, this client was told {version.value}: "
                "give the client the controller's version, or none to take it from the first datagram"
            )
        if version is not self.version:
            self._tell(Kind.VERSION, f"the controller speaks FRI {version.value}", now)
        self.version, self._reader, self._answers = version, reader, Answers(version)
        return sample

    def _count(self, sample: Sample, now: int) -> bool:
        """Whether a message is newer than the last; counts those that were lost, came twice or too late."""
        counts, last = self.counters, self.sample
        counts.received += 1
        if last is None:
            return True
        step = (sample.sequence - last.sequence) % _WRAP
        interval = now - self.received
        if step == 0 and interval < SILENCE:
            counts.duplicated += 1
            self._tell(Kind.DUPLICATED, f"message {sample.sequence} came twice", now)
            return False
        if 0 < step < _WRAP // 2:
            if step > 1:
                counts.lost += step - 1
                self._tell(Kind.LOST, f"{step - 1} messages before {sample.sequence} are missing", now)
            if self.period and step <= OVERTAKEN:
                self.jitter.add(abs(interval - step * self.period))
            return True
        if _WRAP - step <= OVERTAKEN and interval < SILENCE and self.state is not m.SessionState.IDLE:
            counts.reordered += 1
            counts.lost = max(0, counts.lost - 1)
            self._tell(Kind.REORDERED, f"message {sample.sequence} came after {last.sequence}", now)
            return False
        counts.restarts += 1
        self.reflected, self.waiting = -1, 0
        self._tell(Kind.RESTARTED, f"the controller counts anew from {sample.sequence}: a new session", now)
        self._enter(m.SessionState.IDLE, now)
        return True

    def _enter(self, state: m.SessionState, now: int) -> None:
        if state is not self.state:
            self._tell(Kind.STATE, f"{self.state.name} -> {state.name}", now)
            self.state = state

    def _look(self, sample: Sample, datagram: bytes, now: int) -> None:
        """Notice a change of command mode and safety, and answers that the controller did not take."""
        reflected = reflected_in(datagram, framed=bool(self.version and self.version.traits.framed))
        if 0 <= self.reflected < reflected <= self.sent:
            self.counters.missed += reflected - self.reflected - 1
        self.reflected = reflected
        last = self.sample
        if last is None or sample.robot is not last.robot:
            safety = sample.robot.safety if sample.robot is not None else None
            if safety is not self._safety:
                if safety is not None and (
                    self._safety is not None or safety is not m.Safety.NORMAL_OPERATION
                ):
                    self._tell(Kind.SAFETY, f"safety state {safety.name}", now)
                self._safety = safety
        # layouts are equal as long as the connection value is the very same object
        if last is None or sample.connection is not last.connection:
            ipo = sample.message.ipo
            mode = (ipo.command_mode if ipo is not None else None) or m.CommandMode.NO_COMMAND
            if mode is not self.mode:
                self._tell(Kind.COMMAND_MODE, f"client command mode {self.mode.name} -> {mode.name}", now)
                self.mode = mode

    def _tell(self, kind: Kind, text: str, now: int) -> None:
        if len(self._events) < MAX_EVENTS:
            self._events.append(Event(kind, text, now))

def reflected_in(datagram: bytes, *, framed: bool) -> int:
    """The reflected counter of a legal monitoring datagram; -1 if it is in no usual place."""
    pos, end = 4 if framed else 0, len(datagram)
    if datagram[pos] != 0x0A:
        return -1
    size, pos = read_varint(datagram, pos + 1, end)
    stop, reflected = pos + size, -1
    while pos < stop:
        key = datagram[pos]
        if key & 7 or key > 0x78:  # a field that FRI does not have
            return -1
        value, pos = read_varint(datagram, pos + 1, end)
        if key == 0x18:
            reflected = value
    return reflected if reflected < _WRAP else -1


def _is_legal(datagram: bytes) -> bool:
    """Whether it is a legal message of some version."""
    try:
        recognise(datagram)
    except MalformedMessage:
        return False
    return True
