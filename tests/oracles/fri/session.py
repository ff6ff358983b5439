"""State machine of a client's session, in Python: what native/fri_session.c has to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.protobuf import MalformedMessage
from heptarm.fri.protocol.version import Version, recognise, spoken_version
from heptarm.fri.session.events import Event, Kind
from heptarm.fri.session.statistics import Counters, Histogram
from heptarm.values.robot import ROBOTS

from .answers import NOTHING, Answers, Setpoint
from .sample import Sample, sample_of

#: Largest decrease of the counter that counts as a reordered message; a larger one is a restart of the controller.
MAX_REORDERED = 64
#: After this long without a message, a lower counter always means a new session [ns].
MAX_GAP = 500_000_000
#: Largest number of events kept until they are read.
MAX_EVENTS = 256

#: An arm may stop this far beyond its position limits [rad].
OVERRUN = 0.05
#: Largest coordinate of a flange pose [mm].
MAX_COORDINATE = 10_000.0
#: Largest deviation of a quaternion's norm from 1.
MAX_NORM_ERROR = 0.05

_NO_KNOWN_VERSION = (
    "datagrams arrive, but none is a message of FRI 1.11 to 2.7: likely cause: the controller speaks another version, "
    "or another program sends to this port"
)
_WRAP = 1 << 32
_QUALITIES = ("poor", "fair", "good", "excellent")


class ImplausibleMessage(MalformedMessage):
    """A legal message whose positions no robot can have: a damaged datagram."""


#: Lowest and highest position of each axis [rad].
Positions = tuple[tuple[float, ...], tuple[float, ...]]


def widest() -> Positions:
    """Position range that contains the ranges of all known robots, 7 lowest and 7 highest positions [rad]."""
    low = [min(float(robot.q_min[axis]) for robot in ROBOTS.values()) for axis in range(m.JOINTS)]
    high = [max(float(robot.q_max[axis]) for robot in ROBOTS.values()) for axis in range(m.JOINTS)]
    return tuple(low), tuple(high)


class Session:
    """State of one controller as its client sees it, over any number of sessions.

    Args:
        version: wire format; None takes it from the first datagram.
        counters: counters to use; None creates them.
        latency: histogram of the times from receipt to answer; None creates one.
        jitter: histogram of the deviations from the send period; None creates one.
        positions: position limits of the robot [rad]; a message with a position that would be sent back and is further
            than `OVERRUN` beyond them counts as damaged. None: the limits of all known robots.

    Attributes:
        low, high: plausible positions of the axes [rad].
        version: wire format; None until the first message.
        state: state in the last message; IDLE before the first one.
        quality: quality in the last message.
        mode: client command mode in the last message.
        sample: the last message; None before the first one.
        period: send period [ns]; 0 before the first message.
        is_due: whether the last message has to be answered.
        trouble: why there is no session, as text; empty if there is one.
    """

    def __init__(
        self,
        version: Version | None = None,
        *,
        counters: Counters | None = None,
        latency: Histogram | None = None,
        jitter: Histogram | None = None,
        positions: Positions | None = None,
        fastest: Sequence[float] | None = None,
    ) -> None:
        self._configured = version
        low, high = positions or widest()
        self.low, self.high = [value - OVERRUN for value in low], [value + OVERRUN for value in high]
        self.fastest = fastest or [
            max(float(robot.dq_max[i]) for robot in ROBOTS.values()) for i in range(m.JOINTS)
        ]
        self.counters = counters or Counters()
        self.latency = latency or Histogram()
        self.jitter = jitter or Histogram()
        self.sent = 0  # counter of the next answer
        self._events: list[Event] = []
        self.publish: Callable[[Event], None] = self._events.append
        self.restart()

    def restart(self) -> None:
        """Forget the controller, for example after a change of its address; keep the counts."""
        self.version: Version | None = None
        self.state = m.SessionState.IDLE
        self.quality = m.Quality.POOR
        self.mode = m.CommandMode.NO_COMMAND
        self.sample: Sample | None = None
        self.period = 0
        self.is_due = False
        self.trouble = "no message received from a controller yet"
        self.received = 0  # time of the last message
        self.waiting = 0  # messages since the last answer
        self.reflected = self.sent - 1  # newest answer of this session that the controller has received
        self._safety: m.Safety | None = None
        self._answers: Answers | None = None

    @property
    def multiplier(self) -> int:
        """Number of messages per answer."""
        link = self.sample.connection if self.sample is not None else None
        return max(1, (link.multiplier or 1) if link is not None else 1)

    @property
    def is_commanding(self) -> bool:
        """Whether commands are effective."""
        return self.state is m.SessionState.COMMANDING_ACTIVE

    def events(self) -> list[Event]:
        """Get the events since the last call, oldest first; at most 256, later ones are dropped."""
        taken, self._events = self._events, []
        return taken

    def receive(self, datagram: bytes, now: int) -> Sample | None:
        """Decode a datagram of the controller.

        Args:
            datagram: the datagram.
            now: time of receipt, client's clock [ns].

        Returns:
            The message if it is the newest one; None if it is ignored, with an event that gives the reason.
        """
        self.is_due = False
        try:
            sample = self._read(datagram, now)
        except MalformedMessage as error:
            self.counters.malformed += 1
            self._diagnose(error, datagram, now)
            return None
        if not self._count(sample, now):
            return None
        link = sample.connection
        if link is None:  # a legal message of a controller without a session
            self._enter(m.SessionState.IDLE, now)
        else:
            self.period = (link.period_ms or 0) * 1_000_000
            counted = _QUALITIES[link.quality]
            setattr(self.counters, counted, getattr(self.counters, counted) + 1)
            if link.state is not self.state:
                self._enter(link.state, now)
            if link.quality is not self.quality:
                self._report(Kind.QUALITY, f"quality {self.quality.name} -> {link.quality.name}", now)
                self.quality = link.quality
        self._detect_changes(sample, now)
        self.sample, self.received, self.trouble = sample, now, ""
        if self.state is not m.SessionState.IDLE:
            self.waiting += 1
            self.is_due = self.waiting >= self.multiplier
        else:
            self.waiting = 0
        return sample

    def answer(self, setpoint: Setpoint = NOTHING) -> bytes | None:
        """Make the answer to the last message; None if none is due.

        Raises:
            CommandRejected: the session lacks an output or a transformation of the setpoint.
        """
        sample = self.sample
        if not self.is_due or sample is None or self._answers is None:
            return None
        if not setpoint.is_plain:
            setpoint.check(sample.message)
        answer = self._answers.make(
            sample, setpoint, m.Header(self.sent, sample.sequence), state=self.state, mode=self.mode
        )
        if self._answers.missing:
            self._report(Kind.NO_IPO, self._answers.missing, self.received)
        self.sent = (self.sent + 1) % _WRAP
        self.waiting, self.is_due = 0, False
        self.counters.answered += 1
        if self.is_commanding:
            self.counters.commanded += 1
        return answer

    def answered(self, now: int) -> None:
        """Note that the answer was sent at `now` [ns]."""
        self.latency.add(now - self.received)

    # ------------------------------------------------------------------------------------------ receiving

    def _diagnose(self, error: MalformedMessage, datagram: bytes, now: int) -> None:
        """Report a datagram that is no message; keep the likely cause as `trouble` until the next message."""
        spoken = None if isinstance(error, ImplausibleMessage) else spoken_version(datagram)
        if spoken is None:
            self._report(Kind.MALFORMED, str(error), now)
            if isinstance(error, ImplausibleMessage):
                self.trouble = str(error)
            elif self.sample is None:
                self.trouble = f"{error}; {_NO_KNOWN_VERSION}"
            return
        trouble = str(error)
        expected = self._configured or self.version
        if "speaks FRI" not in trouble and expected is not None and spoken is not expected:
            trouble += (
                f"; likely cause: the controller speaks FRI {spoken.value}, this client is set to "
                f"{expected.value}"
            )
        if self.trouble != trouble:  # once, not in every cycle
            self.trouble = trouble
            self._report(Kind.WRONG_VERSION, trouble, now)

    def _check_plausible(self, sample: Sample, now: int) -> None:
        """Check what an answer may send back: positions and poses that the robot can have.

        Raises:
            ImplausibleMessage: it cannot; the text names the value.
        """
        if sample.q is not None and not math.isfinite(sum(sample.q)):
            raise ImplausibleMessage("FRI message: joint positions must be finite; the datagram is damaged")
        for axis, value in enumerate(sample.q or (), 1):
            if abs(value) > math.tau:
                raise ImplausibleMessage(
                    f"FRI message: the measured position of A{axis} must be in [-2π, 2π] rad, got {value:.4g} rad: "
                    "the datagram is damaged"
                )
        self._check_periods(sample, now)
        for name, values in (("interpolated", sample.q_ipo), ("commanded", sample.q_cmd)):
            if values is None:
                continue
            for axis, (value, low, high) in enumerate(zip(values, self.low, self.high, strict=True), 1):
                if not low <= value <= high:
                    raise ImplausibleMessage(
                        f"FRI message: the {name} position of A{axis} must be in [{low + OVERRUN:.4g}, "
                        f"{high - OVERRUN:.4g}] rad, got {value:.4g} rad: the datagram is damaged, or the client's "
                        "model is another robot"
                    )
        self._check_reach(sample, now)
        ipo = sample.message.ipo
        if (
            ipo is None or ipo.command_mode is not m.CommandMode.CARTESIAN_POSE
        ):  # only then is a pose sent back
            return
        if ipo.pose is not None:
            norm = math.sqrt(sum(value * value for value in ipo.pose.values[3:]))
            if not all(abs(value) <= MAX_COORDINATE for value in ipo.pose.values[:3]) or not (
                abs(norm - 1.0) <= MAX_NORM_ERROR
            ):
                raise ImplausibleMessage(
                    f"FRI message: the interpolated pose must be within {MAX_COORDINATE:g} mm with a quaternion of "
                    f"norm 1, got ({', '.join(f'{v:g}' for v in ipo.pose.values)}): the datagram is damaged"
                )
        if ipo.redundancy is not None and not abs(ipo.redundancy.value) <= math.tau:
            raise ImplausibleMessage(
                f"FRI message: the interpolated redundancy angle must be in [-2π, 2π] rad, got "
                f"{ipo.redundancy.value:.4g} rad: the datagram is damaged"
            )

    def _check_periods(self, sample: Sample, now: int) -> None:
        """Check the periods, which never change in a session."""
        link, last = sample.connection, self.sample
        if link is None:
            return
        for name, unit, value in (
            ("send period", " ms", link.period_ms),
            ("receive multiplier", "", link.multiplier),
        ):
            if value is not None and value > 100:
                raise ImplausibleMessage(
                    f"FRI message: the {name} must be in [1, 100]{unit}, got {value}{unit}: the datagram is damaged"
                )
        idle = m.SessionState.IDLE
        if last is None or idle in (self.state, link.state) or now - self.received > MAX_GAP:
            return
        if (sample.sequence - last.sequence) % _WRAP >= _WRAP // 2:
            return
        period, multiplier = link.period_ms or 0, max(1, link.multiplier or 1)
        if (period * 1_000_000, multiplier) != (self.period, self.multiplier):
            raise ImplausibleMessage(
                f"FRI message: the session has {self.period // 1_000_000} ms and {self.multiplier} messages per "
                f"answer, got {period} ms and {multiplier}: the datagram is damaged"
            )

    def _check_reach(self, sample: Sample, now: int) -> None:
        """Check that the interpolator can have moved so far since the last message in which commands count."""
        last, link, ipo = self.sample, sample.connection, sample.q_ipo
        if last is None or last.q_ipo is None or ipo is None or link is None:
            return
        waiting, steps = m.SessionState.COMMANDING_WAIT, (sample.sequence - last.sequence) % _WRAP
        if not (self.state is link.state is waiting) or steps >= _WRAP // 2:
            return
        elapsed = now - self.received
        if steps <= 1000:
            elapsed = max(elapsed, steps * self.period)
        time = 1e-9 * (elapsed + self.period)
        for axis, (new, old, fastest) in enumerate(zip(ipo, last.q_ipo, self.fastest, strict=True), 1):
            if abs(new - old) > 1.5 * fastest * time + 0.01:
                raise ImplausibleMessage(
                    f"FRI message: the interpolated position of A{axis} moved by {abs(new - old):.4g} rad within "
                    f"{time:.4g} s, which no axis can: the datagram is damaged"
                )

    def _read(self, datagram: bytes, now: int) -> Sample:
        if self.version is None:
            sample = self._begin(datagram, now)
        else:
            try:
                sample = sample_of(datagram, self.version)
            except MalformedMessage:
                # the controller may have started another application with another version
                if self._configured is not None or recognise(datagram) is self.version:
                    raise
                sample = self._begin(datagram, now)
        self._check_plausible(sample, now)
        return sample

    def _begin(self, datagram: bytes, now: int) -> Sample:
        """Read the first datagram; find or check its version."""
        version = recognise(datagram) if self._configured is None else self._configured
        sample = sample_of(datagram, version)
        full = sample.message
        monitor, ipo = full.monitor or m.MonitorData(), full.ipo or m.IpoData()
        spoken = None
        if version.traits.quaternions and monitor.q_cmd is not None:
            spoken = "1.x"
        elif not version.traits.quaternions and (monitor.pose or monitor.redundancy or ipo.pose):
            spoken = "2.5"
        if spoken is not None:
            raise MalformedMessage(
                f"the controller speaks FRI {spoken}, this client is set to {version.value}: "
                "set the client to the controller's version, or leave the version out to recognise it"
            )
        if version is not self.version:
            self._report(Kind.VERSION, f"the controller speaks FRI {version.value}", now)
        self.version, self._answers = version, Answers(version)
        return sample

    def _count(self, sample: Sample, now: int) -> bool:
        """Whether a message is newer than the last; count lost, duplicated and reordered ones."""
        counts, last = self.counters, self.sample
        counts.received += 1
        if last is None:
            return True
        step = (sample.sequence - last.sequence) % _WRAP
        interval = now - self.received
        if step == 0 and interval < MAX_GAP:
            counts.duplicated += 1
            self._report(Kind.DUPLICATED, f"message {sample.sequence} received twice", now)
            return False
        if 0 < step < _WRAP // 2:
            if step > 1:
                counts.lost += step - 1
                self._report(Kind.LOST, f"{step - 1} messages before {sample.sequence} are lost", now)
            if self.period and step <= MAX_REORDERED:
                self.jitter.add(abs(interval - step * self.period))
            return True
        if _WRAP - step <= MAX_REORDERED and interval < MAX_GAP and self.state is not m.SessionState.IDLE:
            counts.reordered += 1
            counts.lost = max(0, counts.lost - 1)
            self._report(Kind.REORDERED, f"message {sample.sequence} received after {last.sequence}", now)
            return False
        counts.restarts += 1
        self.reflected, self.waiting = self.sent - 1, 0
        self._report(
            Kind.RESTARTED, f"the controller's counter restarts at {sample.sequence}: a new session", now
        )
        self._enter(m.SessionState.IDLE, now)
        return True

    def _enter(self, state: m.SessionState, now: int) -> None:
        if state is not self.state:
            self._report(Kind.STATE, f"{self.state.name} -> {state.name}", now)
            self.state = state

    def _detect_changes(self, sample: Sample, now: int) -> None:
        """Detect a change of command mode or safety state, and answers that the controller missed."""
        reflected = sample.message.header.reflected
        if self.reflected < reflected <= self.sent:
            self.counters.missed += reflected - self.reflected - 1
            self.reflected = reflected
        safety = sample.robot.safety if sample.robot is not None else None
        if safety is not self._safety:
            if safety is not None and (self._safety is not None or safety is not m.Safety.NORMAL_OPERATION):
                self._report(Kind.SAFETY, f"safety state {safety.name}", now)
            self._safety = safety
        ipo = sample.message.ipo
        mode = (ipo.command_mode if ipo is not None else None) or m.CommandMode.NO_COMMAND
        if mode is not self.mode:
            self._report(Kind.COMMAND_MODE, f"client command mode {self.mode.name} -> {mode.name}", now)
            self.mode = mode

    def _report(self, kind: Kind, text: str, now: int) -> None:
        self.publish(Event(kind, text, now))
