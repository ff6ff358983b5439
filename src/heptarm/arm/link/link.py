"""One session with a cabinet over one transport: requests and answers, events, states, heartbeat.

Whichever thread waits for an answer reads the socket itself, so that an answer wakes one thread, not two; so does a
loop over states at a high rate. The link thread reads while nobody waits, and sends pings.
"""

from __future__ import annotations

import logging
import signal
import threading
from _thread import allocate_lock, get_ident
from collections.abc import Callable, Iterable, Sequence
from types import FrameType
from typing import Any, TypeVar

from heptarm.arm.link.datagrams import DatagramLine, DatagramReport
from heptarm.arm.translate.errors import farewell, refusal, rejection
from heptarm.arm.translate.text import printable_message
from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    HeptarmError,
    RemoteProtocolError,
    Timeout,
)
from heptarm.io.clock import Clock
from heptarm.io.exchange import compiled_link
from heptarm.io.tcp import MSG_DONTWAIT
from heptarm.io.transport import Transport
from heptarm.record.journal import REFUSAL, REQUEST, Journal
from heptarm.wire.clock_sync import ClockOffset, PingDeparture
from heptarm.wire.codes import Code
from heptarm.wire.messages import (
    MAJOR,
    MINOR,
    Accepted,
    Cancel,
    Challenge,
    DatagramStatistics,
    DatagramToken,
    GetDatagramStatistics,
    Goodbye,
    Message,
    OneWay,
    OpenDatagrams,
    Ping,
    Pong,
    Refusal,
    Rejected,
    State,
    Stop,
    Welcome,
)
from heptarm.wire.session import Received, Session, Side, StateReceived
from heptarm.wire.states import SessionState

try:  # the public functions wrap every number in an enumeration, which costs ten times as much
    from _signal import getsignal  # type: ignore[import-not-found]
    from _signal import signal as set_signal
except ImportError:  # another Python than CPython
    from signal import getsignal
    from signal import signal as set_signal

_SIGINT = int(signal.SIGINT)


A = TypeVar("A", bound=Message)


