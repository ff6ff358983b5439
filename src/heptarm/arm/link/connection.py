"""The arm's connection to the cabinet: it outlives single links, keeps track of control, and dispatches events."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import threading
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from heptarm import __version__
from heptarm.arm.link.datagrams import DatagramReport
from heptarm.arm.link.halt import BUSY, PAUSE, halt
from heptarm.arm.link.link import Link
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.state_stream import GROUPS, Followed, StateFeed, States, groups_of
from heptarm.arm.translate.state import read_firing, read_result, read_robot, read_signals, read_state
from heptarm.arm.watchdog import CONNECTION
from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    HeptarmError,
    LimitError,
    LocalProtocolError,
    ModeConflict,
    NotInControl,
    SafetyStop,
    StaleState,
    Timeout,
)
from heptarm.io.clock import Clock
from heptarm.io.transport import Transport
from heptarm.record.black_box import BlackBox, BlackBoxFile
from heptarm.record.journal import ERROR, EVENT, Journal, plain
from heptarm.record.samples import SampleQueue, StateSample
from heptarm.values.checks import within
from heptarm.values.io import Signal
from heptarm.values.result import Result
from heptarm.values.robot import FLANGES, Flange, RobotModel
from heptarm.values.state import State
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.messages import Message

_log = logging.getLogger("heptarm.arm")

#: Time for the connection and for the answer to a request, unless the client chooses another [s].
TIMEOUT = 5.0
#: States per second, unless the client chooses another rate [Hz].
STATE_RATE = 100.0


@dataclass(frozen=True, slots=True)
class Options:
    """Options of a connection; see `connect`.

    Attributes:
        name: shown to other clients.
        key: pre-shared key; None: none.
        timeout: longest wait for an answer [s].
        rate: pushed states per second [Hz]; 0: none.
        groups: groups of the state that are pushed.
        finishes: after a lost connection accepted motions finish instead of stopping.
        watchdog: silence after which the cabinet counts this client as lost [s].
        datagrams: send servo targets and receive states by UDP as far as it gets through.
        black_box: the last 30 s are written to a file after an error.
        flange: media flange of the robot, which no cabinet reports.
    """

    name: str = "heptarm"
    key: bytes | None = None
    timeout: float = TIMEOUT
    rate: float = STATE_RATE
    groups: tuple[str, ...] = GROUPS
    finishes: bool = False
    watchdog: float = CONNECTION.default
    datagrams: bool = False
    black_box: bool = True
    flange: Flange = FLANGES["plain"]


#: FRI sessions whose last change is kept.
_MAX_FRI_SESSIONS = 64
#: Events that belong to one program.
_PROGRAM_EVENTS = (
    wire.MotionStarted,
    wire.SegmentReached,
    wire.ItemReached,
    wire.TriggerFired,
    wire.ConditionFired,
    wire.MotionFinished,
)
_LEVELS = {
    wire.Severity.INFO: logging.INFO,
    wire.Severity.WARNING: logging.WARNING,
    wire.Severity.ERROR: logging.ERROR,
}


class SentProgram(Protocol):
    """A program sent to the cabinet, as far as the connection needs it; `MotionHandle` is one."""

    @property
    def id(self) -> int:
        """The cabinet's number of the program."""
        ...

    @property
    def limit(self) -> float:
        """Longest plausible duration [s]."""
        ...

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        ...

    def on_accepted(self, number: int) -> None:
        """Take the number under which the cabinet accepted it."""
        ...

    def on_event(self, message: Message) -> None:
        """Take an event of this program; called from the link thread."""
        ...

    def on_lost(self, error: HeptarmError) -> None:
        """Take the error that ended the link; called from the link thread."""
        ...

    def on_fork(self, error: HeptarmError) -> None:
        """Take the error of a fork of the process, in which the program cannot be followed."""
        ...


