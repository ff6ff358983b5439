"""One session with a cabinet over one transport: requests and answers, events, states, heartbeat.

Theory of operation
-------------------

**States.** A link is *opening* (Hello, the key's proof, Welcome, six pings that measure the cabinet's clock),
then *open*, then *ended*. It ends once, by `_fail`: the first error is kept, the sockets close, everybody who
waits is woken. All later calls raise that error (`lost`: a new exception for each caller). Nothing
reconnects here; `connection` does, with a new link.

**Frames** are written and read by `heptarm.wire.session`, which counts them and knows no socket. In the usual
case C does the same in one call (`heptarm.io.exchange`): a request, its answer and nothing in between; or one
state. Whatever else comes, C leaves the bytes in `_left`, and the session reads them as if they had just
arrived.

**Who reads** (`read_turns`). There is one socket and there are many threads. The one that waits for an answer
reads the socket itself, so that an answer wakes one thread, not two; so does a loop over fast states. The
*link thread* reads while nobody waits. The thread that reads handles everything that has come, in order, so
callbacks (`on_event`, `on_state`, `on_answer`) run in any of these threads; they must not block. `on_event`
and `on_answer` may send requests: the thread that reads then reads on for its own answer (`is_read_here`).
`on_state` may not, since it runs under the lock of `Arrivals`. Two threads may wait at once: one reads, and
`PendingRequest.resolve` wakes the other.

**Who sends.** Any thread, under `_sending`: numbers and tags of frames have to leave in order. A frame of
which only a part has left ends the link, since nothing can follow it.

**Locks.** A thread takes its turn to read first, and then `_sending` or the lock of `Arrivals`, never both. C
tries the turn and `_sending`, and leaves the request to Python instead of waiting for one.

**Heartbeat.** Pings leave four times per timeout, from the link thread, or from a loop over states between
two of them. Their answers also measure the clock. The cabinet is lost after two timeouts of silence; time in
which this process stood still does not count, since nobody could have listened (`heartbeat`).

**Datagrams** (`datagrams`) carry targets, states and copies of stops beside TCP, with a thread of their own.
States may come by both and overtake each other; `arrivals` drops the older one. TCP remains the proof of
life, and carries a target as well whenever datagrams go unanswered.

**Ctrl-C** may raise KeyboardInterrupt between any two instructions of the main thread. A request is shielded
from it until its answer is there (`pending.InterruptShield`), or runs within one call of C; otherwise half a
frame could be lost. Where an interrupt does cut a read or a write, the link ends instead of going on out of
step.

**Fork.** A forked process must not speak on the parent's socket: `abandon` gives its copy up without a
message.
"""

from __future__ import annotations

import logging
import threading
from _thread import get_ident
from collections.abc import Callable, Sequence
from typing import TypeVar

from heptarm.arm.link.arrivals import Arrivals
from heptarm.arm.link.datagrams import DatagramLine, DatagramReport
from heptarm.arm.link.heartbeat import Heartbeat
from heptarm.arm.link.pending import InterruptShield, PendingRequest, PendingRequests
from heptarm.arm.link.read_turns import ReadTurns, Turn
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

A = TypeVar("A", bound=Message)

_log = logging.getLogger("heptarm.link")

