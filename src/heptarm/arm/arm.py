"""The arm: everything that a program does with the robot goes through it."""

from __future__ import annotations

import atexit
import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Literal

import numpy as np

from heptarm import __version__
from heptarm.arm import program
from heptarm.arm.feed import Feed, Sample, States
from heptarm.arm.handle import MotionHandle
from heptarm.arm.link import Link
from heptarm.arm.private_cabinet import PrivateCabinet
from heptarm.arm.reading import read_result, read_robot, read_state
from heptarm.errors import (
    CommandRejected,
    ConnectionLost,
    HeptarmError,
    ShapeError,
    StaleState,
    Timeout,
)
from heptarm.io.clock import Clock
from heptarm.io.transport import Transport
from heptarm.values.arrays import within
from heptarm.values.motion import Motion
from heptarm.values.result import Result
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.wire import messages as wire
from heptarm.wire.messages import Message

_log = logging.getLogger("heptarm.arm")

#: What a state contains unless something else is asked for.
GROUPS = ("joints", "torques", "pose", "wrench", "motion", "safety")
_WHEN = {"queue": wire.When.QUEUE, "replace": wire.When.REPLACE, "reject": wire.When.REJECT}
_STOPS = {kind.name.lower(): kind for kind in wire.StopKind}
#: Below this speed of every axis the arm counts as being at rest [rad/s].
_REST = 0.01
_REST_TIMEOUT = 10.0
_DAY = 86400.0
#: Pauses between attempts to reconnect [s].
_BACK_OFF, _LONGEST_BACK_OFF = 0.1, 2.0
#: States a stream of all states keeps for a slow loop.
_STREAM_SIZE = 2000


@dataclass(frozen=True, slots=True)
class Options:
    """How to talk to the cabinet; see `connect`."""

    name: str = "heptarm"
    key: bytes | None = None
    timeout: float = 5.0
    rate: float = 100.0
    groups: tuple[str, ...] = GROUPS
    finishes: bool = False
    watchdog: float = 0.5


