"""One FRI session as the cabinet leads it, sans IO: datagrams and time in, datagrams, set-points and events out.

::

    IDLE --open--> MONITORING_WAIT <--quality--> MONITORING_READY
                                                        |  start
                                                 COMMANDING_WAIT --mirrored--> COMMANDING_ACTIVE

The overlay ends, and with it both commanding states, when the application stops it, the quality falls below GOOD, a
command is illegal, the client does not synchronise, or a safety stop comes; the session then monitors again. `close`
leads to IDLE from everywhere, with one last message that says so.

Times are nanoseconds on any clock, the same for all calls.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import isfinite

import numpy as np

from heptarm.errors import ModeConflict, Unreachable
from heptarm.fri import messages as m
from heptarm.fri.codec import decode_command
from heptarm.fri.protobuf import MalformedMessage
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri import cartesian
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.events import Event, OverlayEnded, QualityChanged, Refused, StateChanged
from heptarm.virtual.fri.exchange import Exchange
from heptarm.virtual.fri.limits import Limits
from heptarm.virtual.fri.overlay import MotionOverlay, Reading, Superposition, missing
from heptarm.virtual.fri.quality import Meter
from heptarm.virtual.fri.report import Status, report
from heptarm.virtual.fri.setpoint import COAST, SetPoint
from heptarm.virtual.fri.writer import Writer
from heptarm.virtual.tick import TICK_NS

#: Answers in a row that mirror the interpolator before commands are carried out.
MIRRORED = 10
#: What counts as mirrored [rad; m and rad].
MIRROR = 1e-3
#: A client that has not synchronised after so long will not [ns].
SYNCHRONISATION = 3_000_000_000

#: Messages that are remembered until they are answered.
KEPT = 512
#: Different reasons to refuse that are told in one session.
TOLD = 20

_WORD = 0xFFFFFFFF


@dataclass(slots=True)
class _Asked:
    """A message that was sent, and what it said."""

    at: int
    state: m.SessionState
    ipo: m.IpoData | None


@dataclass(slots=True)
class Traffic:
    """Datagrams of a session: sent, taken as answers, too old (duplicates among them), refused."""

    sent: int = 0
    taken: int = 0
    stale: int = 0
    refused: int = 0


class Controller:
    """The cabinet's side of one session.

    Args:
        configuration: as the application set it up.
        robot: whose limits hold.
        epoch_ns: what the stamps of messages are counted from, UNIX time of the clock's zero [ns].

    Attributes:
        state: of the session.
        overlay: in force or waiting to be; None without one.
        superposition: what the arm does in the next tick; None unless commanding is active.
        meter: quality of the connection, its counts, latency and jitter.
        traffic: counts of datagrams.
        exchange: signals and frames.
    """

    def __init__(self, configuration: Configuration, robot: RobotModel, *, epoch_ns: int = 0) -> None:
        self.configuration = configuration
        self.state = m.SessionState.IDLE
        self.overlay: MotionOverlay | None = None
        self.superposition: Superposition | None = None
        self.meter = Meter(configuration.receive_ms * TICK_NS)
        self.traffic = Traffic()
        self.exchange = Exchange(configuration)
        self._writer = Writer(configuration.version)
        self._robot = robot
        self._epoch = epoch_ns
        self._events: deque[Event] = deque(maxlen=1000)
        self._told: set[str] = set()
        self._ticks = 0
        self._farewell = False
        self._used = False
        self._next = 0  # number of the next message
        self._asked: list[_Asked | None] = [None] * KEPT
        self._heard = -1  # number of the newest message that was answered
        self._reflected = 0  # the client's counter in its newest answer
        self._since: int | None = None  # when synchronising began
        self._mirrored = 0
        self._fault = ""  # why the client is not synchronised
        self._limits: Limits | None = None
        self._set_point: SetPoint | None = None
        self._last: Array | None = None  # joints of the newest command
        self._last_number = 0
        self._a3 = 0.0
        self._tau: Array | None = None
        self._wrench: Array | None = None

    # ------------------------------------------------------------------------------ the application

    @property
    def quality(self) -> m.Quality:
        """Quality of the connection."""
        return self.meter.quality

    def open(self) -> None:
        """Begin to send.

        Raises:
            ModeConflict: it was open before; a session is opened once.
        """
        if self._used:
            raise ModeConflict(
                "an FRI session is opened once", parameter="session", hint="make another controller"
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
        """The motion with the overlay begins: wait for the client to synchronise.

        Raises:
            CommandRejected: this session cannot have such an overlay.
            ModeConflict: command and control mode do not match, or the session is not ready.
        """
        overlay.check(self.configuration)
        if self.state is not m.SessionState.MONITORING_READY:
            raise ModeConflict(
                f"FRI session in {self.state.name} with quality {self.quality.name}; "
                "an overlay needs MONITORING_READY",
                parameter="overlay",
                hint="wait until the client answers well enough"
                if self.overlay is None
                else "one overlay at a time",
            )
        self.overlay = overlay
        self._limits = Limits(self._robot, overlay.mode)
        self._since, self._mirrored, self._fault = None, 0, "it has not answered yet"
        self._go(m.SessionState.COMMANDING_WAIT)

    def stop(self) -> None:
        """The motion under the overlay has ended or was cancelled; does nothing without an overlay."""
        self._end("cancelled", "")

    def events(self) -> list[Event]:
        """What has happened since the last call, oldest first."""
        events = list(self._events)
        self._events.clear()
        return events

    # ------------------------------------------------------------------------------ the client

    def receive(self, datagram: bytes, now: int) -> None:
        """Take a datagram of the client that arrived at `now` [ns]; what is wrong with it is told by an event."""
        if self.state is m.SessionState.IDLE:
            self.traffic.stale += 1
            return
        try:
            command = decode_command(datagram, self.configuration.version)
        except MalformedMessage as error:
            self._refuse(error.text)
            return
        age = (self._next - 1 - command.header.reflected) & _WORD
        number = self._next - 1 - age
        asked = self._asked[number % KEPT] if age < KEPT and number >= 0 else None
        if asked is None:
            self._refuse("an answer to a message that this session has not sent, or long ago")
            return
        fresh = self.meter.answered(number // self.configuration.multiplier, now - asked.at)
        if number <= self._heard:
            self.traffic.stale += 1  # overtaken by a newer one, or a duplicate
            return
        self._heard, self._reflected = number, command.header.sequence
        self.traffic.taken += fresh
        for event in self.exchange.take(command):
            if isinstance(event, Refused):
                self._tell(event.text)
            else:
                self._events.append(event)
        if asked.state is self.state:
            if self.state is m.SessionState.COMMANDING_WAIT:
                self._synchronise(command, asked)
            elif self.state is m.SessionState.COMMANDING_ACTIVE:
                self._obey(command, number)

    def _refuse(self, text: str) -> None:
        self.traffic.refused += 1
        self._tell(text)

    def _tell(self, text: str) -> None:
        if text not in self._told and len(self._told) < TOLD:
            self._told.add(text)
            self._events.append(Refused(text))

    def _synchronise(self, command: m.Command, asked: _Asked) -> None:
        assert self.overlay is not None
        lacks = missing(self.overlay.mode, command)
        self._fault = f"its answers carry no {lacks}" if lacks else self._beside(command, asked)
        self._mirrored = 0 if self._fault else self._mirrored + 1

    def _beside(self, command: m.Command, asked: _Asked) -> str:
        """How a command differs from the interpolator's position that it answers; empty if it mirrors it."""
        ipo = asked.ipo
        assert ipo is not None and ipo.q is not None
        if ipo.pose is not None and command.pose is not None:
            try:
                way, turn = cartesian.apart(cartesian.matrix(command.pose), cartesian.matrix(ipo.pose))
            except ValueError as error:
                return str(error)
            if max(way, turn) <= MIRROR:
                return ""
            return f"its pose is {1e3 * way:.1f} mm and {np.degrees(turn):.2f} deg beside the interpolator's"
        delta = np.abs(np.array(command.q) - np.array(ipo.q))
        if (delta <= MIRROR).all():  # a NaN is not
            return ""
        axis = int(np.argmax(~(delta <= MIRROR)))
        return f"its A{axis + 1} is {np.degrees(delta[axis]):.2f} deg beside the interpolator's"

    def _obey(self, command: m.Command, number: int) -> None:
        """Take a command, or end the overlay by it."""
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
        self._set_point.command(q, after=ticks)

    def _joints(self, command: m.Command) -> Array:
        assert self._last is not None
        if command.pose is None or self.overlay is None or self.overlay.kind is m.Overlay.JOINT:
            return np.array(command.q)
        if command.redundancy is not None and command.redundancy.strategy is m.RedundancyStrategy.E1:
            if not isfinite(command.redundancy.value):
                raise ValueError("its redundancy is no finite number")
            self._a3 = command.redundancy.value
        return cartesian.joints(self._robot, cartesian.matrix(command.pose), self._a3, self._last)

    # ------------------------------------------------------------------------------ the tick

    def tick(self, reading: Reading, now: int) -> bytes | None:
        """One millisecond of the plant's time at `now` [ns]; returns the datagram to send, if one is due."""
        if self.state is m.SessionState.IDLE:
            farewell, self._farewell = self._farewell, False
            return self._message(reading, now) if farewell else None
        self._judge(now)
        if self.overlay is not None:
            self._lead(reading, now)
        self.superposition = self._superpose()
        due = self._ticks % self.configuration.period_ms == 0
        self._ticks += 1
        return self._message(reading, now) if due else None

    def _judge(self, now: int) -> None:
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

    def _lead(self, reading: Reading, now: int) -> None:
        """From waiting to active, or to the end of the overlay."""
        if reading.safety is not m.Safety.NORMAL_OPERATION:
            self._end("safety", f"the motion with the FRI overlay was ended by a {_STOPS[reading.safety]}")
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
        self._set_point = SetPoint(self._robot, start, ticks=self.configuration.receive_ms)
        self._last, self._last_number = start, self._heard
        self._a3 = reading.q_ipo[2]
        self._tau = self._wrench = None
        self._go(m.SessionState.COMMANDING_ACTIVE)

    def _superpose(self) -> Superposition | None:
        if self.state is not m.SessionState.COMMANDING_ACTIVE or self._set_point is None:
            return None
        q = self._set_point.tick()
        if self._set_point.age > max(COAST, 2 * self.configuration.receive_ms):
            self._tau = self._wrench = None  # a load that nobody renews would push for ever
        return Superposition(q, self._tau, self._wrench)

    def _end(self, cause: str, text: str) -> None:
        if self.overlay is None:
            return
        self.overlay = self.superposition = self._set_point = None
        self._events.append(OverlayEnded(cause, text))
        enough = self.quality >= m.Quality.GOOD
        self._go(m.SessionState.MONITORING_READY if enough else m.SessionState.MONITORING_WAIT)

    def _go(self, state: m.SessionState) -> None:
        self._events.append(StateChanged(state, self.state))
        self.state = state

    # ------------------------------------------------------------------------------ messages

    def _message(self, reading: Reading, now: int) -> bytes:
        configuration = self.configuration
        number, self._next = self._next, self._next + 1
        stamp = m.TimeStamp(*divmod(self._epoch + now, 1_000_000_000))
        active = self.state is m.SessionState.COMMANDING_ACTIVE
        message = report(
            reading,
            header=m.Header(number & _WORD, self._reflected & _WORD),
            stamp=stamp,
            status=Status(self.state, self.quality, self.overlay, self.meter.share if active else None),
            configuration=configuration,
            robot=self._robot,
            signals=tuple(self.exchange.signals.values()),
            requested=self.exchange.requested(stamp),
        )
        self._asked[number % KEPT] = _Asked(now, self.state, message.ipo)
        if self.state is not m.SessionState.IDLE and number % configuration.multiplier == 0:
            self.meter.asked(number // configuration.multiplier, now)
        self.traffic.sent += 1
        return self._writer.encode(message)


_STOPS = {
    m.Safety.STOP_0: "safety stop 0 or 1",
    m.Safety.STOP_1: "safety stop 1 on path",
    m.Safety.STOP_2: "safety stop 2",
}