class Events:
    """Dispatches unsolicited events to the running programs and to listeners.

    Args:
        on_control: called when the controlling client changes.

    Attributes:
        key_listeners: called with (slot, pressed) of each user key of the smartPAD.
        attached: the cabinet's last report on tool and workpiece; None: nothing has changed since the connection.
        dialog_listeners: called with the number, the pressed button and the problem of each closed dialog.
    """

    def __init__(self, on_control: Callable[[wire.ControlChanged], None]) -> None:
        self._on_control = on_control
        self._programs: dict[int, SentProgram] = {}
        self._unclaimed: deque[Message] = deque(maxlen=256)
        self._servo_status: wire.ServoStatus | None = None
        self._fri_changes: dict[int, wire.FriChanged] = {}
        self.key_listeners: list[Callable[[int, bool], None]] = []
        self.attached: wire.ToolChanged | None = None
        self.dialog_listeners: list[Callable[[int, int, str], None]] = []

    def dispatch(self, message: Message) -> None:
        """Pass an event on to its receiver."""
        if isinstance(message, _PROGRAM_EVENTS):
            program = self._programs.get(message.id)
            if program is None:
                self._unclaimed.append(message)  # its Accepted may still be under way
            else:
                self._deliver(program, message)
        elif isinstance(message, wire.ServoStatus):
            self._note_servo(message)
        elif isinstance(message, wire.KeyPressed):
            for listener in list(self.key_listeners):
                try:
                    listener(message.slot, message.down)
                except Exception:  # the link thread has to go on
                    _log.exception("a key callback raised an error")
        elif isinstance(message, wire.DialogClosed):
            for closed in list(self.dialog_listeners):
                closed(message.dialog, message.button, message.text)
        elif isinstance(message, wire.FriChanged):
            self._note_fri(message)
        elif isinstance(message, wire.ToolChanged):
            self.attached = message
        elif isinstance(message, wire.ControlChanged):
            self._on_control(message)
        elif isinstance(message, wire.SafetyChanged):
            _log.info("safety: %s", message.text)
        elif isinstance(message, wire.Notice):
            _log.log(_LEVELS[message.severity], "cabinet: %s", message.text)

    # ---------------------------------------------------------------------------------- programs

    def claim(self, program: SentProgram, number: int) -> None:
        """Register a program under its number and deliver the events that came before its acceptance."""
        program.on_accepted(number)
        self._programs[number] = program
        for message in list(self._unclaimed):
            if message.id == number:  # type: ignore[union-attr]
                self._deliver(program, message)

    def pending(self) -> float:
        """Longest plausible duration of all accepted programs together [s]."""
        return sum(program.limit for program in list(self._programs.values()))

    def forget_unclaimed(self) -> None:
        """Drop events of the previous link: its program numbers mean nothing on a new one."""
        self._unclaimed.clear()

    def lose(self, error: HeptarmError) -> None:
        """End all accepted programs with an error."""
        while self._programs:
            with contextlib.suppress(KeyError):  # it has just ended by itself
                self._programs.popitem()[1].on_lost(error)

    def abandon(self, error: HeptarmError) -> None:
        """End all programs in a fork of the process; the original process goes on with them."""
        for program in self._programs.values():
            program.on_fork(error)
        self._programs = {}
        self.key_listeners, self.dialog_listeners = [], []

    def _deliver(self, program: SentProgram, message: Message) -> None:
        if isinstance(message, wire.MotionFinished):
            self._programs.pop(message.id, None)
        program.on_event(message)

    # ----------------------------------------------------------------------------- servo and FRI

    def servo_status(self, number: int) -> wire.ServoStatus | None:
        """The cabinet's last report on the target stream of a servo motion."""
        status = self._servo_status
        return status if status is not None and status.servo == number else None

    def _note_servo(self, message: wire.ServoStatus) -> None:
        before = self.servo_status(message.servo)
        if message.refused and (
            before is None or not before.refused
        ):  # the first one; the others are counted
            _log.warning("servo motion: the cabinet refused a target: %s", message.text)
        self._servo_status = message

    def fri_change(self, number: int) -> wire.FriChanged | None:
        """The cabinet's last report on an FRI session; the report of its end is kept."""
        return self._fri_changes.get(number)

    def _note_fri(self, message: wire.FriChanged) -> None:
        _log.info(
            "FRI session %d: %s, %s %s",
            message.session,
            message.state.name,
            message.quality.name,
            message.text,
        )
        changes, known = self._fri_changes, self._fri_changes.get(message.session)
        if known is None or known.state is not wire.FriSessionState.IDLE:
            changes[message.session] = message
        while len(changes) > _MAX_FRI_SESSIONS:
            del changes[next(iter(changes))]