class Arm:
    """A connected arm; made by `connect`. Its methods may be called from any thread.

    In a `with` block it is left at rest, however the block ends.
    """

    def __init__(
        self,
        dial: Callable[[], Transport],
        options: Options,
        *,
        clock: Clock,
        cabinet: PrivateCabinet | None = None,
    ) -> None:
        self._dial = dial
        self._options = options
        self._clock = clock
        self._cabinet = cabinet
        self._feed = Feed(clock)
        self._link: Link | None = None
        self._welcome: wire.Welcome | None = None
        self._robot: RobotModel | None = None
        self._read: tuple[int, State] | None = None
        self._handles: dict[int, MotionHandle] = {}
        self._unclaimed: deque[Message] = deque(maxlen=256)
        self._controls = False
        self._controller = ""
        self._speed = 1.0
        self._lock = threading.RLock()
        self._closed = threading.Event()

    # ------------------------------------------------------------------------------- connection

    def open(self, *, control: bool) -> None:
        """Connect; `connect` has done this already. Raises as `connect` does."""
        atexit.register(self.close)
        self._connect()
        if control:
            self.take_control()
        if self._options.rate > 0 and self._feed.after(0, self._options.timeout) is None:
            raise Timeout(f"the cabinet pushed no state within {self._options.timeout:g} s")

    def _connect(self) -> None:
        link = Link(
            self._dial(),
            self._clock,
            key=self._options.key,
            on_event=self._on_event,
            on_state=self._feed.push,
            on_lost=self._on_lost,
        )
        self._welcome = link.open(name=self._options.name, version=__version__, timeout=self._options.timeout)
        self._controller = self._welcome.controller
        self._controls = False
        self._unclaimed.clear()
        self._link = link
        try:
            self._robot = read_robot(self._welcome.robot)
            self.subscribe(rate=self._options.rate, groups=self._options.groups)
        except BaseException:
            link.close()
            raise

    def reconnect(self) -> None:
        """Make a new connection after the old one was lost; a controller takes control again.

        Raises:
            ConnectFailed: nobody answers.
            NotInControl: another client has taken control meanwhile.
        """
        with self._lock:
            self._not_closed()
            controls = self._controls
            if self._link is not None:
                self._link.close()
            self._connect()
            if controls:
                self.take_control()

    def take_control(self) -> None:
        """Ask to control.

        Raises:
            NotInControl: another client controls the robot; the text names it.
        """
        lost = wire.OnLost.FINISH if self._options.finishes else wire.OnLost.STOP
        link = self._linked()
        link.expect_watchdog(self._options.watchdog)
        self._request(wire.TakeControl(watchdog=self._options.watchdog, on_lost=lost))
        self._controls = True

    def release_control(self) -> None:
        """Give control back; what runs is stopped."""
        self._controls = False  # before the cabinet tells everybody
        self._request(wire.ReleaseControl())
        self._linked().expect_watchdog(float("inf"))

    def close(self) -> None:
        """Leave the arm at rest and disconnect; a private simulator ends. Closing twice is legal.

        A controller stops what runs and waits until the arm rests; an observer just leaves.
        """
        with self._lock:
            if self._closed.is_set():
                return
            self._closed.set()
        try:
            if self._controls and self._link is not None and self._link.error is None:
                self._come_to_rest()
        finally:
            atexit.unregister(self.close)
            if self._link is not None:
                self._link.close()
            self._lose_handles(ConnectionLost("the arm was closed"))
            self._feed.wake()
            if self._cabinet is not None:
                self._cabinet.close()

    def _come_to_rest(self) -> None:
        try:
            self.subscribe(rate=100.0, groups=("joints", "motion", "safety"))
            self.stop()
            self.wait_for_rest()
            self.release_control()
        except HeptarmError as error:
            _log.warning("closing: %s", error)

    def __enter__(self) -> Arm:
        """The arm itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()

    def __repr__(self) -> str:
        """Short form."""
        robot = self._robot.title if self._robot is not None else "no robot"
        link = self._link
        state = "closed" if self._closed.is_set() else "lost" if link is None or link.error else "connected"
        return f"<Arm {robot}, {state}, {'in control' if self._controls else 'observing'}>"

    # ------------------------------------------------------------------------------- properties

    @property
    def robot(self) -> RobotModel:
        """The connected robot and its limits."""
        assert self._robot is not None
        return self._robot

    @property
    def capabilities(self) -> tuple[str, ...]:
        """What this cabinet can do: "ptp", "lin", ..."""
        return self._greeted().capabilities

    @property
    def is_virtual(self) -> bool:
        """Whether the robot is simulated."""
        return self._greeted().virtual

    @property
    def software(self) -> str:
        """Version of the cabinet application."""
        return self._greeted().software

    @property
    def cabinet(self) -> str:
        """Name of the cabinet."""
        return self._greeted().cabinet

    @property
    def in_control(self) -> bool:
        """Whether this client controls the robot, as far as is known."""
        return self._controls and self._link is not None and self._link.error is None

    @property
    def controller(self) -> str:
        """Name of the client that controls the robot; empty: nobody."""
        return self._controller

    @property
    def connected(self) -> bool:
        """Whether the connection stands."""
        return self._link is not None and self._link.error is None

    @property
    def speed(self) -> float:
        """Ceiling of the speed of all motions sent, a fraction of each axis' maximum in (0, 1].

        A motion's own speed can only be lower.
        """
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed = within(value, "speed", 0.0, 1.0, above=True)

    # ------------------------------------------------------------------------------------ state

    @property
    def state(self) -> State:
        """The newest pushed state; never a question to the cabinet.

        Raises:
            StaleState: it is too old to act on; the text says how old.
            ConnectionLost: the connection has ended.
        """
        sample = self._feed.newest
        rate = self._options.rate
        if rate <= 0:
            raise StaleState("no states are subscribed", hint="arm.subscribe(rate=100)")
        limit = max(1.0, 10.0 / (rate * self._pace()))
        age = float("inf") if sample is None else (self._clock.nanos() - sample.received) * 1e-9
        if sample is None or age > limit:
            self._not_closed()
            error = self._lost()
            if error is not None:
                raise error
            raise StaleState(
                f"the newest state is {age:.2f} s old; allowed is {limit:g} s",
                value=age,
                allowed=f"[0, {limit:g}] s",
                hint="check the connection and the load of this machine",
            )
        return self._build(sample)

    def states(
        self, *, rate: float | None = None, duration: float | None = None, size: int = _STREAM_SIZE
    ) -> States:
        """States one after the other, never one twice.

        Args:
            rate: at most this many per second [Hz], the newest each time; None: every state that is pushed, in order.
            duration: end after this time [s]; None: never.
            size: without a rate, how many states are kept for a slow loop; `States.lost` counts what was dropped.

        Raises:
            LimitError: a rate or duration that is not positive.
        """
        self._not_closed()
        return States(
            self._feed,
            self._clock,
            build=self._build,
            check=self._lost,
            rate=None if rate is None else within(rate, "rate", 0.0, 1e4, above=True, unit="Hz"),
            duration=None if duration is None else within(duration, "duration", 0.0, 1e9, unit="s"),
            size=size,
        )

    def wait_until(self, condition: Callable[[State], object], *, timeout: float = 30.0) -> State:
        """Wait until a condition holds for a pushed state; looked at here, not on the cabinet.

        Args:
            condition: called with each state that is seen.
            timeout: how long to wait [s].

        Returns:
            The state for which it held.

        Raises:
            Timeout: it did not hold in time.
            ConnectionLost: the connection has ended.
        """
        deadline = self._clock.nanos() + round(within(timeout, "timeout", 0.0, 1e9, unit="s") * 1e9)
        seen = 0
        with self.stopping_on_interrupt():
            while True:
                rest = (deadline - self._clock.nanos()) * 1e-9
                sample = self._feed.after(seen, min(max(rest, 0.0), 0.2))
                if sample is not None:
                    seen = sample.number
                    state = self._build(sample)
                    if condition(state):
                        return state
                else:
                    self._not_closed()
                    error = self._lost()
                    if error is not None:
                        raise error
                if rest <= 0:
                    raise Timeout(f"the condition did not hold within {timeout:g} s")

    def wait_for_rest(self, *, timeout: float = _REST_TIMEOUT) -> State:
        """Wait until nothing runs, nothing waits, and no axis turns.

        Raises:
            Timeout: the arm does not come to rest in time.
            StaleState: the subscribed groups lack "joints" or "motion".
        """
        quiet = 0
        newest = self._feed.newest  # what was sampled before this call proves nothing
        first = 0 if newest is None else self._decode(newest).stamp

        def rests(state: State) -> bool:
            nonlocal quiet
            if state.joints is None or state.motion is None:
                raise StaleState(
                    'waiting for rest needs the groups "joints" and "motion"',
                    hint='arm.subscribe(groups=("joints", "motion"))',
                )
            fast = np.abs(state.dq[np.isfinite(state.dq)])
            calm = not state.motion.active and not state.motion.queued and bool((fast < _REST).all())
            quiet = quiet + 1 if calm and state.joints.stamp > first else 0
            return quiet >= 2

        return self.wait_until(rests, timeout=timeout)

    def subscribe(self, *, rate: float = 100.0, groups: Sequence[str] = GROUPS) -> None:
        """Choose what is pushed; a new choice replaces the old.

        Args:
            rate: states per second [Hz]; 0: none.
            groups: "joints", "torques", "pose", "wrench", "motion", "safety", "io", "mode".

        Raises:
            CommandRejected: a group that the cabinet does not have.
            LimitError: a rate that the cabinet does not reach.
        """
        chosen = wire.Groups.NONE
        offered = self._greeted().groups
        for name in groups:
            group = wire.Groups.__members__.get(str(name).upper(), wire.Groups.NONE)
            if not group or not group & offered:
                names = [one.name.lower() for one in wire.Groups if one & offered and one.name]
                raise CommandRejected(
                    f"no group {name!r}",
                    parameter="groups",
                    value=name,
                    allowed=", ".join(names),
                    hint=f"choose from {', '.join(names)}",
                )
            chosen |= group
        within(rate, "rate", 0.0, self._greeted().max_rate, unit="Hz")
        self._request(wire.Subscribe(groups=chosen, rate=rate))
        self._linked().expect_states(rate * self._pace())
        self._options = replace(self._options, rate=rate, groups=tuple(groups))

    # ---------------------------------------------------------------------------------- motion

    def move(
        self,
        motion: Motion | Sequence[Motion],
        *,
        speed: float | None = None,
        timeout: float | None = None,
    ) -> Result:
        """Carry out a motion, or several as one batch, and wait until it has ended.

        Args:
            motion: what to do.
            speed: ceiling for this call, (0, 1]; the lower one of this and `arm.speed` counts.
            timeout: how long to wait [s]; None: three times as long as it can take, and more.

        Returns:
            How it ended.

        Raises:
            CommandRejected: refused before anything moved; LimitError and others say which value and what is allowed.
            MotionAborted: ended under way; carries cause, state and history.
            ConnectionLost: the cabinet was lost; it stops the arm.
            Timeout: not ended in time; the arm was stopped.
        """
        motions = program.listed(motion)
        if timeout is None and program.is_endless(motions):
            raise ShapeError(
                "this program ends only when it is cancelled",
                parameter="timeout",
                hint="give a timeout, a hold with a duration, or use arm.start()",
            )
        with self.stopping_on_interrupt():
            handle = self._start(motions, speed=speed, when="queue")
            try:
                return handle.wait(timeout=timeout)
            except Timeout:
                handle.cancel()
                raise

    def start(
        self,
        motion: Motion | Sequence[Motion],
        *,
        speed: float | None = None,
        when: Literal["queue", "replace", "reject"] = "queue",
    ) -> MotionHandle:
        """Begin a motion, or several as one batch, and return at once.

        Args:
            motion: what to do.
            speed: ceiling for this call, (0, 1].
            when: while another one runs: "queue" behind it, "replace" it, or "reject" this one.

        Raises:
            CommandRejected: refused; ModeConflict if `when` is "reject" and something runs.
            ConnectionLost: the connection has ended.
        """
        with self.stopping_on_interrupt():
            return self._start(program.listed(motion), speed=speed, when=when)

    def _start(self, motions: tuple[Motion, ...], *, speed: float | None, when: str) -> MotionHandle:
        if when not in _WHEN:
            raise ShapeError(f"when is {when!r}; allowed are {', '.join(map(repr, _WHEN))}", parameter="when")
        ceiling = self._speed
        if speed is not None:
            ceiling = min(ceiling, within(speed, "speed", 0.0, 1.0, above=True))
        message = wire.Run(items=program.items(motions, self.robot, ceiling), when=_WHEN[when])
        handle = MotionHandle(self, len(motions), self._limit(motions, ceiling))

        def claim(answer: Message) -> None:
            if isinstance(answer, wire.Accepted):
                self._claim(handle, answer.id)

        self._linked().accept(message, timeout=self._options.timeout, on_answer=claim)
        return handle

    def _limit(self, motions: tuple[Motion, ...], ceiling: float) -> float:
        """Time after which waiting for them makes no sense [s], with what is before them in the queue."""
        own = program.longest(motions, self.robot, ceiling)
        before = sum(handle.limit for handle in list(self._handles.values()))
        newest = self.newest()
        override = newest.motion.override if newest is not None and newest.motion is not None else 1.0
        total = (own + before) / max(override, 0.01) / min(self._pace(), 1.0)
        return total if total < _DAY else _DAY

    def _pace(self) -> float:
        """Cabinet seconds per second of ours."""
        return max(self._linked().offset.rate, 0.001)

    def cancel(self, handle: MotionHandle) -> None:
        """End a program; `MotionHandle.cancel` is the same."""
        if handle.done:
            return
        try:
            self._request(wire.Cancel(id=handle.id))
        except CommandRejected:
            if handle.id in self._handles and not handle.done:  # otherwise it has just ended by itself
                raise

    def stop(self, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
        """Stop whatever runs and drop what waits; anybody may, at any time, from any thread, again and again.

        It returns when the cabinet has taken the order; `wait_for_rest` waits until the arm rests. If the connection
        was lost, a new one is made for it.

        Args:
            kind: "path": brake on the path; "fast": brake as hard as the axes allow; "after_motion": finish what
                runs and drop the rest.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        if kind not in _STOPS:
            raise ShapeError(
                f"kind is {kind!r}; allowed are {', '.join(map(repr, _STOPS))}", parameter="kind"
            )
        message = wire.Stop(kind=_STOPS[kind])
        try:
            self._request(message)
        except ConnectionLost:
            if self._closed.is_set():
                raise
            self._stop_anew(message)

    def _stop_anew(self, message: wire.Stop) -> None:
        """Stop through a fresh connection: the old one may have been lost while the arm still moves."""
        _log.warning("the connection is lost; stopping the arm through a new one")
        link = Link(
            self._dial(),
            self._clock,
            key=self._options.key,
            on_event=lambda _: None,
            on_state=lambda *_: None,
            on_lost=lambda _: None,
        )
        try:
            link.open(name=f"{self._options.name} (stop)", version=__version__, timeout=self._options.timeout)
            link.request(message, timeout=self._options.timeout)
        finally:
            link.close()

    def pause(self) -> None:
        """Pause on the path."""
        self._request(wire.Pause())

    def resume(self) -> None:
        """Go on after a pause."""
        self._request(wire.Resume())

    def set_override(self, value: float) -> None:
        """Set the application override: a factor in [0, 1] on every programmed speed, at once.

        Raises:
            LimitError: outside [0, 1].
        """
        self._request(wire.SetOverride(value=within(value, "override", 0.0, 1.0)))

    @contextlib.contextmanager
    def stopping_on_interrupt(self) -> Iterator[None]:
        """A block in which Ctrl-C stops the arm (of a controller) before it goes its way."""
        try:
            yield
        except KeyboardInterrupt:
            if self._controls and not self._closed.is_set():
                try:
                    self.stop()
                except HeptarmError as error:
                    _log.error("Ctrl-C: the arm could not be stopped: %s", error)
            raise

    # -------------------------------------------------------------------- for handles and streams

    def newest(self) -> State | None:
        """The newest state, however old; None before the first."""
        sample = self._feed.newest
        return None if sample is None else self._build(sample)

    def history(self) -> tuple[State, ...]:
        """The last states, oldest first: evidence for errors."""
        return tuple(self._decode(sample) for sample in self._feed.history())

    def result_of(self, message: wire.MotionFinished) -> Result:
        """The result that an event tells, with the joint positions measured at its end."""
        state = self.newest()
        if state is not None and state.joints is not None:
            state = replace(state, joints=replace(state.joints, q=np.array(message.q)))
        return read_result(message, state)

    def _build(self, sample: Sample) -> State:
        read = self._read
        if read is not None and read[0] == sample.number:
            return read[1]
        state = self._decode(sample)
        self._read = (sample.number, state)
        return state

    def _decode(self, sample: Sample) -> State:
        assert self._link is not None
        return read_state(sample.body, self._link.offset, self._clock.nanos)

    # ---------------------------------------------------------------------------- from the link

    def _on_event(self, message: Message) -> None:
        if isinstance(message, wire.MotionStarted | wire.ItemReached | wire.MotionFinished):
            handle = self._handles.get(message.id)
            if handle is None:
                self._unclaimed.append(message)  # its Accepted may still be on its way
            else:
                self._hand_over(handle, message)
        elif isinstance(message, wire.ControlChanged):
            self._controller = message.controller
            if self._welcome is not None and message.session != self._welcome.session and self._controls:
                self._controls = False
                _log.warning("control is lost: %s", message.text)
        elif isinstance(message, wire.SafetyChanged):
            _log.info("safety: %s", message.text)
        elif isinstance(message, wire.Notice):
            _log.log(_LEVELS[message.severity], "cabinet: %s", message.text)

    def _claim(self, handle: MotionHandle, number: int) -> None:
        handle.accepted(number)
        self._handles[number] = handle
        for message in list(self._unclaimed):
            if message.id == number:  # type: ignore[union-attr]
                self._hand_over(handle, message)

    def _hand_over(self, handle: MotionHandle, message: Message) -> None:
        if isinstance(message, wire.MotionFinished):
            self._handles.pop(message.id, None)
        handle.on_event(message)

    def _on_lost(self, error: HeptarmError) -> None:
        """The link's last act: motions end with an error; an observer goes on by itself, a controller does not."""
        self._lose_handles(error)
        self._feed.wake()
        if self._controls or self._closed.is_set():
            return
        pause = _BACK_OFF
        while not self._closed.wait(pause):
            if self._cabinet is not None and not self._cabinet.is_running:
                return
            try:
                with self._lock:
                    if self._closed.is_set() or (self._link is not None and self._link.error is None):
                        return
                    self._connect()
                _log.info("reconnected")
                return
            except HeptarmError as failure:
                _log.info("not reconnected: %s", failure)
                pause = min(2 * pause, _LONGEST_BACK_OFF)

    def _lose_handles(self, error: HeptarmError) -> None:
        while self._handles:
            with contextlib.suppress(KeyError):  # it has just ended by itself
                self._handles.popitem()[1].lose(error)

    # ----------------------------------------------------------------------------------- helpers

    def _request(self, message: Message) -> None:
        self._linked().accept(message, timeout=self._options.timeout)

    def _linked(self) -> Link:
        if self._link is None:
            raise ConnectionLost("the arm is not connected")
        return self._link

    def _greeted(self) -> wire.Welcome:
        if self._welcome is None:
            raise ConnectionLost("the arm is not connected")
        return self._welcome

    def _not_closed(self) -> None:
        if self._closed.is_set():
            raise ConnectionLost("the arm was closed", hint="connect again")

    def _lost(self) -> HeptarmError | None:
        """Why no more states will come; None while they may."""
        if self._closed.is_set():
            return ConnectionLost("the arm was closed", hint="connect again")
        error = self._linked().error
        if error is None or not self._controls:
            return None
        return ConnectionLost(
            f"the connection is lost: {error.text}", code=error.code, hint="arm.reconnect() makes a new one"
        )


_LEVELS = {
    wire.Severity.INFO: logging.INFO,
    wire.Severity.WARNING: logging.WARNING,
    wire.Severity.ERROR: logging.ERROR,
}
