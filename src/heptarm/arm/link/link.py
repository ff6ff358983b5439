"""A session over a transport: requests, events, heartbeats.

Who reads the connection? While a caller waits for an answer, the caller reads itself: that saves two changes of
threads, half of a round trip. At all other times the thread "heptarm-link" reads. It waits for the connection to
become readable without taking anything, so a caller need not wake it to take its place; `_token` says who may take.
A caller's thread may be interrupted anywhere. Ctrl-C is held back meanwhile; should another exception come from
outside after octets were taken and before they were understood, nobody knows where the next frame begins: then the
link is given up, and the cabinet stops the arm.
"""

from __future__ import annotations

import logging
import threading
from _thread import get_ident
from collections.abc import Callable, Iterable

from heptarm.arm.heartbeat import Heartbeat
from heptarm.arm.refusals import farewell, refusal, rejection
from heptarm.arm.shield import Shield
from heptarm.arm.slot import Slot
from heptarm.errors import ConnectFailed, ConnectionLost, HeptarmError, RemoteProtocolError, Timeout
from heptarm.io.clock import Clock
from heptarm.io.transport import Transport
from heptarm.wire.clock_offset import ClockOffset
from heptarm.wire.codes import Code
from heptarm.wire.messages import (
    MAJOR,
    MINOR,
    Accepted,
    Challenge,
    Goodbye,
    Message,
    OneWay,
    Ping,
    Pong,
    Refusal,
    Rejected,
    Welcome,
)
from heptarm.wire.session import Received, Session, Side, StateReceived
from heptarm.wire.transitions import SessionState

_log = logging.getLogger("heptarm.link")

_BUFFER = 65536
#: Stands in the buffer until octets come; random, so that no frame begins like it.
_NOTHING = bytes.fromhex("5a0f93c1d2e8471b")
#: How long a caller waits for the link thread to finish what it is just reading [s].
_TURN = 0.0002
#: For so long after a request the link thread looks once per step instead of waiting for octets [ns], [s].
_ASIDE, _STEP = 30_000_000, 0.0005
#: Pings at the start, and the pause between them [s]: enough to see a virtual clock's rate.
_PROBES, _PROBE_PAUSE = 6, 0.003


