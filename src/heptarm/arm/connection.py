"""An arm's connection: one link after the other, who controls, requests, what is pushed."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from heptarm import __version__
from heptarm.arm.events import Events
from heptarm.arm.feed import Feed, Sample
from heptarm.arm.groups import groups_of
from heptarm.arm.handle import MotionHandle
from heptarm.arm.link import Link
from heptarm.arm.options import Options
from heptarm.arm.private_cabinet import PrivateCabinet
from heptarm.arm.reading import read_firing, read_result, read_robot, read_signals, read_state
from heptarm.errors import CommandRejected, ConnectionLost, HeptarmError, Timeout
from heptarm.io.clock import Clock
from heptarm.io.transport import Transport
from heptarm.values.arrays import within
from heptarm.values.collision import Collision, CollisionGuard
from heptarm.values.condition import Condition
from heptarm.values.io import Signal
from heptarm.values.result import Result
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.values.trigger import Trigger
from heptarm.wire import messages as wire
from heptarm.wire.messages import Message

_log = logging.getLogger("heptarm.arm")

#: Pauses between attempts to reconnect [s].
_BACK_OFF, _LONGEST_BACK_OFF = 0.1, 2.0
#: Longest wait for a state before looking whether any will come [s].
_LOOK = 0.2


class Connection:
    """What stands behind an arm; links come and go, it stays.

    Args:
        dial: makes a transport to the cabinet.
        options: how to talk to it.
        clock: this side's clock.
        cabinet: the private virtual cabinet at the other end, if it is one.

    Attributes:
        feed: states that are pushed.
        events: what else the cabinet tells.
        controls: whether this client took control and has not lost it.
        controller: name of the client that controls the robot; empty: nobody.
        closed: set when the arm is closed.
        guard: the collision guard in force.
        on_collision: told of each collision that it meets.
        signals: those that the cabinet has.
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
        self.feed = Feed(clock)
        self.controls = False
        self.controller = ""
        self.closed = threading.Event()
        self.guard: CollisionGuard | None = None
        self.on_collision: Callable[[Collision], None] | None = None
        self._dial = dial
        self._link: Link | None = None
        self._welcome: wire.Welcome | None = None
        self._robot: RobotModel | None = None
        self._read: tuple[int, State] | None = None
        self.events = Events(self._on_control)
        self.signals: tuple[Signal, ...] = ()
        self._lock = threading.RLock()

    # ---------------------------------------------------------------------------------- the link

    @property
    def link(self) -> Link:
        """The present link, standing or lost.

        Raises:
            ConnectionLost: there was none yet.
        """
        if self._link is None:
            raise ConnectionLost("the arm is not connected")
        return self._link

    @property
    def welcome(self) -> wire.Welcome:
        """What the cabinet said of itself."""
        if self._welcome is None:
            raise ConnectionLost("the arm is not connected")
        return self._welcome

    @property
    def robot(self) -> RobotModel:
        """The connected robot and its limits."""
        if self._robot is None:
            raise ConnectionLost("the arm is not connected")
        return self._robot

    @property
    def title(self) -> str:
        """KUKA's name of the robot, for people."""
        return "not connected" if self._robot is None else self._robot.title

    @property
    def stands(self) -> bool:
        """Whether the link stands."""
        return self._link is not None and self._link.error is None

    @property
    def pace(self) -> float:
        """Cabinet seconds per second of ours."""
        return max(self.link.offset.rate, 0.001)

    def open(self) -> None:
        """Make a link, and subscribe."""
        link = self._new_link(self.events.take, self.feed.push, self._on_lost)
        self._welcome = link.open(name=self.options.name, version=__version__, timeout=self.options.timeout)
        self.controller = self._welcome.controller
        self.controls = False
        self.events.forget()
        self._link = link
        try:
            self._robot = read_robot(self._welcome.robot)
            self.signals = read_signals(self._welcome.signals)
            self.subscribe(self.options.rate, self.options.groups)
        except BaseException:
            link.close()
            raise

    def reopen(self) -> None:
        """Make a new link instead of the old one; take control again if it was had."""
        with self._lock:
            self.check_open()
            controls = self.controls
            if self._link is not None:
                self._link.close()
            self.open()
            if controls:
                self.take_control()

    def close(self) -> None:
        """End the link, what waits for it, and a private cabinet."""
        if self._link is not None:
            self._link.close()
        self.events.lose(ConnectionLost("the arm was closed"))
        self.feed.wake()
        if self.cabinet is not None:
            self.cabinet.close()

    def close_once(self) -> bool:
        """Note that the arm is closed; False if it was before."""
        with self._lock:
            was_open = not self.closed.is_set()
            self.closed.set()
            return was_open

    def check_open(self) -> None:
        """Raise ConnectionLost if the arm was closed."""
        if self.closed.is_set():
            raise ConnectionLost("the arm was closed", hint="connect again")

    def end(self) -> HeptarmError | None:
        """Why no more states will come; None while they may (an observer reconnects by itself)."""
        error = self.link.error
        if error is None:
            return None
        if self.closed.is_set():
            return ConnectionLost("the arm was closed", hint="connect again")
        if not self.controls:
            return None
        return ConnectionLost(
            f"the connection is lost: {error.text}", code=error.code, hint="arm.reconnect() makes a new one"
        )

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
        )

    # ---------------------------------------------------------------------------------- requests

    def request(self, message: Message) -> None:
        """Ask for something that is answered with no more than yes or no; raises as `Link.request` does."""
        self.link.accept(message, timeout=self.options.timeout)

    def take_control(self) -> None:
        """Ask to control."""
        lost = wire.OnLost.FINISH if self.options.finishes else wire.OnLost.STOP
        self.link.expect_watchdog(self.options.watchdog)
        self.request(wire.TakeControl(watchdog=self.options.watchdog, on_lost=lost))
        self.controls = True

    def release_control(self) -> None:
        """Give control back."""
        self.controls = False  # before the cabinet tells everybody
        self.request(wire.ReleaseControl())
        self.link.expect_watchdog(float("inf"))

    def subscribe(self, rate: float, groups: Sequence[str]) -> None:
        """Choose what is pushed, now and after a reconnection."""
        chosen = groups_of(groups, self.welcome.groups)
        within(rate, "rate", 0.0, self.welcome.max_rate, unit="Hz")
        self.request(wire.Subscribe(groups=chosen, rate=rate))
        self.link.expect_states(rate * self.pace)
        self.options = replace(self.options, rate=rate, groups=tuple(groups))

    def run(
        self,
        message: wire.Run | wire.ServoOpen | wire.FriOpen,
        count: int,
        limit: float,
        *,
        until: tuple[Condition, ...] = (),
        triggers: tuple[tuple[Trigger, ...], ...] = (),
    ) -> MotionHandle:
        """Send a program of `count` motions, a servo motion or an overlay.

        The handle waits for up to `limit` seconds. `until` says which part of its break condition each node is,
        `triggers` which each motion has.
        """
        handle = MotionHandle(self, count, limit, until=until, guard=self.guard, triggers=triggers)
        handle.is_stiff = isinstance(message, wire.Run) and _ends_stiffly(message.items[-1])

        def claim(answer: Message) -> None:
            if isinstance(answer, wire.Accepted):
                self.events.claim(handle, answer.id)

        self.link.accept(message, timeout=self.options.timeout, on_answer=claim)
        return handle

    def servo_status(self, number: int) -> wire.ServoStatus | None:
        """What the cabinet said last of a servo motion's stream."""
        return self.events.servo_status(number)

    def cancel(self, handle: MotionHandle) -> None:
        """End a program; nothing happens if it has ended."""
        if handle.done:
            return
        try:
            self.request(wire.Cancel(id=handle.id))
        except CommandRejected:
            if self.events.awaits(handle) and not handle.done:  # otherwise it has just ended by itself
                raise

    def stop(self, kind: wire.StopKind) -> None:
        """Stop whatever runs; through a new link if the old one was lost while the arm may still move."""
        message = wire.Stop(kind=kind)
        try:
            self.request(message)
        except ConnectionLost:
            if self.closed.is_set():
                raise
            _log.warning("the connection is lost; stopping the arm through a new one")
            link = self._new_link(lambda _: None, lambda *_: None, lambda _: None)
            try:
                link.open(
                    name=f"{self.options.name} (stop)", version=__version__, timeout=self.options.timeout
                )
                link.request(message, timeout=self.options.timeout)
            finally:
                link.close()

    @contextlib.contextmanager
    def stopping_on_interrupt(self) -> Iterator[None]:
        """A block in which Ctrl-C stops the arm (of a controller) before it goes its way."""
        try:
            yield
        except KeyboardInterrupt:
            if self.controls and not self.closed.is_set():
                try:
                    self.stop(wire.StopKind.PATH)
                except HeptarmError as error:
                    _log.error("Ctrl-C: the arm could not be stopped: %s", error)
            raise

    # ------------------------------------------------------------------------------------ states

    def newest(self) -> State | None:
        """The newest state, however old; None before the first."""
        sample = self.feed.newest
        return None if sample is None else self.build(sample)

    def wait_for(self, condition: Callable[[State], object], timeout: float) -> State:
        """Wait until a condition holds for a pushed state.

        Raises:
            Timeout: it did not hold in time.
            ConnectionLost: the connection has ended.
        """
        deadline = self.clock.nanos() + round(timeout * 1e9)
        seen = 0
        while True:
            rest = (deadline - self.clock.nanos()) * 1e-9
            sample = self.feed.after(seen, min(max(rest, 0.0), _LOOK))
            if sample is not None:
                seen = sample.number
                state = self.build(sample)
                if condition(state):
                    return state
            else:
                error = self.end()
                if error is not None:
                    raise error
            if rest <= 0:
                raise Timeout(f"the condition did not hold within {timeout:g} s")

    def history(self) -> tuple[State, ...]:
        """The last states, oldest first: evidence for errors."""
        return tuple(self.decode(sample) for sample in self.feed.history())

    def build(self, sample: Sample) -> State:
        """The state of a sample; the last one is kept."""
        read = self._read
        if read is not None and read[0] == sample.number:
            return read[1]
        state = self.decode(sample)
        self._read = (sample.number, state)
        return state

    def decode(self, sample: Sample) -> State:
        """The state of a sample."""
        return read_state(sample.body, self.link.offset, self.clock.nanos, self.signals)

    def state_of(self, message: wire.ConditionFired | wire.TriggerFired) -> State | None:
        """Where the robot was when a condition or a trigger fired; None if the cabinet did not tell."""
        return read_firing(message, self.link.offset, self.clock.nanos)

    def result_of(self, message: wire.MotionFinished) -> Result:
        """The result that an event tells, with the joint positions measured at its end."""
        state = self.newest()
        if state is not None and state.joints is not None:
            state = replace(state, joints=replace(state.joints, q=np.array(message.q)))
        return read_result(message, state)

    # ---------------------------------------------------------------------------- from the link

    def _on_control(self, message: wire.ControlChanged) -> None:
        self.controller = message.controller
        if self.controls and message.session != self.welcome.session:
            self.controls = False
            _log.warning("control is lost: %s", message.text)

    def _on_lost(self, error: HeptarmError) -> None:
        """A link's last act: motions end with an error; an observer goes on by itself, a controller does not."""
        self.events.lose(error)
        self.feed.wake()
        if self.controls:
            return
        pause = _BACK_OFF
        while not self.closed.wait(pause):
            if self.cabinet is not None and not self.cabinet.is_running:
                return
            try:
                with self._lock:
                    if self.closed.is_set() or self.stands:
                        return
                    self.open()
                _log.info("reconnected")
                return
            except HeptarmError as failure:
                _log.info("not reconnected: %s", failure)
                pause = min(2 * pause, _LONGEST_BACK_OFF)

def _ends_stiffly(item: wire.Item) -> bool:
    """Whether the arm does not yield at the end of an item, so that it has to be where it was sent."""
    stiff = item.mode is None or isinstance(item.mode, wire.PositionMode)
    return stiff and not isinstance(item.motion, wire.HandGuide)