class InterruptShield:
    """Defers Ctrl-C from its construction until `release`, which calls the program's own handler.

    Python runs signal handlers in the main thread only, so in other threads it has no effect. Call `release` in a
    `finally`.
    """

    __slots__ = ("_previous", "pending")

    def __init__(self) -> None:
        self.pending = False
        self._previous: Callable[[int, FrameType | None], Any] | None = None
        if get_ident() == threading.main_thread().ident:
            previous = getsignal(_SIGINT)
            if callable(previous):  # otherwise Ctrl-C raises no exception
                self._previous = previous
                set_signal(_SIGINT, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Record the signal."""
        self.pending = True

    def release(self) -> None:
        """Restore the program's own handler and call it if Ctrl-C came; raises what it raises."""
        previous = self._previous
        if previous is not None:
            self._previous = None
            set_signal(_SIGINT, previous)
            if self.pending:
                previous(_SIGINT, None)


class PendingRequest:
    """A request that waits for its answer; used once.

    Args:
        on_answer: called with the answer, by the thread that reads it.

    Attributes:
        answer: None until it arrives.
    """

    __slots__ = ("_lock", "_on_answer", "answer")

    def __init__(self, on_answer: Callable[[Message], None] | None = None) -> None:
        self.answer: Message | None = None
        self._on_answer = on_answer
        self._lock = allocate_lock()
        self._lock.acquire()

    def resolve(self, answer: Message) -> None:
        """Deliver the answer."""
        if self._on_answer is not None:
            self._on_answer(answer)
        self.answer = answer
        self._lock.release()

    def abandon(self) -> None:
        """Wake the waiting thread without an answer."""
        self._lock.release()

    def wait(self, seconds: float) -> None:
        """Wait for `resolve` or `abandon`."""
        self._lock.acquire(timeout=max(0.0, seconds))


#: Shortest silence after which a link counts as lost [s].
_MIN_SILENCE = 1.0
#: Longest silence of TCP while datagrams arrive [s]: it is slow on a bad network, but answers and events need it.
_MAX_TCP_SILENCE = 10.0


class Heartbeat:
    """Ping interval towards the cabinet, and the check that the cabinet is still alive.

    Attributes:
        timeout: silence after which the cabinet ends the session [s].
        watchdog: silence after which the cabinet counts a controller as lost [s]; infinite: not in control.
        received: our clock when a frame last arrived over TCP [ns].
        datagram: our clock when a datagram last arrived [ns].
    """

    __slots__ = ("_looked", "datagram", "received", "timeout", "watchdog")

    def __init__(self, now: int) -> None:
        self.timeout = 1.0
        self.watchdog = float("inf")
        self.received = self.datagram = self._looked = now

    @property
    def interval(self) -> int:
        """Time between pings [ns]: a quarter of the shorter timeout, so that one late ping costs nothing."""
        return round(min(self.timeout, self.watchdog) / 4 * 1e9)

    def look(self, now: int) -> None:
        """Note that the link is looked after now, as it is at least once per interval while this process runs.

        If it was not for longer, this process or its machine stood still: then nobody could have heard anything, and
        that time is no silence.
        """
        still = now - self._looked - self.interval
        if still > 0:
            self.received = min(now, self.received + still)
            self.datagram = min(now, self.datagram + still)
        self._looked = now

    def check(self, now: int, peer: str) -> None:
        """Check the silence so far.

        Raises:
            ConnectionLost: the cabinet has been silent for two timeouts, and for at least a second; or TCP has been
                silent for much longer while datagrams arrive.
        """
        self.look(now)
        allowed = max(2 * self.timeout, _MIN_SILENCE)
        silence = (now - max(self.received, self.datagram)) * 1e-9
        over_tcp = (now - self.received) * 1e-9
        if silence <= allowed < over_tcp:
            silence, allowed = over_tcp, max(allowed, _MAX_TCP_SILENCE)
        if silence > allowed:
            raise ConnectionLost(
                f"nothing received from {peer} for {silence:.1f} s, allowed are {allowed:g} s",
                code=int(Code.SILENT),
                hint="check the network and the load of both machines",
            )


_log = logging.getLogger("heptarm.link")

_BUFFER = 65536
#: Marks an untouched receive buffer: random, so that no frame begins with it.
_UNTOUCHED = bytes.fromhex("5a0f93c1d2e8471b")
#: How long a caller waits for the link thread to finish the read that it is in [s].
_TURN = 0.0002
#: For this long after a request [ns] the link thread polls once per step [s] instead of waiting for bytes.
_POLLING, _STEP = 30_000_000, 0.0005
#: From this state rate on the link thread never polls, since states must be taken at once [Hz].
_FAST_STATES = 250.0
#: From this state rate on a loop over states reads the socket itself [Hz].
_LOOPED_STATES = 100.0
#: The link thread leaves the socket to such a loop while it reads and for at least this long after that [ns]. It looks
#: after the loop a quarter of a period after a state: that has been taken then, and the next one is not due.
_LOOPING = 5_000_000
#: Pings at the start, and the pause between them [s]: enough to measure the rate of a virtual clock.
_PROBES, _PROBE_PAUSE = 6, 0.003
#: The usual answer, and its type and body.
_ACCEPTED = Accepted(id=0)
_PLAIN_ANSWER = (Accepted.TYPE, _ACCEPTED.encode())
#: Requests that also go by datagram.
_URGENT = (Stop, Cancel)
#: Largest number of a target; they begin again at 0, which counts as newer than all.
_NUMBERS = 0xFFFFFFFF


class Link:
    """One connection to a cabinet, from Hello to Goodbye.

    Args:
        transport: a new connection; the link owns it from now on.
        clock: this side's clock.
        key: pre-shared key, or None.
        on_event: called with each event, in the order received; must not block.
        on_state: called with (body, our clock at its receipt [ns]) of each pushed state; must not block.
        on_lost: called once, from the link thread, with the error that ended the link; not after `close`.
        journal: where each request and its answer are noted.

    Attributes:
        offset: estimate of the cabinet's clock.
        peer: address of the cabinet.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        key: bytes | None = None,
        on_event: Callable[[Message], None],
        on_state: Callable[[bytes, int], None],
        on_lost: Callable[[HeptarmError], None],
        journal: Journal,
    ) -> None:
        self.offset = ClockOffset()
        self.peer = transport.peer
        self._transport = transport
        self._clock = clock
        self._session = Session(Side.CLIENT, key=key)
        self._on_event = on_event
        self._on_state = on_state
        self._on_lost = on_lost
        self._journal = journal
        self._view = memoryview(bytearray(_BUFFER))
        self._sending = threading.Lock()
        self._reading = threading.Lock()  # held by the one thread that reads the socket
        self._caller_reads = False
        self._reader = 0  # its thread identifier
        self._pending: dict[int, PendingRequest] = {}
        self._spare = [PendingRequest()]
        self._left: list[bytes] = []  # received, but not read yet
        compiled = compiled_link(
            self._session,
            transport.fileno,
            left=self._left,
            pending=self._pending,
            spare=self._spare,
            reading=self._reading,
            sending=self._sending,
        )
        self._exchange = None if compiled is None else compiled[0]
        self._receive_state = None if compiled is None else compiled[1]
        self._welcome: Welcome | None = None
        self._error: HeptarmError | None = None
        self._closing = False
        self._requested = clock.nanos()
        self._heartbeat = Heartbeat(self._requested)
        self._ping_due = self._requested
        self._polling = _POLLING
        self._may_loop = self._loop_reads = False
        self._looping = _LOOPING
        self._looped = self._requested - _LOOPING
        self._datagrams: DatagramLine | None = None
        self._targets = 0
        self._pushing = threading.Lock()  # states and pings arrive over TCP and by datagram
        self._newest_state = -(1 << 63)
        self._departure = PingDeparture()
        self._thread = threading.Thread(target=self._run, name="heptarm-link", daemon=True)

    # ------------------------------------------------------------------------------------ opening

    def open(self, *, name: str, version: str, timeout: float) -> Welcome:
        """Send Hello, prove the key if asked, measure the cabinet's clock, and start the link thread.

        Raises:
            ConnectFailed: the cabinet does not answer, or refuses the session.
        """
        deadline = self._clock.nanos() + round(timeout * 1e9)
        try:
            self._send(self._session.hello(name=name, version=version))
            while self._welcome is None:
                self._step(deadline, f"no session within {timeout:g} s")
            for count in range(1, _PROBES + 1):
                self.ping()
                while self.offset.count < count:
                    self._step(deadline, f"no answer to a ping within {timeout:g} s")
                self._clock.sleep(_PROBE_PAUSE)
        except HeptarmError as error:
            self._fail(error)
            if isinstance(error, ConnectFailed):
                raise
            raise ConnectFailed(
                f"no session with {self.peer}: {error.text}", code=error.code, hint=error.hint
            ) from error
        except BaseException:
            self._fail(ConnectionLost("interrupted while connecting"))
            raise
        self._heartbeat.timeout = self._welcome.heartbeat
        self._thread.start()
        return self._welcome

    def open_datagrams(self, *, timeout: float) -> str:
        """Open datagrams beside the open session; returns why there are none, "" if there are.

        Raises:
            ConnectionLost: the link has ended.
            Timeout: no answer in time.
        """
        socket = self._transport.datagrams()
        if socket is None:
            return f"no UDP socket can be opened to {self.peer}"
        try:
            answer = self.request(OpenDatagrams(), DatagramToken, timeout=timeout)
        except (
            CommandRejected,
            RemoteProtocolError,
        ) as error:  # the latter from a cabinet that does not know the request
            socket.close()
            return error.text
        except BaseException:
            socket.close()
            raise
        assert self._welcome is not None  # an open session has one
        self._datagrams = DatagramLine(
            socket,
            self._session.datagrams(self._welcome.session, answer.token),
            self._clock,
            self.offset,
            on_pong=self._on_pong,
            on_state=self._take_state,
            on_life=self._on_datagram,
        )
        self._datagrams.start()
        return ""

    @property
    def datagrams(self) -> DatagramReport | None:
        """How the datagrams fare; None: they are not open."""
        return None if self._datagrams is None else self._datagrams.report

    def datagram_counts(self, *, timeout: float) -> DatagramStatistics:
        """What the cabinet has counted of this session's datagrams; raises as `request` does."""
        return self.request(GetDatagramStatistics(), DatagramStatistics, timeout=timeout)

    def _step(self, deadline: int, late: str) -> None:
        with self._reading:
            self._read(wait=True)
        if self._error is not None:
            raise self._error
        if self._clock.nanos() > deadline:
            raise ConnectFailed(
                f"{self.peer} accepted the connection but answers nothing: {late}",
                hint="check that heptarm's application runs on the cabinet and listens on this port",
            )

    def _handshake(self, message: Message) -> None:
        if isinstance(message, Challenge):
            if not self._session.has_key:
                raise ConnectFailed(
                    f"the cabinet at {self.peer} asks for a pre-shared key, none was given",
                    code=int(Code.WRONG_KEY),
                    hint="give it as a file (--key-file, connect(..., key_file=...)), in HEPTARM_KEY, or store it: "
                    f"heptarm key set --target {self.peer}",
                )
            self._send(self._session.proof())
        elif isinstance(message, Refusal):
            raise refusal(message, major=MAJOR, minor=MINOR)
        elif isinstance(message, Welcome):
            self._welcome = message

    # ------------------------------------------------------------------------------------ sending

    @property
    def error(self) -> HeptarmError | None:
        """The error that ended the link; None while it is connected."""
        return self._error

    @property
    def is_read_here(self) -> bool:
        """Whether the calling thread reads this link, so that it runs callbacks; nothing arrives while it waits."""
        ident = get_ident()
        return self._reader == ident or self._thread.ident == ident

    def expect_watchdog(self, seconds: float) -> None:
        """Ping often enough for a watchdog of this length at the cabinet [s]."""
        self._heartbeat.watchdog = seconds

    def expect_states(self, rate: float) -> None:
        """Prepare for this many pushed states per second of our clock [Hz]."""
        self._polling = _POLLING if rate <= _FAST_STATES else 0
        self._may_loop = rate >= _LOOPED_STATES
        if self._may_loop:
            period = max(1, round(1e9 / rate))
            self._looping = (_LOOPING + period - 1) // period * period + period // 4

    def request(
        self,
        message: Message,
        wanted: type[A],
        *,
        timeout: float,
        on_answer: Callable[[Message], None] | None = None,
    ) -> A:
        """Send a request and wait for its answer.

        Args:
            message: the request.
            wanted: class of the answer of a cabinet that accepts it.
            timeout: how long to wait [s].
            on_answer: called with the answer before later messages are handled; must not block.

        Raises:
            CommandRejected: the cabinet refuses; the code decides which subclass or other error it is.
            ConnectionLost: the link has ended.
            RemoteProtocolError: the cabinet answers with something else.
            Timeout: no answer in time.
        """
        answer = self._ask_at_once(message, timeout) if on_answer is None else None
        if answer is None:
            answer = self._ask(message, timeout, on_answer)
        if isinstance(answer, wanted):
            self._journal.add(REQUEST, message, answer.id if isinstance(answer, Accepted) else 0)
            return answer
        if isinstance(answer, Rejected):
            self._journal.add(REFUSAL, answer)
            raise rejection(answer)
        raise RemoteProtocolError(
            f"the cabinet answered {type(message).__name__} with {type(answer).__name__}, not with {wanted.__name__}"
        )

    def _ask_at_once(self, message: Message, timeout: float) -> Message | None:
        """Send a request and read its answer in one call of C; None: `_ask` has to send it.

        This is the usual case: no other thread sends or reads, and the answer is the next frame to come.
        """
        exchange, kind = self._exchange, type(message)
        if exchange is None or kind not in self._session.simple_requests:
            return None
        if self._datagrams is not None and kind in _URGENT:
            return None
        now = self._requested = self._clock.nanos()
        try:
            received = exchange(kind, kind.TYPE, now, message.encode())
        except OSError as error:
            self._fail(self._transport.lost(error))
            raise self._lost() from error
        if received == _PLAIN_ANSWER:
            self._heartbeat.received = now
            return _ACCEPTED
        if received is None:
            return None
        if isinstance(received, PendingRequest):
            self._spare.append(PendingRequest())
            return self._answer(message, received, timeout, InterruptShield())
        self._heartbeat.received = now
        try:
            return printable_message(self._session.answer(*received))
        except RemoteProtocolError as error:
            self._fail(error)
            raise self._lost() from error

    def _ask(self, message: Message, timeout: float, on_answer: Callable[[Message], None] | None) -> Message:
        """Send a request and wait for its answer, in the cases that `_ask_at_once` leaves."""
        if not self._spare:  # an interrupt came in the one moment in which it was missing
            self._spare.append(PendingRequest())
        pending = PendingRequest(on_answer)
        line = self._datagrams if type(message) in _URGENT else None
        shield = InterruptShield()
        try:
            number = self._send(message, pending)
            if line is None:
                return self._answer(message, pending, timeout, shield)
            line.repeat(message, number)
            try:
                return self._answer(message, pending, timeout, shield)
            finally:
                line.answered(number)
        finally:
            shield.release()

    def _answer(
        self, message: Message, pending: PendingRequest, timeout: float, shield: InterruptShield
    ) -> Message:
        """Wait for the answer to a request that was sent; this thread reads it itself unless another one reads.

        Releases the shield as soon as this thread reads no more.
        """
        deadline = self._clock.nanos() + round(timeout * 1e9)
        try:
            if self._reader == get_ident():  # called from a callback: this thread is the one that reads
                self._read_until(pending, deadline, shield)
            elif self._may_read():
                try:
                    self._caller_reads = True
                    self._reader = get_ident()
                    self._read_until(pending, deadline, shield)
                finally:
                    self._requested = self._clock.nanos()
                    self._caller_reads = False
                    self._reader = 0
                    self._reading.release()
        finally:
            shield.release()
        if pending.answer is None and self._error is None:
            pending.wait((deadline - self._clock.nanos()) * 1e-9)
        if pending.answer is not None:
            return pending.answer
        if self._error is not None:
            raise self._lost()
        raise Timeout(
            f"the cabinet did not answer {type(message).__name__} within {timeout:g} s",
            hint="check the network and the load of both machines, or use connect(..., timeout=...)",
        )

    def read_while(self, waits: Callable[[], bool], seconds: float) -> None:
        """Read in the calling thread while it waits for a state, so that each state wakes one thread, not two.

        Does nothing if another thread reads, if states come by datagram, or at a low rate.

        Args:
            waits: whether it still waits.
            seconds: how long at most [s].
        """
        if not self._may_loop or self._datagrams is not None or self.is_read_here:
            return
        if not self._may_read():
            return
        clock = self._clock
        now = clock.nanos()
        deadline = now + round(seconds * 1e9)
        shield = InterruptShield()
        try:
            self._caller_reads = self._loop_reads = True
            self._reader = get_ident()
            if now >= self._ping_due:  # between two states, where it delays none
                self._ping(now)
            while waits() and self._error is None and not shield.pending and clock.nanos() < deadline:
                self._read(wait=True)
        finally:
            self._looped = clock.nanos()
            self._caller_reads = self._loop_reads = False
            self._reader = 0
            self._reading.release()
            shield.release()

    def send_target(self, kind: type[OneWay], numbers: Sequence[float], *, now: int, watchdog: float) -> None:
        """Send a servo target, stamped with the estimated time of the cabinet: by datagram while datagrams get through.

        Args:
            kind: type of the message.
            numbers: its fields in order.
            now: our clock [ns].
            watchdog: longest gap between two targets [s]. If no datagram was answered for half of it, the target goes
                over TCP as well.
        """
        line = self._datagrams
        if line is None:
            with self._sending:
                if self._error is not None:
                    raise self._lost()
                data = self._session.send_numbers(kind, numbers, time=self.offset.to_cabinet(now))
                self._transmit(data)
            return
        if self._error is not None:
            raise self._lost()
        self._targets += 1
        number = self._targets & _NUMBERS
        line.send_target(kind, numbers, number=number, now=now)
        if line.needs_copy(now, 0.5 * watchdog):
            with self._sending:
                if self._error is not None:
                    raise self._lost()
                data = self._session.send_numbers(
                    kind, numbers, time=self.offset.to_cabinet(now), number=number
                )
                self._transmit(data)

    def pack_target(self, kind: type[OneWay], numbers: Iterable[float], *, now: int) -> bytes:
        """Encode much as `send_target` does, without sending it."""
        line = self._datagrams
        if line is not None:
            return line.pack(kind, numbers, number=0, now=now)
        return self._session.pack_numbers(kind, numbers, time=self.offset.to_cabinet(now))

    def _ping(self, now: int) -> None:
        """The ping that is due."""
        self._ping_due = now + self._heartbeat.interval
        try:
            self.ping()
        except HeptarmError as error:
            self._fail(error)

    def ping(self) -> None:
        """Probe the cabinet's clock; the answer updates `offset`."""
        with self._sending:
            if self._error is not None:
                raise self._lost()
            sent = self._clock.nanos()
            data = self._session.send(Ping(sent=sent), time=sent)
            self._departure = PingDeparture(sent, self._clock.nanos())
            self._transmit(data)

    def _send(self, message: Message, pending: PendingRequest | None = None) -> int:
        """Send a message over TCP; returns the id of the request, 0 if it is none."""
        with self._sending:
            if self._error is not None:
                raise self._lost()
            request = 0
            if pending is not None:
                request = self._session.next_request()
                self._pending[request] = pending
            data = self._session.send(message, request=request, time=self._clock.nanos())
            self._transmit(data)
        return request

    def _transmit(self, data: bytes) -> None:
        """Send bytes; the caller holds `_sending`."""
        try:
            self._transport.send(data)
        except HeptarmError as error:
            self._fail(error)
            raise
        except BaseException:
            # part of the frame may have left: nothing can follow it
            self._fail(ConnectionLost("interrupted while sending"))
            raise

    # ------------------------------------------------------------------------------------ reading

    def _may_read(self) -> bool:
        """Take the lock of the reading thread; the link thread may have to finish the read that it is in."""
        return self._reading.acquire(blocking=False) or self._reading.acquire(timeout=_TURN)

    def _read_until(self, pending: PendingRequest, deadline: int, shield: InterruptShield) -> None:
        while pending.answer is None and self._error is None and not shield.pending:
            if self._clock.nanos() > deadline:
                return
            self._read(wait=True)

    def _read_now(self) -> None:
        """Read what is there, unless another thread does."""
        if self._caller_reads or not self._reading.acquire(blocking=False):
            return
        try:
            self._reader = get_ident()
            self._read(wait=False)
            self._heartbeat.check(self._clock.nanos(), self.peer)
        finally:
            self._reader = 0
            self._reading.release()

    def _read(self, *, wait: bool) -> None:
        """Read and handle what has arrived; the caller holds `_reading`."""
        view, left = self._view, self._left
        try:
            if self._receive_state is not None and self._session.takes_states:  # most of what arrives
                try:
                    received = self._receive_state(State.TYPE, 0 if wait else MSG_DONTWAIT)
                except OSError as error:
                    raise self._transport.lost(error) from error
                if received is None:
                    return
                if received:
                    time, body = received
                    self._heartbeat.received = now = self._clock.nanos()
                    self._take_state(body, time, now)
                    return
            view[:8] = _UNTOUCHED
            if left:
                data: bytes | memoryview = left.pop()
            else:
                data = view[: self._transport.receive_into(view, wait=wait)]
                if not data:
                    return
            now = self._clock.nanos()
            session = self._session
            session.receive_data(data)
            for event in session.events():
                self._heartbeat.received = now  # only a whole frame is a sign of life
                if type(event) is StateReceived:
                    self._take_state(event.body, event.time, now)
                elif type(event) is Received:
                    self._dispatch(event, now)
        except HeptarmError as error:
            self._fail(error)
        except BaseException:
            if view[:8] != _UNTOUCHED:
                self._fail(ConnectionLost("interrupted while reading"))
            raise

    def _dispatch(self, event: Received, now: int) -> None:
        message = printable_message(event.message)
        kind = message.KIND
        if kind == "answer":
            pending = self._pending.pop(event.request, None)
            if pending is not None:
                pending.resolve(message)
        elif isinstance(message, Ping):
            self._send(Pong(sent=message.sent, received=now))
        elif isinstance(message, Pong):
            self._on_pong(message.sent, message.received, now)
        elif isinstance(message, Goodbye):
            self._fail(farewell(message, self.peer))
        elif kind == "handshake":
            self._handshake(message)
        else:
            self._on_event(message)

    def _take_state(self, body: bytes, time: int, now: int) -> None:
        """Pass a state on, unless a newer one came by another path: over TCP or by datagram."""
        with self._pushing:
            if time < self._newest_state:
                return
            self._newest_state = time
            self._on_state(body, now)

    def _on_pong(self, sent: int, received: int, now: int) -> None:
        with self._pushing:
            self.offset.feed(self._departure.of(sent), received, now)

    def _on_datagram(self, now: int) -> None:
        self._heartbeat.datagram = now

    def _run(self) -> None:
        clock, transport = self._clock, self._transport
        while self._error is None:
            try:
                now = clock.nanos()
                self._heartbeat.look(now)
                is_looped = self._loop_reads or now - self._looped < self._looping
                if now >= self._ping_due + (self._looping if is_looped else 0):
                    self._ping(now)
                rest = max(0.0, (self._ping_due - now) * 1e-9)
                if is_looped:
                    # a loop over states reads, or is back within a moment
                    left = self._looped + self._looping - now
                    clock.sleep((left if left > 0 else self._looping) * 1e-9)
                    # after a standstill of this process bytes wait to be read
                    if not transport.wait_readable(0.0):
                        self._heartbeat.check(clock.nanos(), self.peer)
                elif self._caller_reads:
                    # a caller reads; most are done within a fraction of a millisecond
                    clock.sleep(_STEP)
                    if self._caller_reads and self._reading.acquire(timeout=rest):
                        self._reading.release()
                elif now - self._requested < self._polling:
                    # more requests may follow: an answer should wake only its caller
                    clock.sleep(_STEP)
                    self._read_now()
                elif self._left or transport.wait_readable(rest):
                    self._read_now()
                else:
                    self._heartbeat.check(now, self.peer)
            except HeptarmError as error:
                self._fail(error)
            except Exception as error:
                _log.exception("unexpected error in the link to %s", self.peer)
                self._fail(ConnectionLost(f"unexpected error in the link: {error!r}"))
        if not self._closing:
            _log.info("connection to %s ended: %s", self.peer, self._error)
            self._on_lost(self._error)

    # ------------------------------------------------------------------------------------- ending

    def close(self) -> None:
        """Send Goodbye and end the link thread; calling it again has no effect."""
        self._closing = True
        if self._error is None and self._session.state is SessionState.OPEN:
            try:
                self._send(Goodbye(code=0, text="the client closes the session"))
            except HeptarmError as error:
                _log.debug("Goodbye could not be sent to %s: %s", self.peer, error)
        self._fail(ConnectionLost(f"the connection to {self.peer} is closed"))
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(5.0)
        if self._datagrams is not None:
            self._datagrams.join()

    def cut(self) -> None:
        """End the connection at once and without a Goodbye, as a broken cable does."""
        if self._datagrams is not None:
            self._datagrams.close()
        self._transport.close()

    def abandon(self, error: HeptarmError) -> None:
        """Give up the copy that a fork of the process has, without any message to the cabinet.

        The locks are made again, since a thread that exists only in the original process may hold them.
        """
        self._error, self._closing = error, True
        self._sending, self._reading = threading.Lock(), threading.Lock()
        self._caller_reads, self._loop_reads, self._reader = False, False, 0
        self._pending.clear()
        if self._datagrams is not None:
            self._datagrams.abandon()
        self._transport.abandon()

    def _fail(self, error: HeptarmError) -> None:
        """End the link; the first error is kept."""
        if self._error is None:
            self._error = error
        self._transport.close()
        if self._datagrams is not None:
            self._datagrams.close()
        for request in list(self._pending):
            pending = self._pending.pop(request, None)
            if pending is not None:
                pending.abandon()

    def _lost(self) -> HeptarmError:
        """Make a new error for each caller: one exception raised in two threads mixes up their tracebacks."""
        error = self._error
        assert error is not None
        if isinstance(error, ConnectionLost):
            return ConnectionLost(error.text, code=error.code, hint=error.hint)
        return ConnectionLost(f"the connection to {self.peer} is lost: {error.text}", code=error.code)