class Link:
    """One connection to a cabinet, from Hello to Goodbye.

    Args:
        transport: a fresh connection; it belongs to the link from now on.
        clock: this side's clock.
        key: pre-shared key, or None.
        on_event: called with each event, in the order of the wire; must not block.
        on_state: called with (body, our clock at its receipt [ns]) of each pushed state; must not block.
        on_lost: called once, from the link thread, with why the link ended; not after `close`.
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
    ) -> None:
        self.offset = ClockOffset()
        self.peer = transport.peer
        self._transport = transport
        self._clock = clock
        self._has_key = key is not None
        self._session = Session(Side.CLIENT, key=key)
        self._on_event = on_event
        self._on_state = on_state
        self._on_lost = on_lost
        self._view = memoryview(bytearray(_BUFFER))
        self._sending = threading.Lock()
        self._token = threading.Lock()
        self._leading = False
        self._holder = 0
        self._slots: dict[int, Slot] = {}
        self._welcome: Welcome | None = None
        self._error: HeptarmError | None = None
        self._closing = False
        self._requested = clock.nanos()
        self._heartbeat = Heartbeat(self._requested)
        self._aside = _ASIDE
        self._thread = threading.Thread(target=self._run, name="heptarm-link", daemon=True)

    # ------------------------------------------------------------------------------------ opening

    def open(self, *, name: str, version: str, timeout: float) -> Welcome:
        """Say Hello, prove the key if asked, learn the cabinet's clock, and start the link thread.

        Raises:
            ConnectFailed: the cabinet does not answer, or refuses the session.
        """
        deadline = self._clock.nanos() + round(timeout * 1e9)
        try:
            self._say(self._session.hello(name=name, version=version))
            while self._welcome is None:
                self._step(deadline, f"no session within {timeout:g} s")
            for count in range(1, _PROBES + 1):
                self.ping()
                while self.offset.count < count:
                    self._step(deadline, f"no answer to a ping within {timeout:g} s")
                self._clock.sleep(_PROBE_PAUSE)
        except HeptarmError as error:
            self._lose(error)
            if isinstance(error, ConnectFailed):
                raise
            raise ConnectFailed(
                f"no session with {self.peer}: {error.text}", code=error.code, hint=error.hint
            ) from error
        except BaseException:
            self._lose(ConnectionLost("interrupted while connecting"))
            raise
        self._heartbeat.tolerated = self._welcome.heartbeat
        self._thread.start()
        return self._welcome

    def _step(self, deadline: int, late: str) -> None:
        with self._token:
            self._read(wait=True)
        if self._error is not None:
            raise self._error
        if self._clock.nanos() > deadline:
            raise ConnectFailed(
                f"{self.peer} is connected but answers nothing: {late}",
                hint="check that a cabinet listens there",
            )

    def _handshake(self, message: Message) -> None:
        if isinstance(message, Challenge):
            if not self._has_key:
                raise ConnectFailed(
                    f"the cabinet at {self.peer} asks for a pre-shared key",
                    code=int(Code.WRONG_KEY),
                    hint='connect(..., key="...") with the key that its process data names',
                )
            self._say(self._session.proof())
        elif isinstance(message, Refusal):
            raise refusal(message, major=MAJOR, minor=MINOR)
        elif isinstance(message, Welcome):
            self._welcome = message

    # ------------------------------------------------------------------------------------ talking

    @property
    def error(self) -> HeptarmError | None:
        """Why the link has ended; None while it stands."""
        return self._error

    def expect_watchdog(self, seconds: float) -> None:
        """Ping often enough for a watchdog of that length at the cabinet."""
        self._heartbeat.watchdog = seconds

    def expect_states(self, rate: float) -> None:
        """Know how many states come per second: from a few hundred on, they must be taken at once."""
        self._aside = _ASIDE if rate <= 250.0 else 0

    def request(
        self, message: Message, *, timeout: float, on_answer: Callable[[Message], None] | None = None
    ) -> Message:
        """Send a request and wait for its answer.

        Args:
            message: the request.
            timeout: how long to wait [s].
            on_answer: called with the answer before anything that came after it is looked at; must not block.

        Raises:
            CommandRejected: the cabinet refuses (or another error of the table of codes).
            ConnectionLost: the link has ended.
            Timeout: no answer in time.
        """
        slot = Slot(on_answer)
        deadline = self._clock.nanos() + round(timeout * 1e9)
        shield = Shield()
        try:
            self._say(message, slot)
            if self._holder == get_ident():  # called from a callback: this thread is the one that reads
                self._read_until(slot, deadline, shield)
            elif self._token.acquire(timeout=_TURN):
                try:
                    self._leading = True
                    self._holder = get_ident()
                    self._read_until(slot, deadline, shield)
                finally:
                    self._requested = self._clock.nanos()
                    self._leading = False
                    self._holder = 0
                    self._token.release()
        finally:
            shield.down()
        if slot.answer is None and self._error is None:
            slot.wait((deadline - self._clock.nanos()) * 1e-9)
        answer = slot.answer
        if answer is None:
            if self._error is not None:
                raise self._lost()
            raise Timeout(f"the cabinet did not answer a {type(message).__name__} within {timeout:g} s")
        if isinstance(answer, Rejected):
            raise rejection(answer)
        return answer

    def accept(
        self, message: Message, *, timeout: float, on_answer: Callable[[Message], None] | None = None
    ) -> int:
        """A request that is answered with an id; returns it. Raises as `request` does."""
        answer = self.request(message, timeout=timeout, on_answer=on_answer)
        if not isinstance(answer, Accepted):
            raise RemoteProtocolError(f"a {type(answer).__name__} answers a {type(message).__name__}")
        return answer.id

    def post(self, message: Message) -> None:
        """Send a request without waiting for its answer; callable from the callbacks."""
        self._say(message, Slot())

    def tell(self, kind: type[OneWay], numbers: Iterable[float], *, now: int) -> None:
        """Send a message that nobody answers, stamped with the cabinet's clock as far as it is known.

        Args:
            kind: what to say.
            numbers: its fields, one after the other.
            now: our clock [ns].
        """
        with self._sending:
            if self._error is not None:
                raise self._lost()
            data = self._session.send_numbers(kind, numbers, time=self.offset.to_cabinet(now))
            self._transmit(data)

    def rehearse(self, kind: type[OneWay], numbers: Iterable[float], *, now: int) -> bytes:
        """What `tell` would send now; nothing is sent."""
        return self._session.pack_numbers(kind, numbers, time=self.offset.to_cabinet(now))

    def ping(self) -> None:
        """Probe the cabinet's clock; the answer goes into `offset`."""
        self._say(Ping(sent=self._clock.nanos()))

    def _say(self, message: Message, slot: Slot | None = None) -> None:
        with self._sending:
            if self._error is not None:
                raise self._lost()
            request = 0
            if slot is not None:
                request = self._session.next_request()
                self._slots[request] = slot
            data = self._session.send(message, request=request, time=self._clock.nanos())
            self._transmit(data)

    def _transmit(self, data: bytes) -> None:
        """Send octets; the caller holds the lock."""
        try:
            self._transport.send(data)
        except HeptarmError as error:
            self._lose(error)
            raise
        except BaseException:
            # a part of the frame may have left: nothing can follow it
            self._lose(ConnectionLost("interrupted while sending"))
            raise

    # ------------------------------------------------------------------------------------ reading

    def _read_until(self, slot: Slot, deadline: int, shield: Shield) -> None:
        while slot.answer is None and self._error is None and not shield.pending:
            if self._clock.nanos() > deadline:
                return
            self._read(wait=True)

    def _read_now(self) -> None:
        """Take what is there, unless another thread does."""
        if self._leading or not self._token.acquire(blocking=False):
            return
        try:
            self._holder = get_ident()
            self._read(wait=False)
        finally:
            self._holder = 0
            self._token.release()

    def _read(self, *, wait: bool) -> None:
        """Take what has come and act on it; the caller holds the token."""
        view = self._view
        view[:8] = _NOTHING
        try:
            size = self._transport.receive_into(view, wait=wait)
            if size == 0:
                return
            now = self._heartbeat.heard = self._clock.nanos()
            session = self._session
            session.receive_data(view[:size])
            for event in session.events():
                if type(event) is StateReceived:
                    self._on_state(event.body, now)
                elif type(event) is Received:
                    self._dispatch(event, now)
        except HeptarmError as error:
            self._lose(error)
        except BaseException:
            if view[:8] != _NOTHING:
                self._lose(ConnectionLost("interrupted while reading"))
            raise

    def _dispatch(self, event: Received, now: int) -> None:
        message = event.message
        kind = message.KIND
        if kind == "answer":
            slot = self._slots.pop(event.request, None)
            if slot is not None:
                slot.put(message)
        elif isinstance(message, Ping):
            self._say(Pong(sent=message.sent, received=now))
        elif isinstance(message, Pong):
            self.offset.feed(message.sent, message.received, now)
        elif isinstance(message, Goodbye):
            self._lose(farewell(message, self.peer))
        elif kind == "handshake":
            self._handshake(message)
        else:
            self._on_event(message)

    def _run(self) -> None:
        clock, transport = self._clock, self._transport
        due = clock.nanos()
        while self._error is None:
            try:
                now = clock.nanos()
                if now >= due:
                    self.ping()
                    due = now + self._heartbeat.interval
                rest = max(0.0, (due - now) * 1e-9)
                if self._leading:
                    # a caller reads; most are done within a fraction of a millisecond
                    clock.sleep(_STEP)
                    if self._leading and self._token.acquire(timeout=rest):
                        self._token.release()
                elif now - self._requested < self._aside:
                    # more requests may follow: an answer should wake its caller alone
                    clock.sleep(_STEP)
                    self._read_now()
                elif transport.wait_readable(rest):
                    self._read_now()
                else:
                    self._heartbeat.check(now, self.peer)
            except HeptarmError as error:
                self._lose(error)
            except Exception as error:
                _log.exception("the link to %s fails", self.peer)
                self._lose(ConnectionLost(f"an error in the link: {error!r}"))
        if not self._closing:
            _log.info("link to %s ended: %s", self.peer, self._error)
            self._on_lost(self._error)

    # ------------------------------------------------------------------------------------- ending

    def close(self) -> None:
        """Say goodbye and end the thread; closing twice is legal."""
        self._closing = True
        if self._error is None and self._session.state is SessionState.OPEN:
            try:
                self._say(Goodbye(code=0, text="the client closes"))
            except HeptarmError as error:
                _log.debug("no goodbye to %s: %s", self.peer, error)
        self._lose(ConnectionLost(f"the connection to {self.peer} is closed"))
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(5.0)

    def _lose(self, error: HeptarmError) -> None:
        if self._error is None:
            self._error = error
        self._transport.close()
        for request in list(self._slots):
            slot = self._slots.pop(request, None)
            if slot is not None:
                slot.give_up()

    def _lost(self) -> HeptarmError:
        """A fresh error for each who asks: one exception raised in two threads mixes up their tracebacks."""
        error = self._error
        assert error is not None
        if isinstance(error, ConnectionLost):
            return ConnectionLost(error.text, code=error.code, hint=error.hint)
        return ConnectionLost(f"the connection to {self.peer} is lost: {error.text}", code=error.code)