#: First and longest pause between two attempts to reconnect [s].
_BACK_OFF, _MAX_BACK_OFF = 0.1, 2.0
#: Longest wait for a state between two checks of the link [s].
_CHECK_INTERVAL = 0.2
#: Reasons of a safety stop that its event reports.
_STOPPED = (
    wire.SafetyBits.EMERGENCY_STOP | wire.SafetyBits.PROTECTIVE_STOP | wire.SafetyBits.OPERATOR_SAFETY_OPEN
)
#: What holds a motion without ending it.
_CONTINUES = ("paused", "enabling switch not held")
#: Time in which a stop has ended a motion at rest, on the robot's clock [s].
_STOP_TAKES = 1.0
#: A state older than this many periods, and than this [s], is stale.
_STALE_PERIODS, _STALE = 10.0, 1.0
#: How long to wait for a newer state when the newest is stale [s]: after a standstill of this process or of its machine
#: newer ones wait to be read.
_CATCH_UP = 0.3


class StopWatch:
    """Ends a wait when a safety stop keeps the arm from what is waited for.

    It leaves time for what a stop itself brings about, such as the end of a motion. A wait that begins during a stop
    may be for its end, so it goes on.

    Args:
        waits_for_rest: the wait is for the arm, so that a stop before it counts as well.
    """

    def __init__(self, *, waits_for_rest: bool = False) -> None:
        self._was_free = waits_for_rest
        self._since: int | None = None

    def check(self, state: State) -> None:
        """Look at the next state that does not meet the condition.

        Raises:
            SafetyStop: a stop has been active for a second; the text names it.
        """
        safety = state.groups.safety
        if safety is None:
            return
        stops = [stop for stop in safety.stops if stop not in _CONTINUES]
        if not stops:
            self._was_free, self._since = True, None
        elif self._was_free:
            self._since = safety.stamp if self._since is None else self._since
            if (safety.stamp - self._since) * 1e-9 >= _STOP_TAKES:
                raise SafetyStop(
                    f"the wait ended at a safety stop: {', '.join(stops)}",
                    hint="arm.recover() lists what a person has to do",
                )


