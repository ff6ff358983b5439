"""Datagrams of a link: targets, stops and pings go up, states come down; TCP remains beside them.

Whether datagrams get through is measured, not assumed: pings go up all the time, and as long as their answers come,
targets need no copy over TCP. Whatever the network does to a datagram, the link goes on.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, nan
from statistics import median

from heptarm.arm.link.arrivals import Arrivals
from heptarm.arm.link.heartbeat import Heartbeat
from heptarm.errors import ConnectionLost, HeptarmError
from heptarm.io.clock import Clock
from heptarm.io.transport import DatagramSocket
from heptarm.wire.clock_sync import PingDeparture
from heptarm.wire.codec import DecodeError
from heptarm.wire.datagrams import Datagrams
from heptarm.wire.messages import Message, OneWay, Ping, Pong, State

_log = logging.getLogger("heptarm.link")

#: Pause between two pings [s]: while targets are sent, and otherwise.
_BUSY, _IDLE = 0.02, 0.05
#: For this long after a target pings are frequent [ns].
_STREAMING = 500_000_000
#: Pause between two copies of a stop [s], and how many are sent at most.
_REPEAT, _COPIES = 0.02, 25
#: An older datagram of the cabinet is ignored [s of our clock].
_OLDEST = 1.0
#: Largest number of a target; they begin again at 0, which counts as newer than all.
_NUMBERS = 0xFFFFFFFF
#: Round trips that are kept.
_ROUND_TRIPS = 256


@dataclass(frozen=True, slots=True)
class DatagramReport:
    """How the datagrams of a link fare.

    Attributes:
        pings: sent so far.
        answers: how many of them were answered.
        round_trip: median of the last round trips [s]; NaN: no ping was answered.
        silence: time since the last answer [s]; infinite: none came.
        states: received by datagram.
        targets: sent by datagram.
        targets_over_tcp: how many of these were sent over TCP as well, because no recent ping was answered.
        ignored: received, but damaged, forged, repeated, late or overtaken.
    """

    pings: int
    answers: int
    round_trip: float
    silence: float
    states: int
    targets: int
    targets_over_tcp: int
    ignored: int

    @property
    def gets_through(self) -> bool:
        """Whether datagrams get through in both directions: a ping of the last second was answered."""
        return self.silence < 1.0


class DatagramLine:
    """Datagrams beside one link; a thread of its own receives them and sends pings.

    Args:
        socket: to the cabinet; closed with the line.
        codec: of the session.
        clock: this side's clock.
        arrivals: receives states and answers to pings.
        heartbeat: notes when the cabinet was heard.
    """

    def __init__(
        self,
        socket: DatagramSocket,
        codec: Datagrams,
        clock: Clock,
        *,
        arrivals: Arrivals,
        heartbeat: Heartbeat,
    ) -> None:
        self._socket = socket
        self._codec = codec
        self._clock = clock
        self._offset = arrivals.offset
        self._arrivals, self._heartbeat = arrivals, heartbeat
        self._answered: int | None = None
        self._last_target = clock.nanos() - _STREAMING
        self._targets = self._pings = self._answers = self._states = 0
        self._departure = PingDeparture()
        self._copied = 0
        self._round_trips: deque[int] = deque(maxlen=_ROUND_TRIPS)
        self._urgent: dict[int, tuple[Message, int]] = {}
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="heptarm-datagrams", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    # ------------------------------------------------------------------------------------ sending

    def send_target(self, kind: type[OneWay], numbers: Iterable[float], *, now: int) -> int:
        """Send a servo target; returns its number in the session.

        Args:
            kind: its type.
            numbers: its fields in order.
            now: our clock [ns].
        """
        self._last_target = now
        self._targets += 1
        number = self._targets & _NUMBERS
        time = self._offset.to_cabinet(now)
        self._socket.send(self._codec.pack_numbers(kind, numbers, time=time, number=number))
        return number

    def needs_copy(self, now: int, silence: float) -> bool:
        """Whether a target has to go over TCP as well: no ping was answered for this long [s]."""
        if self._answered is not None and now - self._answered <= silence * 1e9:
            return False
        self._copied += 1
        return True

    def repeat(self, message: Message, request: int) -> None:
        """Send a Stop or a Cancel now, and again until `answered`; it goes over TCP as well.

        Args:
            message: the request.
            request: its id.
        """
        self._send(message, request)
        self._urgent[request] = (message, _COPIES)

    def answered(self, request: int) -> None:
        """Send no more copies of a request."""
        self._urgent.pop(request, None)

    def _send(self, message: Message, request: int = 0) -> None:
        now = self._clock.nanos()
        self._socket.send(self._codec.pack(message, time=self._offset.to_cabinet(now), request=request))

    def _ping(self, now: int) -> None:
        """Send a ping."""
        data = self._codec.pack(Ping(sent=now), time=self._offset.to_cabinet(now))
        self._departure = PingDeparture(now, self._clock.nanos())
        self._socket.send(data)

    # ---------------------------------------------------------------------------------- receiving

    def _run(self) -> None:
        clock = self._clock
        due = again = clock.nanos()
        while not self._closed:
            try:
                now = clock.nanos()
                if now >= due:
                    self._pings += 1
                    self._ping(now)
                    is_busy = now - self._last_target < _STREAMING
                    due = now + round((_BUSY if is_busy else _IDLE) * 1e9)
                if self._urgent and now >= again:
                    self._send_again()
                    again = now + round(_REPEAT * 1e9)
                data = self._socket.receive(((min(due, again) if self._urgent else due) - now) * 1e-9)
                if data is not None:
                    self._receive(data, clock.nanos())
            except ConnectionLost:
                return
            except HeptarmError as error:
                _log.warning("no more datagrams are sent: %s", error)
                return
            except Exception:  # whatever it is, TCP remains
                _log.exception("unexpected error in the datagrams of the link")
                clock.sleep(_IDLE)

    def _send_again(self) -> None:
        for request, (message, left) in list(self._urgent.items()):
            self._send(message, request)
            if left > 1 and request in self._urgent:
                self._urgent[request] = (message, left - 1)
            else:
                self.answered(request)

    def _receive(self, data: bytes, now: int) -> None:
        offset = self._offset
        limit = round(_OLDEST * max(offset.rate, 1.0) * 1e9)
        frame = self._codec.receive(data, now=offset.to_cabinet(now), limit=limit)
        if frame is None:
            return
        self._heartbeat.datagram = now
        if frame.type == State.TYPE:
            self._states += 1
            self._arrivals.state(frame.body, frame.time, now)
            return
        try:
            if frame.type == Ping.TYPE:
                self._send(Pong(sent=Ping.decode(frame.body).sent, received=offset.to_cabinet(now)))
            elif frame.type == Pong.TYPE:
                pong = Pong.decode(frame.body)
                self._answers += 1
                self._answered = now
                sent = self._departure.of(pong.sent)
                self._round_trips.append(now - sent)
                self._arrivals.pong(sent, pong.received, now)
        except DecodeError:
            self._codec.ignored.damaged += 1

    # --------------------------------------------------------------------------------- the report

    @property
    def report(self) -> DatagramReport:
        """How the datagrams fare so far."""
        trips, last = list(self._round_trips), self._answered
        counts = self._codec.ignored
        return DatagramReport(
            pings=self._pings,
            answers=self._answers,
            round_trip=median(trips) * 1e-9 if trips else nan,
            silence=inf if last is None else (self._clock.nanos() - last) * 1e-9,
            states=self._states,
            targets=self._targets,
            targets_over_tcp=self._copied,
            ignored=counts.old + counts.late + counts.forged + counts.damaged,
        )

    def close(self) -> None:
        """End the line; its thread ends within one pause between pings. Calling it again has no effect."""
        self._closed = True
        self._socket.close()

    def join(self) -> None:
        """Wait for the end of the thread after `close`."""
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(1.0)

    def abandon(self) -> None:
        """Give up the copy that a fork of the process has, whose thread does not exist."""
        self._closed = True
        self._socket.close()
