"""The controller side of one FRI session, sans IO: datagrams and time in, datagrams, set-points and events out.

::

    IDLE --open--> MONITORING_WAIT <--quality--> MONITORING_READY
                                                        |  start, after `SETTLED` answers' time
                                                 COMMANDING_WAIT --mirrored--> COMMANDING_ACTIVE

A client sees every state in several messages, whatever the period: clients set themselves up when a state begins.
The overlay ends, and with it both commanding states, when the application stops it, the quality falls below GOOD, a
command is illegal, the client does not synchronise, or a safety stop occurs; the session then monitors again. `close`
returns to IDLE from every state, with one last message that reports it.

Times are nanoseconds on any clock, the same for all calls.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import isfinite

import numpy as np

from heptarm.errors import ModeConflict, Unreachable
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import decode_command
from heptarm.fri.protocol.protobuf import MalformedMessage
from heptarm.fri.protocol.version import Version, is_framed
from heptarm.planning.seam import TICK_NS
from heptarm.sim.control_laws.laws import Superposition
from heptarm.sim.fri import cartesian
from heptarm.sim.fri.io import SessionIo
from heptarm.sim.fri.limits import COAST, CommandInterpolator, CommandLimits
from heptarm.sim.fri.monitoring import MonitoringEncoder, SessionStatus, report
from heptarm.sim.fri.overlay import MotionOverlay, Reading, missing
from heptarm.sim.fri.quality import QualityMeter
from heptarm.sim.fri.settings import (
    Event,
    OverlayEnded,
    QualityChanged,
    Refused,
    SessionConfiguration,
    StateChanged,
)
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Receive periods for which a session is in MONITORING_READY before an overlay takes it on.
SETTLED = 5
#: Successive answers that have to mirror the position before commands are executed.
MIRRORED = 10
#: Largest deviation of a mirrored position [rad; m and rad].
MIRROR = 1e-3
#: Time limit of the synchronisation [ns].
SYNCHRONISATION = 3_000_000_000

#: So many unreadable datagrams, and not a readable one, mean a client of another version.
FOREIGN = 5
#: Number of sent messages that an answer may refer to.
KEPT = 512
#: Largest number of different refusals that a session reports.
MOST_REFUSALS = 20

_WORD = 0xFFFFFFFF


@dataclass(slots=True)
class _SentMessage:
    """A sent message: time, tick and session state; what the client has to mirror, while the session waits for that."""

    at: int
    tick: int
    state: m.SessionState
    monitor: m.MonitorData | None
    ipo: m.IpoData | None


@dataclass(slots=True)
class DatagramCounts:
    """Datagrams of a session: sent, accepted as answers, too old (or duplicates), refused."""

    sent: int = 0
    taken: int = 0
    stale: int = 0
    refused: int = 0


def _likely_cause(trouble: str, datagram: bytes, version: Version) -> str:
    """What to add to the trouble with an answer that another version could read; otherwise empty."""
    if "speaks FRI" in trouble:
        return ""
    for other in (Version.V1_15, Version.V2_5, Version.V2_7):
        if other is version:
            continue
        try:
            decode_command(datagram, other)
        except MalformedMessage:
            continue
        return f"; likely cause: the client speaks FRI {other.value}, this cabinet FRI {version.value}"
    return ""


class Controller:
    """The controller side of one session.

    Args:
        configuration: as the application set it up.
        robot: its limits hold.
        epoch_ns: UNIX time of the clock's zero, for the time stamps of messages [ns].
        command_delay: of the client's commands, beyond their interpolation [ticks].

    Attributes:
        state: of the session.
        overlay: active, or waiting for synchronisation; None without one.
        superposition: overlay of the next tick; None unless commanding is active.
        meter: quality of the connection, its counts, latency and jitter.
        traffic: counts of datagrams.
        exchange: signals and frames.
        said: the last message; None before the first one.
    """

    def __init__(
        self,
        configuration: SessionConfiguration,
        robot: RobotModel,
        *,
        epoch_ns: int = 0,
        command_delay: int = 0,
    ) -> None:
        self.configuration = configuration
        self.state = m.SessionState.IDLE
        self.overlay: MotionOverlay | None = None
        self.superposition: Superposition | None = None
        self.meter = QualityMeter(configuration.receive_ms * TICK_NS)
        self.traffic = DatagramCounts()
        self.exchange = SessionIo(configuration)
        self.said: m.Monitoring | None = None
        self._writer = MonitoringEncoder(configuration.version)
        self._robot = robot
        self._epoch = epoch_ns
        self._events: deque[Event] = deque(maxlen=1000)
        self._reported: set[str] = set()
        self._ticks = 0
        self._farewell = False
        self._used = False
        self._ready = 0  # receive periods in MONITORING_READY
        self._next = 0  # number of the next message
        self._asked: list[_SentMessage | None] = [None] * KEPT
        self._heard = -1  # number of the newest answered message
        self._reflected = 0  # the client's counter in its newest answer
        self._since: int | None = None  # start of the synchronisation
        self._mirrored = 0
        self._mirrors: Array | None = None  # joints of the newest mirrored command
        self._fault = ""  # why the client is not synchronised
        self._limits: CommandLimits | None = None
        self._set_point: CommandInterpolator | None = None
        self._late: deque[Superposition] = deque(maxlen=command_delay + 1)
        self._last: Array | None = None  # joints of the newest command
        self._last_number = 0
        self._a3 = 0.0
        self._tau: Array | None = None
        self._wrench: Array | None = None

    @property
    def quality(self) -> m.Quality:
        """Quality of the connection."""
        return self.meter.quality

    def open(self) -> None:
        """Open the session and start to send.

        Raises:
            ModeConflict: it was opened before.
        """
        if self._used:
            raise ModeConflict(
                "an FRI session can be opened only once", parameter="session", hint="create a new session"
            )
        self._used = True
        self._go(m.SessionState.MONITORING_WAIT)

    def close(self) -> None:
        """End the session from any state; the next tick sends the last message. Does nothing in IDLE."""
        if self.state is m.SessionState.IDLE:
            return
        self._end("closed", "")
        self._go(m.SessionState.IDLE)
        self._farewell = True

    def start(self, overlay: MotionOverlay) -> None:
        """Start an overlay with its motion: wait for the client to synchronise.

        The session stays in MONITORING_READY for `SETTLED` receive periods at least.

        Raises:
            CommandRejected: this session cannot have such an overlay.
            ModeConflict: command and control mode do not match, or the session is not ready.
        """
        overlay.check(self.configuration)
        if self.state is not m.SessionState.MONITORING_READY or self.overlay is not None:
            raise ModeConflict(
                f"FRI session in {self.state.name} with quality {self.quality.name}"
                + (
                    "; an overlay needs MONITORING_READY"
                    if self.overlay is None
                    else " and an overlay already"
                ),
                parameter="overlay",
                hint="wait until the client answers well enough"
                if self.overlay is None
                else "one overlay at a time",
            )
        self.overlay = overlay
        self._limits = CommandLimits(self._robot, overlay.mode)
        self._since, self._mirrored, self._fault = None, 0, "it has not answered yet"
        self._mirrors = None

    def stop(self) -> None:
        """End the overlay after its motion; does nothing without an overlay."""
        self._end("cancelled", "")

    def events(self) -> list[Event]:
        """Events since the last call, oldest first."""
        events = list(self._events)
        self._events.clear()
        return events

    def receive(self, datagram: bytes, now: int) -> None:
        """Take a datagram of the client that arrived at `now` [ns]; a refusal is reported as an event."""
        if self.state is m.SessionState.IDLE:
            self.traffic.stale += 1
            return
        try:
            command = decode_command(datagram, self.configuration.version)
        except MalformedMessage as error:
            self._refuse(error.text + _likely_cause(error.text, datagram, self.configuration.version))
            if self.traffic.refused >= FOREIGN and not self.traffic.taken:
                self._report_refusal(self._foreign(datagram))
            return
        age = (self._next - 1 - command.header.reflected) & _WORD
        number = self._next - 1 - age
        asked = self._asked[number % KEPT] if age < KEPT and number >= 0 else None
        if asked is None:
            self._refuse("an answer to a message that this session did not send, or sent too long ago")
            return
        fresh = self.meter.answered(number // self.configuration.multiplier, now - asked.at)
        if number <= self._heard:
            self.traffic.stale += 1  # overtaken by a newer one, or a duplicate
            return
        self._heard, self._reflected = number, command.header.sequence
        self.traffic.taken += fresh
        for event in self.exchange.take(command):
            if isinstance(event, Refused):
                self._report_refusal(event.text)
            else:
                self._events.append(event)
        if asked.state is self.state:
            if self.state is m.SessionState.COMMANDING_WAIT:
                self._synchronise(command, asked)
            elif self.state is m.SessionState.COMMANDING_ACTIVE:
                self._execute(command, number, late=self._ticks - asked.tick)

    def _foreign(self, datagram: bytes) -> str:
        """What a client is that no message can be read of."""
        version = self.configuration.version
        if version.traits.framed:
            other = "1.x or 2.5"
        else:
            other = (
                Version.V2_7.value
                if is_framed(datagram)
                else "2.x"
                if not version.traits.quaternions
                else "1.x"
            )
        return f"nothing the client sends can be read as FRI {version.value}; is it built for {other}?"

    def _refuse(self, text: str) -> None:
        self.traffic.refused += 1
        self._report_refusal(text)

    def _report_refusal(self, text: str) -> None:
        if text not in self._reported and len(self._reported) < MOST_REFUSALS:
            self._reported.add(text)
            self._events.append(Refused(text))

    def _synchronise(self, command: m.Command, asked: _SentMessage) -> None:
        assert self.overlay is not None
        lacks = missing(self.overlay.mode, command)
        self._fault = f"its answers carry no {lacks}" if lacks else self._deviation(command, asked)
        self._mirrored = 0 if self._fault else self._mirrored + 1

    def _deviation(self, command: m.Command, asked: _SentMessage) -> str:
        """How a command differs from the positions of which it has to mirror one; empty if it does not.

        Clients mirror the interpolator's position or, as some do, the measured one, which differs from it where the
        arm is compliant.
        """
        ipo, monitor = asked.ipo, asked.monitor
        assert ipo is not None and ipo.q is not None and monitor is not None and monitor.q is not None
        if ipo.pose is not None and command.pose is not None:
            try:
                pose = cartesian.matrix(command.pose)
            except ValueError as error:
                return str(error)
            gap, turn = cartesian.distance(pose, cartesian.matrix(ipo.pose))
            if max(gap, turn) <= MIRROR:
                self._mirrors = np.array(ipo.q)
                return ""
            if monitor.pose and max(cartesian.distance(pose, cartesian.matrix(monitor.pose))) <= MIRROR:
                self._mirrors = np.array(monitor.q)
                return ""
            return f"its pose is {1e3 * gap:.1f} mm and {np.degrees(turn):.2f} deg off the interpolator's"
        q = np.array(command.q)
        delta = np.abs(q - np.array(ipo.q))
        if not (delta <= MIRROR).all() and not (np.abs(q - np.array(monitor.q)) <= MIRROR).all():
            axis = int(np.argmax(~(delta <= MIRROR)))  # a NaN is not equal
            return f"its A{axis + 1} is {np.degrees(delta[axis]):.2f} deg off the interpolator's"
        self._mirrors = q
        return ""

    def _execute(self, command: m.Command, number: int, *, late: int) -> None:
        """Execute a command, so many ticks late; an illegal one ends the overlay."""
        assert self.overlay is not None and self._limits is not None
        assert self._set_point is not None and self._last is not None
        lacks = missing(self.overlay.mode, command)
        if lacks:
            self._end("field", f"Illegal command: no {lacks} in command mode {self.overlay.mode.name}")
            return
        ticks = (number - self._last_number) * self.configuration.period_ms
        try:
            q, wrong = self._joints(command), ""
        except (ValueError, Unreachable) as error:
            q, wrong = self._last, f"Illegal Cartesian pose: {error}"
        wrong = wrong or self._limits.position(q, self._last, ticks)
        tau = wrench = None
        if self.overlay.mode is m.CommandMode.TORQUE:
            tau = np.array(command.tau)
            wrong = wrong or self._limits.torque(tau)
        elif self.overlay.mode is m.CommandMode.WRENCH:
            wrench = np.array(command.wrench)
            wrong = wrong or self._limits.wrench(wrench)
        if wrong:
            self._end("limit", wrong)
            return
        self._tau, self._wrench = tau, wrench
        self._last, self._last_number = q, number
        self._set_point.command(q, after=ticks, late=late)

    def _joints(self, command: m.Command) -> Array:
        assert self._last is not None
        if command.pose is None or self.overlay is None or self.overlay.kind is m.Overlay.JOINT:
            return np.array(command.q)
        if command.redundancy is not None and command.redundancy.strategy is m.RedundancyStrategy.E1:
            if not isfinite(command.redundancy.value):
                raise ValueError("its redundancy value must be finite")
            self._a3 = command.redundancy.value
        return cartesian.joints(self._robot, cartesian.matrix(command.pose), self._a3, self._last)

    def tick(self, reading: Reading, now: int) -> bytes | None:
        """Advance by one millisecond of plant time at `now` [ns]; returns the datagram to send, if one is due."""
        if self.state is m.SessionState.IDLE:
            farewell, self._farewell = self._farewell, False
            return self._message(reading, now) if farewell else None
        self._rate(now)
        if self.overlay is not None:
            self._advance_overlay(reading, now)
        self.superposition = self._superpose(reading)
        due = self._ticks % self.configuration.period_ms == 0
        self._ticks += 1
        return self._message(reading, now) if due else None

    def _rate(self, now: int) -> None:
        before = self.meter.quality
        quality = self.meter.advance(now)
        if quality is not before:
            latency, jitter = self.meter.latency_ns * 1e-9, self.meter.jitter_ns * 1e-9
            self._events.append(QualityChanged(quality, before, latency, jitter))
        enough = quality >= m.Quality.GOOD
        if self.overlay is not None:
            if not enough:
                counts = self.meter.counts
                self._end(
                    "quality",
                    f"FRI connection quality is {quality.name}, possible connection problem: {counts.on_time} answers "
                    f"on time so far, {counts.late} late, {counts.lost} lost",
                )
        elif enough != (self.state is m.SessionState.MONITORING_READY):
            self._go(m.SessionState.MONITORING_READY if enough else m.SessionState.MONITORING_WAIT)

    def _advance_overlay(self, reading: Reading, now: int) -> None:
        """Activate a synchronised overlay, or end one."""
        if reading.safety is not m.Safety.NORMAL_OPERATION:
            self._end("safety", f"a {_STOPS[reading.safety]} ended the FRI overlay")
        elif self.state is m.SessionState.MONITORING_READY:
            if self._ready >= SETTLED:
                self._go(m.SessionState.COMMANDING_WAIT)
        elif self.state is m.SessionState.COMMANDING_WAIT:
            if self._since is None:
                self._since = now
            if self._mirrored >= MIRRORED:
                self._activate(reading)
            elif now - self._since >= SYNCHRONISATION:
                self._end(
                    "synchronisation",
                    f"the FRI client did not synchronise within {SYNCHRONISATION / 1e9:g} s: {self._fault}",
                )

    def _activate(self, reading: Reading) -> None:
        start = np.array(reading.q_ipo)
        self._set_point = CommandInterpolator(self._robot, start, ticks=self.configuration.receive_ms)
        # the client's commands continue what it mirrored
        self._last = start if self._mirrors is None else self._mirrors
        self._last_number = self._heard
        self._a3 = reading.q_ipo[2]
        self._tau = self._wrench = None
        self._late.clear()
        self._go(m.SessionState.COMMANDING_ACTIVE)

    def _superpose(self, reading: Reading) -> Superposition | None:
        set_point = self._set_point
        if self.state is not m.SessionState.COMMANDING_ACTIVE or set_point is None:
            return None
        q = set_point.tick()
        if self._tau is None and self._wrench is None:
            return self._delayed(Superposition(q))
        if set_point.age <= max(COAST, 2 * self.configuration.receive_ms):
            return self._delayed(Superposition(q, self._tau, self._wrench))
        set_point.stay(np.array(reading.q))  # the load would push forever
        self._late.clear()
        return Superposition(q, is_missing=True)

    def _delayed(self, action: Superposition) -> Superposition:
        """What was commanded before the delay; the first action while there is nothing older."""
        self._late.append(action)
        return self._late[0]

    def _end(self, cause: str, text: str) -> None:
        if self.overlay is None:
            return
        self.overlay = self.superposition = self._set_point = None
        self._events.append(OverlayEnded(cause, text))
        enough = self.quality >= m.Quality.GOOD
        after = m.SessionState.MONITORING_READY if enough else m.SessionState.MONITORING_WAIT
        if after is not self.state:
            self._go(after)

    def _go(self, state: m.SessionState) -> None:
        self._events.append(StateChanged(state, self.state))
        self.state = state
        self._ready = 0

    def _message(self, reading: Reading, now: int) -> bytes:
        configuration = self.configuration
        number, self._next = self._next, self._next + 1
        stamp = m.TimeStamp(*divmod(self._epoch + now, 1_000_000_000))
        active = self.state is m.SessionState.COMMANDING_ACTIVE
        message = report(
            reading,
            header=m.Header(number & _WORD, self._reflected & _WORD),
            stamp=stamp,
            status=SessionStatus(
                self.state,
                self.quality,
                self.overlay if active or self.state is m.SessionState.COMMANDING_WAIT else None,
                self.meter.fraction if active else None,
            ),
            configuration=configuration,
            robot=self._robot,
            signals=tuple(self.exchange.signals.values()),
            requested=self.exchange.requested(stamp),
        )
        waits = self.state is m.SessionState.COMMANDING_WAIT
        self._asked[number % KEPT] = _SentMessage(  # what is kept without a need is searched for garbage, too
            now, self._ticks, self.state, message.monitor if waits else None, message.ipo if waits else None
        )
        if self.state is not m.SessionState.IDLE and number % configuration.multiplier == 0:
            self.meter.asked(number // configuration.multiplier, now)
            self._ready += self.state is m.SessionState.MONITORING_READY
        self.traffic.sent += 1
        self.said = message
        return self._writer.encode(message)


_STOPS = {
    m.Safety.STOP_0: "safety stop 0 or 1",
    m.Safety.STOP_1: "safety stop 1 on path",
    m.Safety.STOP_2: "safety stop 2",
}