class Connection:
    """The connection behind an arm; links to the cabinet come and go, it stays.

    Args:
        dial: makes a transport to the cabinet.
        options: see `Options`.
        clock: this side's clock.
        cabinet: the private virtual cabinet at the other end; None: a real or a shared one.

    Attributes:
        feed: pushed states.
        events: dispatcher of all other events.
        in_control: this client took control and has not lost it; true also while the link is lost.
        controller: name of the client that controls the robot; empty: none.
        closed: set when the arm is closed.
        left_at_rest: the arm was at rest when this client, in control, closed it.
        signals: signals of the cabinet.
        journal: what happened besides pushed states.
        black_box: writes the last 30 s to a file.
    """

    def __init__(
        self,
        dial: Callable[[], Transport],
        options: Options,
        *,
        clock: Clock,
        cabinet: PrivateCabinet | None = None,
    ) -> None:
        self.options = options
        self.clock = clock
        self.cabinet = cabinet
        self.feed = StateFeed(clock)
        self.journal = Journal(clock.nanos)
        self.black_box = BlackBox(self, is_on=options.black_box)
        self.in_control = False
        self.controller = ""
        self.closed = threading.Event()
        self.left_at_rest = False
        self._dial = dial
        self._link: Link | None = None
        self._welcome: wire.Welcome | None = None
        self._robot: RobotModel | None = None
        self._built: tuple[int, State] | None = None
        self.events = Events(self._on_control)
        self.signals: tuple[Signal, ...] = ()
        self._blocks: dict[SentProgram, tuple[int, str]] = {}
        self._lock = threading.RLock()
        self._stops = wire.SafetyBits.NONE
        self._fork_error: ConnectionLost | None = None
        self._process = os.getpid()
        _connections.add(self)

    # ---------------------------------------------------------------------------------- the link

    @property
    def link(self) -> Link:
        """The current link, connected or lost.

        Raises:
            ConnectionLost: there was none yet.
        """
        if self._link is None:
            raise _not_connected()
        return self._link

    @property
    def welcome(self) -> wire.Welcome:
        """The cabinet's description of itself."""
        if self._welcome is None:
            raise _not_connected()
        return self._welcome

    @property
    def robot(self) -> RobotModel:
        """The connected robot and its limits."""
        if self._robot is None:
            raise _not_connected()
        return self._robot

    @property
    def title(self) -> str:
        """KUKA's name of the robot, for people."""
        return "not connected" if self._robot is None else self._robot.title

    @property
    def is_connected(self) -> bool:
        """Whether the current link is connected."""
        return self._link is not None and self._link.error is None

    @property
    def datagrams(self) -> DatagramReport | None:
        """How the datagrams beside the link fare; None: it has none."""
        return self.link.datagrams

    @property
    def real_time_factor(self) -> float:
        """Seconds of the cabinet's clock per second of this computer's."""
        return max(self.link.offset.rate, 0.001)

    def open(self) -> None:
        """Make a link and subscribe to states; a cabinet that is too busy is asked again."""
        deadline = self.clock.nanos() + round(self.options.timeout * 1e9)
        while True:
            self.events.attached = None
            link = self._new_link(self._on_event, self.feed.push, self._on_lost)
            try:
                self._welcome = link.open(
                    name=self.options.name, version=__version__, timeout=self.options.timeout
                )
                break
            except ConnectFailed as error:
                if error.code not in BUSY or self.clock.nanos() > deadline:
                    raise
            self.clock.sleep(PAUSE)
        self.controller = self._welcome.controller
        self.in_control = False
        self.events.forget_unclaimed()
        self._link = link
        try:
            self._robot = read_robot(self._welcome.robot, self.options.flange)
            self.signals = read_signals(self._welcome.signals)
            if self.options.datagrams:
                missing = link.open_datagrams(timeout=self.options.timeout)
                if missing:
                    _log.warning("no datagrams, everything goes over TCP: %s", missing)
            self.subscribe(self.options.rate, self.options.groups)
        except BaseException:
            link.close()
            raise

    def reopen(self) -> None:
        """Replace the link by a new one; take control again if this client had it."""
        with self._lock:
            self.check_open()
            had_control = self.in_control
            if self._link is not None:
                self._link.close()
            self.open()
            if had_control:
                self._regain_control()

    def _regain_control(self) -> None:
        """Take control as soon as the cabinet has stopped the arm and ended this client's previous session."""
        deadline = self.clock.nanos() + round(self.options.timeout * 1e9)
        while True:
            try:
                return self.take_control()
            except NotInControl:
                is_ours = self.controller in ("", self.options.name)  # "": it has just ended
                if not is_ours or self.clock.nanos() > deadline:
                    raise
            self.clock.sleep(PAUSE)

    def close(self) -> None:
        """End the link, everything that waits for it, and a private cabinet."""
        if self._link is not None:
            self._link.close()
        self.black_box.hurry()
        self.events.lose(_closed())
        self.feed.wake()
        if self.cabinet is not None:
            self.cabinet.close()

    def mark_closed(self) -> bool:
        """Mark the arm as closed; False if it was closed already."""
        with self._lock:
            was_open = not self.closed.is_set()
            self.closed.set()
            return was_open

    def check_open(self) -> None:
        """Raise ConnectionLost if the arm was closed."""
        if self.closed.is_set():
            raise self._closed_error()

    def abandon(self) -> None:
        """Make the copy inert that a fork of the process has; the original process keeps arm and session."""
        self._fork_error = error = ConnectionLost(
            f"this arm belongs to process {self._process}, of which this process is a fork",
            hint="connect after the fork, or use multiprocessing with the start method 'spawn'",
        )
        self.closed, self._lock = threading.Event(), threading.RLock()
        self.closed.set()
        self.in_control = False
        self._blocks = {}
        self._built = None
        self.feed.abandon()
        self.black_box.abandon()
        self.events.abandon(error)
        if self._link is not None:
            self._link.abandon(error)

    def _closed_error(self) -> ConnectionLost:
        error = self._fork_error
        return _closed() if error is None else ConnectionLost(error.text, hint=error.hint)

    def final_error(self) -> HeptarmError | None:
        """The error because of which no more states will arrive; None while they may.

        The link of an observer reconnects by itself, that of a controller does not.
        """
        error = self.link.error
        if error is None:
            return None
        if self.closed.is_set():
            return self._closed_error()
        if not self.in_control:
            return None
        lost = ConnectionLost(self.link.lost().text, code=error.code, hint="arm.reconnect() connects again")
        return lost.with_black_box(self.black_box.last)

    def _new_link(
        self,
        on_event: Callable[[Message], None],
        on_state: Callable[[bytes, int], None],
        on_lost: Callable[[HeptarmError], None],
    ) -> Link:
        return Link(
            self._dial(),
            self.clock,
            key=self.options.key,
            on_event=on_event,
            on_state=on_state,
            on_lost=on_lost,
            journal=self.journal,
        )

    # ---------------------------------------------------------------------------------- requests

    def request(self, message: Message) -> None:
        """Send a request that is only accepted or refused; raises as `Link.request` does."""
        link = self._link  # a property would cost every request a call
        if link is None:
            raise _not_connected()
        try:
            link.request(message, wire.Accepted, timeout=self.options.timeout)
        except (SafetyStop, ConnectionLost) as error:
            error.with_black_box(self.black_box.last)  # of the incident that caused it
            raise

    def take_control(self) -> None:
        """Take control."""
        lost = wire.OnLost.FINISH if self.options.finishes else wire.OnLost.STOP
        self.link.expect_watchdog(self.options.watchdog)
        self.request(wire.TakeControl(watchdog=self.options.watchdog, on_lost=lost))
        self.in_control = True

    def release_control(self) -> None:
        """Give control back."""
        self.in_control = False  # before the cabinet announces it to all clients
        self.request(wire.ReleaseControl())
        self.link.expect_watchdog(float("inf"))

    def subscribe(self, rate: float, groups: Sequence[str]) -> None:
        """Choose what is pushed, now and after a reconnection."""
        chosen = groups_of(groups, self.welcome.groups)
        self._check_rate(rate)
        self.request(wire.Subscribe(groups=chosen, rate=rate))
        self.link.expect_states(rate * self.real_time_factor)
        self.options = replace(self.options, rate=rate, groups=tuple(groups))

    def _check_rate(self, rate: float) -> None:
        """Refuse a rate of states that the cabinet does not push; raises LimitError."""
        try:
            within(rate, "rate", 0.0, self.welcome.max_rate, unit="Hz")
        except LimitError as error:
            if error.code == 2 and rate > 0:
                error.hint = (
                    "the cabinet's process data heptarm.max_rate is the most that it pushes; for more, up to 1000 Hz, "
                    'use FRI: arm.fri("monitor")'
                )
            raise

    def run(self, message: wire.Run | wire.ServoOpen | wire.FriOpen, program: SentProgram) -> None:
        """Send a program, a servo motion or an FRI overlay; from its acceptance on `program` receives its events."""

        def claim(answer: Message) -> None:
            if isinstance(answer, wire.Accepted):
                self.events.claim(program, answer.id)

        try:
            self.link.request(message, wire.Accepted, timeout=self.options.timeout, on_answer=claim)
        except (SafetyStop, ConnectionLost) as error:
            error.with_black_box(self.black_box.last)
            raise

    def check_may_wait(self, call: str) -> None:
        """Check that this thread may wait for the cabinet.

        Raises:
            LocalProtocolError: it runs a callback; nothing arrives before the callback returns.
        """
        if self._is_read_here:
            raise LocalProtocolError(
                f"{call} was called from a callback of the link's thread, which would wait for itself",
                hint="return from the callback and wait in another thread, for example with a threading.Event or "
                "a queue.Queue that the callback fills; arm.stop(), arm.start() and handle.cancel() work there",
            )

    def enter_block(self, program: SentProgram, what: str) -> None:
        """Note that a program lasts as long as a block of this thread; see `check_no_block`."""
        self._blocks[program] = (threading.get_ident(), what)

    def leave_block(self, program: SentProgram) -> None:
        """Note the end of the block."""
        self._blocks.pop(program, None)

    def check_no_block(self, call: str) -> None:
        """Check that this thread may wait for the running programs.

        Raises:
            ModeConflict: this thread is in the block of a servo motion or an FRI session, which would wait for itself.
        """
        ident = threading.get_ident()
        for program, (owner, what) in list(self._blocks.items()):
            if owner == ident and not program.done:
                raise ModeConflict(
                    f"{call} was called inside the block of {what}, for whose end it would wait",
                    hint="leave the with block first, or use arm.start(), which queues the motion and returns",
                )

    def cancel(self, program: SentProgram) -> None:
        """End a program; has no effect if it has ended."""
        if program.done:
            return
        try:
            self.request(wire.Cancel(id=program.id))
        except CommandRejected as error:
            if error.code != Code.UNKNOWN_MOTION:  # otherwise it has just ended, and its end is under way
                raise

    def stop(self, kind: wire.StopKind) -> None:
        """Stop the arm; without a session if this one was lost, since the arm may still move.

        Raises:
            ConnectionLost: neither way reaches the cabinet.
        """
        try:
            self.request(wire.Stop(kind=kind))
        except (ConnectionLost, Timeout):
            if self.closed.is_set():
                raise
            _log.warning("the connection is lost; stopping the arm through a new connection")
            try:
                halt(self._dial, kind, clock=self.clock, timeout=self.options.timeout)
            except ConnectFailed as error:
                raise ConnectionLost(
                    f"the arm could not be stopped: the connection is lost, and through a new one {error.text}",
                    code=error.code,
                    hint="press the emergency stop; a cabinet that runs stops the arm when it has lost its controller",
                ) from error

    @contextlib.contextmanager
    def stopping_on_interrupt(self) -> Iterator[None]:
        """A block in which Ctrl-C stops the arm, if this client controls it, before it is passed on."""
        try:
            yield
        except KeyboardInterrupt:
            self.brake("Ctrl-C")
            raise

    def brake(self, why: str) -> None:
        """Stop the arm, if this client controls it; an error is only logged.

        Args:
            why: for the log.
        """
        if self.in_control and not self.closed.is_set():
            try:
                self.stop(wire.StopKind.PATH)
            except HeptarmError as error:
                _log.error("%s: the arm could not be stopped: %s", why, error)

    # ------------------------------------------------------------------------------------ states

    def newest(self) -> State | None:
        """The newest state, however old; None before the first."""
        sample = self.feed.newest
        return None if sample is None else self.build(sample)

    def fresh(self) -> State:
        """The newest state.

        Raises:
            StaleState: it is too old, none was received, or none is subscribed.
            ConnectionLost: the connection has ended.
        """
        sample, rate = self.feed.newest, self.options.rate
        if rate <= 0:
            raise StaleState("no states are subscribed", hint="arm.subscribe(rate=100)")
        limit = max(_STALE, _STALE_PERIODS / (rate * self.real_time_factor))
        if sample is not None and self._age(sample) > limit and not self._is_read_here:
            sample = self.feed.after(sample.number, _CATCH_UP) or sample
        age = float("inf") if sample is None else self._age(sample)
        if sample is not None and age <= limit:
            return self.build(sample)
        error = self.final_error()
        if error is not None:
            raise error
        text = "no state received yet" if sample is None else f"the newest state is {age:.2f} s old"
        raise StaleState(
            f"{text}; allowed are {limit:g} s",
            value=age,
            allowed=f"[0, {limit:g}] s",
            hint="check the connection and the load of this machine",
        )

    def _age(self, sample: StateSample) -> float:
        """Time since the receipt of a sample [s]."""
        return (self.clock.nanos() - sample.received) * 1e-9

    @property
    def _is_read_here(self) -> bool:
        """Whether the calling thread runs a callback of the link: nothing arrives before it returns."""
        return self._link is not None and self._link.is_read_here

    def stream(
        self, *, rate: float | None, duration: float | None, size: int, until: Followed | None = None
    ) -> States:
        """A stream of states; see `Arm.states`."""
        self.check_open()
        return States(
            self.feed,
            self.clock,
            build=self.decode if until is None else self.build,
            check=self._stream_error,
            rate=rate,
            duration=duration,
            size=size,
            until=until,
            read=self._read_while,
        )

    def _read_while(self, waits: Callable[[], bool], seconds: float) -> None:
        """Read in this thread what it waits for, where that saves time; see `Link.read_while`."""
        link = self._link
        if link is not None:
            link.read_while(waits, seconds)

    def _stream_error(self) -> HeptarmError | None:
        """The error that ends a stream for which no state arrives."""
        self.check_may_wait("a loop over arm.states()")
        return self.final_error()

    def wait_for(
        self, condition: Callable[[State], object], timeout: float, *, watch: StopWatch | None = None
    ) -> State:
        """Wait until a pushed state meets a condition.

        Args:
            condition: called with each state.
            timeout: longest wait [s].
            watch: ends the wait at a safety stop; None: it goes on.

        Raises:
            Timeout: none did in time.
            SafetyStop: by `watch`.
            ConnectionLost: the connection has ended.
            LocalProtocolError: called from a callback.
        """
        self.check_may_wait("waiting for a state")
        deadline = self.clock.nanos() + round(timeout * 1e9)
        seen = 0
        while True:
            rest = (deadline - self.clock.nanos()) * 1e-9
            sample = self.feed.after(seen, min(max(rest, 0.0), _CHECK_INTERVAL))
            if sample is not None:
                seen = sample.number
                state = self.build(sample)
                if condition(state):
                    return state
                if watch is not None:
                    watch.check(state)
            else:
                error = self.final_error()
                if error is not None:
                    raise error
            if rest <= 0:
                newest = self.newest()
                safety = None if newest is None else newest.groups.safety
                stops = ", ".join(() if safety is None else safety.stops)
                raise Timeout(
                    f"the condition was not met within {timeout:g} s{': ' + stops if stops else ''}",
                    hint="arm.recover() lists what a person has to do"
                    if stops
                    else "give a longer timeout, or check arm.state",
                )

    def history(self) -> tuple[State, ...]:
        """The last states, oldest first."""
        return tuple(self.decode(sample) for sample in self.feed.history())

    def build(self, sample: StateSample) -> State:
        """The state of a sample; the last one is cached."""
        built = self._built
        if built is not None and built[0] == sample.number:
            return built[1]
        state = self.decode(sample)
        self._built = (sample.number, state)
        return state

    def decode(self, sample: StateSample) -> State:
        """The state of a sample."""
        return read_state(
            sample.body,
            self.link.offset,
            self.clock.nanos,
            received=sample.received,
            signals=self.signals,
        )

    def state_of(self, message: wire.ConditionFired | wire.TriggerFired) -> State | None:
        """The robot's state when a condition or trigger fired; None if the cabinet did not report it."""
        return read_firing(message, self.link.offset, self.clock.nanos)

    def result_of(self, message: wire.MotionFinished) -> Result:
        """The result of a program, with the joint positions measured at its end."""
        state = self.newest()
        if state is not None and state.joints is not None:
            state = state.with_groups(joints=replace(state.joints, q=np.array(message.q)))
        return read_result(message, state)

    # --------------------------------------------------------------------------------- recording

    @property
    def facts(self) -> Mapping[str, str]:
        """Texts about robot and connection, for a recording."""
        welcome = self.welcome
        return {
            "robot": self.robot.name,
            "title": self.robot.title,
            "cabinet": welcome.cabinet,
            "software": welcome.software,
            "virtual": str(welcome.virtual).lower(),
            "heptarm": __version__,
            "rate": f"{self.options.rate:g}",
            "groups": ",".join(self.options.groups),
            "clock_rate": f"{self.real_time_factor:.6g}",
            "protocol": f"{wire.MAJOR}.{wire.MINOR}",
            "tools": json.dumps([plain(tool) for tool in self._tools]),
        }

    @property
    def _tools(self) -> tuple[wire.ToolInfo, ...]:
        """Tools of the cabinet, and what is attached; of the same name the newest."""
        event = self.events.attached
        latest = () if event is None else (event.tool, event.workpiece)
        return tuple({tool.name: tool for tool in (*self.welcome.tools, *latest) if tool}.values())

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the cabinet's signals by their indices."""
        return tuple(signal.name for signal in self.signals)

    @property
    def state_rate(self) -> float:
        """Pushed states per second [Hz]."""
        return self.options.rate

    def raise_rate(self, rate: float) -> Callable[[], None]:
        """Have at least so many states pushed per second [Hz]; returns what restores the rate before."""
        before = self.options.rate
        if rate <= before:
            return lambda: None
        self.subscribe(rate, self.options.groups)

        def restore() -> None:
            if self.options.rate == rate and self.is_connected:
                self.subscribe(before, self.options.groups)

        return restore

    def nanos(self) -> int:
        """Our clock [ns]."""
        return self.clock.nanos()

    def to_ours(self, stamp: int) -> int:
        """Our clock at a time of the cabinet's [ns]."""
        return self.link.offset.to_ours(stamp)

    def open_samples(self, size: int) -> SampleQueue:
        """A queue that receives every pushed state from now on."""
        return self.feed.open(size)

    def close_samples(self, queue: SampleQueue) -> None:
        """End such a queue."""
        self.feed.close(queue)

    def kept_samples(self) -> list[StateSample]:
        """The pushed states of the last 30 s."""
        return self.feed.kept()

    def capture(self, reason: str) -> BlackBoxFile | None:
        """Begin to write the black box; returns at once."""
        return self.black_box.capture(reason)

    # ---------------------------------------------------------------------------- from the link

    def _on_event(self, message: Message) -> None:
        """Note an event in the journal and pass it on."""
        self.journal.add(EVENT, message)
        if isinstance(message, wire.SafetyChanged):
            before, self._stops = self._stops, message.bits & _STOPPED
            if self._stops & ~before:
                self.capture("safety stop")
        elif isinstance(message, wire.StatesMissed):
            self.feed.note_gap(message.count)
        self.events.dispatch(message)

    def _on_control(self, message: wire.ControlChanged) -> None:
        self.controller = message.controller
        if self.in_control and self.is_connected and message.session != self.welcome.session:
            self.in_control = False
            _log.warning("control is lost: %s", message.text)

    def _on_lost(self, error: HeptarmError) -> None:
        """End all programs with the error; an observer then reconnects by itself, a controller does not."""
        lost_at = self.clock.nanos()
        self.journal.add(ERROR, error.text)
        error.with_black_box(self.capture("connection lost"))
        self.events.lose(error)
        self.feed.wake()
        if self.in_control:
            return
        pause = _BACK_OFF
        while not self.closed.wait(pause):
            if self.cabinet is not None and not self.cabinet.is_running:
                return
            try:
                with self._lock:
                    if self.closed.is_set() or self.is_connected:
                        return
                    self.open()
                self.feed.note_gap(round((self.clock.nanos() - lost_at) * 1e-9 * self.options.rate))
                _log.info("reconnected")
                return
            except HeptarmError as failure:
                _log.info("not reconnected: %s", failure)
                pause = min(2 * pause, _MAX_BACK_OFF)


#: All connections, for a fork of the process.
_connections: weakref.WeakSet[Connection] = weakref.WeakSet()


def _abandon_connections() -> None:
    for connection in list(_connections):
        connection.abandon()


if hasattr(os, "register_at_fork"):  # not on Windows, where no process forks
    os.register_at_fork(after_in_child=_abandon_connections)


def _not_connected() -> ConnectionLost:
    return ConnectionLost("the arm is not connected", hint="heptarm.connect(...) makes a connected arm")


def _closed() -> ConnectionLost:
    return ConnectionLost("the arm was closed", hint="connect again")