_BUFFER = 65536
#: Marks an untouched receive buffer: random, so that no frame begins with it.
_UNTOUCHED = bytes.fromhex("5a0f93c1d2e8471b")
#: How long the link thread sleeps between two looks at a socket that it leaves to callers [s].
_STEP = 0.0005
#: Pings at the start, and the pause between them [s]: enough to measure the rate of a virtual clock.
_PROBES, _PROBE_PAUSE = 6, 0.003
#: The usual answer, and its type and body.
_ACCEPTED = Accepted(id=0)
_PLAIN_ANSWER = (Accepted.TYPE, _ACCEPTED.encode())
#: Requests that also go by datagram.
_URGENT = (Stop, Cancel)


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
        self.peer = transport.peer
        self._transport = transport
        self._clock = clock
        self._session = Session(Side.CLIENT, key=key)
        self._on_event = on_event
        self._on_lost = on_lost
        self._journal = journal
        self._view = memoryview(bytearray(_BUFFER))
        self._left: list[bytes] = []  # received, but not read yet
        now = clock.nanos()
        self._turns = ReadTurns(now)
        self._heartbeat = Heartbeat(now)
        self._arrivals = Arrivals(on_state)
        self._requests = PendingRequests()
        self._sending = threading.Lock()
        compiled = compiled_link(
            self._session,
            transport.fileno,
            left=self._left,
            pending=self._requests.by_id,
            spare=self._requests.spare,
            reading=self._turns.lock,
            sending=self._sending,
        )
        self._exchange = None if compiled is None else compiled[0]
        self._receive_state = None if compiled is None else compiled[1]
        self._welcome: Welcome | None = None
        self._error: HeptarmError | None = None
        self._closing = False
        self._datagrams: DatagramLine | None = None
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
            arrivals=self._arrivals,
            heartbeat=self._heartbeat,
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
        with self._turns.lock:
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
    def offset(self) -> ClockOffset:
        """Estimate of the cabinet's clock."""
        return self._arrivals.offset

    @property
    def is_read_here(self) -> bool:
        """Whether the calling thread reads this link, so that it runs callbacks; nothing arrives while it waits."""
        return self._turns.is_here or self._thread.ident == get_ident()

    def expect_watchdog(self, seconds: float) -> None:
        """Ping often enough for a watchdog of this length at the cabinet [s]."""
        self._heartbeat.watchdog = seconds

    def expect_states(self, rate: float) -> None:
        """Prepare for this many pushed states per second of our clock [Hz]."""
        self._turns.expect_states(rate)

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
        now = self._turns.requested = self._clock.nanos()
        try:
            received = exchange(kind, kind.TYPE, now, message.encode())
        except OSError as error:
            self._fail(self._transport.lost(error))
            raise self.lost() from error
        if received == _PLAIN_ANSWER:
            self._heartbeat.received = now
            return _ACCEPTED
        if received is None:
            return None
        if isinstance(received, PendingRequest):
            self._requests.replenish()
            return self._answer(message, received, timeout, InterruptShield())
        self._heartbeat.received = now
        try:
            return printable_message(self._session.answer(*received))
        except RemoteProtocolError as error:
            self._fail(error)
            raise self.lost() from error

    def _ask(self, message: Message, timeout: float, on_answer: Callable[[Message], None] | None) -> Message:
        """Send a request and wait for its answer, in the cases that `_ask_at_once` leaves."""
        self._requests.replenish()
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
        turns = self._turns
        try:
            if turns.is_here:  # called from a callback: this thread is the one that reads
                self._read_until(pending, deadline, shield)
            elif turns.take():
                try:
                    turns.begin()
                    self._read_until(pending, deadline, shield)
                finally:
                    turns.end(self._clock.nanos())
        finally:
            shield.release()
        if pending.answer is None and self._error is None:
            pending.wait((deadline - self._clock.nanos()) * 1e-9)
        if pending.answer is not None:
            return pending.answer
        if self._error is not None:
            raise self.lost()
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
        turns = self._turns
        if not turns.serves_loops or self._datagrams is not None or self.is_read_here:
            return
        if not turns.take():
            return
        clock = self._clock
        now = clock.nanos()
        deadline = now + round(seconds * 1e9)
        shield = InterruptShield()
        try:
            turns.begin(is_loop=True)
            if now >= self._heartbeat.due:  # between two states, where it delays none
                self._ping(now)
            while waits() and self._error is None and not shield.pending and clock.nanos() < deadline:
                self._read(wait=True)
        finally:
            turns.end(clock.nanos())
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
                    raise self.lost()
                data = self._session.send_numbers(kind, numbers, time=self.offset.to_cabinet(now))
                self._transmit(data)
            return
        if self._error is not None:
            raise self.lost()
        number = line.send_target(kind, numbers, now=now)
        if line.needs_copy(now, 0.5 * watchdog):
            with self._sending:
                if self._error is not None:
                    raise self.lost()
                data = self._session.send_numbers(
                    kind, numbers, time=self.offset.to_cabinet(now), number=number
                )
                self._transmit(data)

    def _ping(self, now: int) -> None:
        """The ping that is due."""
        self._heartbeat.pinged(now)
        try:
            self.ping()
        except HeptarmError as error:
            self._fail(error)

    def ping(self) -> None:
        """Probe the cabinet's clock; the answer updates `offset`."""
        with self._sending:
            if self._error is not None:
                raise self.lost()
            sent = self._clock.nanos()
            data = self._session.send(Ping(sent=sent), time=sent)
            self._arrivals.departure = PingDeparture(sent, self._clock.nanos())
            self._transmit(data)

    def _send(self, message: Message, pending: PendingRequest | None = None) -> int:
        """Send a message over TCP; returns the id of the request, 0 if it is none."""
        with self._sending:
            if self._error is not None:
                raise self.lost()
            request = 0
            if pending is not None:
                request = self._session.next_request()
                self._requests.by_id[request] = pending
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

    def _read_until(self, pending: PendingRequest, deadline: int, shield: InterruptShield) -> None:
        while pending.answer is None and self._error is None and not shield.pending:
            if self._clock.nanos() > deadline:
                return
            self._read(wait=True)

    def _read_now(self) -> None:
        """Read what is there, unless another thread does."""
        if not self._turns.take_now():
            return
        try:
            self._read(wait=False)
            self._heartbeat.check(self._clock.nanos(), self.peer)
        finally:
            self._turns.leave()

    def _read(self, *, wait: bool) -> None:
        """Read and handle what has arrived; the caller has its turn."""
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
                    self._arrivals.state(body, time, now)
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
                    self._arrivals.state(event.body, event.time, now)
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
            self._requests.resolve(event.request, message)
        elif isinstance(message, Ping):
            self._send(Pong(sent=message.sent, received=now))
        elif isinstance(message, Pong):
            self._arrivals.pong(message.sent, message.received, now)
        elif isinstance(message, Goodbye):
            self._fail(farewell(message, self.peer))
        elif kind == "handshake":
            self._handshake(message)
        else:
            self._on_event(message)

    def _run(self) -> None:
        clock, transport, turns, heartbeat = self._clock, self._transport, self._turns, self._heartbeat
        while self._error is None:
            try:
                now = clock.nanos()
                heartbeat.look(now)
                if now >= heartbeat.due + (turns.patience if turns.is_looped(now) else 0):
                    self._ping(now)
                rest = max(0.0, (heartbeat.due - now) * 1e-9)
                turn = turns.of(now)
                if turn is Turn.LOOP:
                    clock.sleep(turns.until_look(now))
                    # after a standstill of this process bytes wait to be read
                    if not transport.wait_readable(0.0):
                        heartbeat.check(clock.nanos(), self.peer)
                elif turn is Turn.CALLER:
                    clock.sleep(_STEP)
                    turns.wait(rest)
                elif turn is Turn.NOBODY:
                    clock.sleep(_STEP)
                    self._read_now()
                elif self._left or transport.wait_readable(rest):
                    self._read_now()
                else:
                    heartbeat.check(now, self.peer)
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
        self._sending = threading.Lock()
        self._turns.abandon()
        self._requests.by_id.clear()
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
        self._requests.abandon()

    def lost(self) -> ConnectionLost:
        """A new error for each caller: one exception raised in two threads mixes up their tracebacks."""
        error = self._error
        assert error is not None
        if isinstance(error, ConnectionLost):
            return ConnectionLost(error.text, code=error.code, hint=error.hint)
        return ConnectionLost(f"the connection to {self.peer} is lost: {error.text}", code=error.code)
