"""Handles of programs that were sent to the cabinet: wait for, cancel and observe them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isnan, nan
from types import TracebackType
from typing import Any, ClassVar

import numpy as np

from heptarm import errors
from heptarm.arm.link.connection import Connection
from heptarm.arm.link.state_stream import States
from heptarm.arm.translate.errors import error_of
from heptarm.errors import (
    ArrivalError,
    CommandRejected,
    ConnectionLost,
    HeptarmError,
    MotionAborted,
    MotionError,
    NotReady,
    Starved,
    StreamError,
    Timeout,
    without_java,
)
from heptarm.values.checks import callback as check_callback
from heptarm.values.checks import integer, scalar, within
from heptarm.values.condition.condition import Condition, condition_nodes
from heptarm.values.condition.reaction import Reaction
from heptarm.values.condition.trigger import Trigger
from heptarm.values.result import Cause, MotionEvent, Result
from heptarm.values.sealed import Sealed
from heptarm.wire import messages as wire
from heptarm.wire.codes import MEANINGS
from heptarm.wire.messages import (
    ConditionFired,
    ItemReached,
    Message,
    MotionFinished,
    MotionStarted,
    SegmentReached,
    TriggerFired,
)

_log = logging.getLogger("heptarm.arm")


#: Longest timeout [s].
MAX_TIMEOUT = 1e9


def check_timeout(timeout: float) -> float:
    """Check the longest wait that a caller gave [s].

    Raises:
        ShapeError: it is not a number.
        LimitError: it is negative, NaN or too long.
    """
    return within(scalar(timeout, "timeout"), "timeout", 0.0, MAX_TIMEOUT, unit="s")


class Block(Sealed, ABC):
    """Base of what is used in a `with` block: leaving the block closes it.

    Attributes:
        what: its name in the log.
    """

    what: ClassVar[str]

    @abstractmethod
    def close(self) -> None:
        """End it and raise the error that ended it early, if any; calling it again has no effect."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it; its own error is only logged if the block ends with another one."""
        try:
            self.close()
        except HeptarmError as failure:
            if error is None:
                raise
            _log.warning("closing the %s: %s", self.what, failure)


@dataclass(frozen=True)
class BreakRule:
    """A break condition for every motion of a block; see `Arm.breaking_on`.

    Attributes:
        condition: ends the motion when it holds.
        error: makes the error of a motion that it ended; None: the motion ends with a result.
        then: reaction of motions that name none.
    """

    condition: Condition
    error: Callable[[Result], HeptarmError] | None
    then: Reaction = "stay"

    def ended(self, result: Result) -> bool:
        """Whether this condition ended a motion."""
        return result.stopped_by in tuple(part for _, part in condition_nodes(self.condition))


#: Ends that are results; all others are errors.
_GOOD = (Cause.FINISHED, Cause.CANCELLED, Cause.CONDITION, Cause.REPLACED)
#: States that a stream of a motion keeps for a slow loop: 100 s of them at 1 kHz.
STREAM_SIZE = 100_000
LONGEST_STREAM = 1_000_000
#: States that may overtake the event that a motion has begun.
_OVERTAKING = 20
#: Longest wait for the end of a motion whose await was cancelled [s].
_BRAKING = 10.0
#: In position control a motion that ends farther from its target than this has not arrived [rad].
ARRIVAL_TOLERANCE = 0.02

_ABORTED = {
    Cause.STOPPED: "was stopped",
    Cause.LOST: "was stopped because the cabinet lost its controller",
    Cause.FAILED: "failed",
    Cause.SAFETY: "was ended by a safety function",
    Cause.DROPPED: "was dropped because a motion before it failed",
    Cause.STARVED: "was stopped",
}


class MotionHandle(Sealed):
    """A program that was sent to the cabinet; made by `Arm.start`.

    It can be awaited in asyncio; a cancelled await stops the arm. Its id is the cabinet's.
    """

    def __init__(
        self,
        connection: Connection,
        *,
        count: int,
        limit: float,
        until: tuple[Condition, ...] = (),
        triggers: tuple[tuple[Trigger, ...], ...] = (),
        breaks: tuple[BreakRule, ...] = (),
        is_stiff: bool = False,
    ) -> None:
        self._connection = connection
        self._count = count
        self._limit = limit
        self._until = until
        self._triggers = triggers
        self._breaks = breaks
        self._is_stiff = is_stiff
        self._changed = threading.Condition()  # guards what the link thread writes and others read
        self._events: list[MotionEvent] = []
        self._listeners: list[Callable[[MotionEvent], None]] = []
        self._item = self._segment = -1
        self._furthest = 0.0
        self._fired_at: wire.ConditionFired | None = None
        self._id = 0
        self._begun = threading.Event()
        self._future: Future[Result] = Future()
        self._first_sample = connection.feed.count
        self._last_sample = 0

    @classmethod
    def send(
        cls,
        connection: Connection,
        message: wire.Run | wire.ServoOpen | wire.FriOpen,
        *,
        count: int = 1,
        limit: float = inf,
        until: tuple[Condition, ...] = (),
        triggers: tuple[tuple[Trigger, ...], ...] = (),
        breaks: tuple[BreakRule, ...] = (),
    ) -> MotionHandle:
        """Send a program, a servo motion or an FRI overlay.

        Args:
            connection: to the cabinet.
            message: the program.
            count: number of its motions.
            limit: longest plausible duration, for which `wait` waits [s].
            until: for each node of its break condition the part of the condition that the user wrote.
            triggers: those of each motion.
            breaks: the rules whose conditions are part of its break condition.

        Raises:
            CommandRejected: the cabinet refuses it.
            ConnectionLost: the connection has ended.
        """
        handle = cls(
            connection,
            count=count,
            limit=limit,
            until=until,
            triggers=triggers,
            breaks=breaks,
            is_stiff=isinstance(message, wire.Run) and _ends_stiff(message.items[-1]),
        )
        connection.run(message, handle)
        return handle

    def __repr__(self) -> str:
        """Short form."""
        state = "failed" if self.error else "done" if self.done else "running" if self.started else "waiting"
        return f"<MotionHandle {self._id}: {state}>"

    @property
    def id(self) -> int:
        """The cabinet's number of the program."""
        return self._id

    @property
    def limit(self) -> float:
        """How long `wait` waits by default [s]."""
        return self._limit

    @property
    def started(self) -> bool:
        """Whether the first motion has begun."""
        return self._item >= 0

    @property
    def done(self) -> bool:
        """Whether it has ended, by whatever cause."""
        return self._future.done()

    @property
    def result(self) -> Result | None:
        """How it ended; None while it has not, or if it ended with an error; see `error`."""
        if not self._future.done() or self._future.exception() is not None:
            return None
        return self._future.result()

    @property
    def error(self) -> HeptarmError | None:
        """The error with which it ended, which `wait` raises; None while it runs, or if it ended with a result."""
        error = self._future.exception() if self._future.done() else None
        return error if isinstance(error, HeptarmError) else None

    @property
    def progress(self) -> float:
        """Completed fraction of the program, [0, 1]; each motion counts the same. It never decreases."""
        result = self.result
        if result is not None and result.cause is Cause.FINISHED:
            return 1.0
        state = None if self.done else self._connection.newest()
        motion = None if state is None else state.motion
        with self._changed:
            item = max(self._item, 0)
            within_item = 0.0
            if (
                motion is not None
                and motion.id == self._id
                and motion.item == item
                and not isnan(motion.progress)
            ):
                within_item = motion.progress
            # at the change of motions a state may already report the progress of the next one
            self._furthest = max(self._furthest, (item + within_item) / self._count)
            return self._furthest

    @property
    def item(self) -> int:
        """Index of the running motion, or of the last one that ran; -1 before the first."""
        return self._item

    @property
    def segment(self) -> int:
        """Index of the running segment of a spline; -1: none, or the cabinet does not report it."""
        return self._segment

    @property
    def remaining(self) -> float:
        """Time to the end of the motion and those blended with it [s], at full override; NaN if not reported."""
        state = None if self.done else self._connection.newest()
        motion = None if state is None else state.motion
        return motion.remaining if motion is not None and motion.id == self._id else nan

    @property
    def first_sample(self) -> int:
        """Number of the newest pushed state before it began, or was sent if it has not begun; see `states`."""
        return self._first_sample

    @property
    def last_sample(self) -> int:
        """Number of the newest pushed state when it ended; 0 before."""
        return self._last_sample

    def states(self, *, size: int = STREAM_SIZE) -> States:
        """Iterate over every pushed state from its first to the first one after its end, at the loop's own pace.

        The loop may begin late: states of the last 30 s are kept. The iteration ends with the program, by whatever
        cause; `wait` then returns or raises it. The rate is that of `Arm.subscribe`.

        Args:
            size: states kept for a slow loop; if more wait, the oldest are dropped and `States.lost` counts them.
        """
        return self._connection.stream(
            rate=None, duration=None, size=integer(size, "size", 1, LONGEST_STREAM), until=self
        )

    def events(self, *, timeout: float | None = None) -> Iterator[MotionEvent]:
        """Iterate over its events from the start: motions and segments that begin and end, triggers that fire.

        The iteration ends with the program, by whatever cause; `wait` then returns or raises it.

        Args:
            timeout: longest wait for the next event [s]; None: as long as `wait` does.

        Raises:
            Timeout: no event arrived and the program has not ended; the program goes on.
        """
        limit, seen = self._seconds(timeout), 0
        is_last = False
        while not is_last:
            if not self.done:
                self._connection.check_may_wait("a loop over handle.events()")
            with self._connection.stopping_on_interrupt(), self._changed:
                if not self._changed.wait_for(partial(self._has_event_after, seen), limit):
                    raise Timeout(f"no event of motion {self._id} received within {limit:.1f} s")
                # the last event is stored before the future is set
                is_last, new = self.done, self._events[seen:]
            yield from new
            seen += len(new)

    def _has_event_after(self, seen: int) -> bool:
        return len(self._events) > seen or self.done

    def add_event_callback(self, callback: Callable[[MotionEvent], None]) -> None:
        """Call `callback(event)` for each event, past ones first; from the link's thread, so it must not block."""
        check_callback(callback, "callback")
        with self._changed:
            self._listeners.append(callback)
            for event in self._events:
                _call(callback, event)

    def wait(self, *, timeout: float | None = None) -> Result:
        """Wait until it has ended.

        Args:
            timeout: longest wait [s]; None: three times the longest plausible duration of the program plus 15 s.

        Returns:
            How it ended. Cancelling, a break condition and replacement are results as well.

        Raises:
            MotionAborted: it was ended early; carries cause, state and history.
            ArrivalError: in position control it ended short of its target; carries the same.
            CommandRejected: the cabinet found while planning that it is not possible (mostly a LimitError).
            ConnectionLost: the connection was lost; the end of the motion is unknown, the cabinet stops it.
            Timeout: it has not ended; it goes on.
            LimitError: a timeout that is negative or not a number.
            LocalProtocolError: called from a callback before it has ended.
        """
        limit = self._seconds(timeout)
        if not self.done:
            self._connection.check_may_wait("waiting for a motion")
        try:
            with self._connection.stopping_on_interrupt():
                return self._future.result(limit)
        except FutureTimeout:
            if self._future.done():  # just now, or with an error that is a TimeoutError
                return self._future.result()
            raise Timeout(
                f"motion {self._id} has not ended within {limit:.1f} s",
                hint="give a longer timeout, or check in arm.state whether the arm may move",
            ) from None

    def _seconds(self, timeout: float | None) -> float:
        """The longest wait [s]; None: the default."""
        return min(self._limit, MAX_TIMEOUT) if timeout is None else check_timeout(timeout)

    def wait_started(self, timeout: float) -> bool:
        """Wait until the first motion has begun or the program has ended; False if neither happened in time [s]."""
        return self._begun.wait(check_timeout(timeout))

    def cancel(self) -> None:
        """End it: a running motion brakes on its path, a waiting one is dropped. Calling it again has no effect."""
        self._connection.cancel(self)

    def add_done_callback(self, callback: Callable[[MotionHandle], None]) -> None:
        """Call `callback(handle)` when it has ended; from the link's thread, so it must not block.

        The handle has either a `result` or an `error`.
        """
        check_callback(callback, "callback")
        self._future.add_done_callback(lambda _: callback(self))

    def __await__(self) -> Generator[Any, None, Result]:
        """Wait in asyncio, as `wait` does without a timeout.

        If the wait is cancelled or times out, the arm brakes on its path and waiting motions are dropped, as with
        Ctrl-C; the wait then lasts until the motion has ended. `asyncio.shield(handle)` lets the motion go on.
        """
        future = asyncio.wrap_future(self._future)
        # nobody else looks at its error when the wait was cancelled
        future.add_done_callback(lambda ended: ended.cancelled() or ended.exception())
        try:
            return (yield from asyncio.shield(future).__await__())
        except (asyncio.CancelledError, GeneratorExit) as error:
            if not self.done:
                # in a thread: the event loop must not wait for the cabinet
                threading.Thread(target=self._brake, name="heptarm-brake", daemon=True).start()
                if isinstance(error, asyncio.CancelledError):
                    yield from asyncio.wait((future,), timeout=_BRAKING).__await__()
            raise

    def _brake(self) -> None:
        if not self.done:
            self._connection.brake("a cancelled await")

    # ---------------------------------------------------------------------------- from the link

    def on_accepted(self, number: int) -> None:
        """Take the number under which the cabinet accepted it."""
        self._id = number

    def on_event(self, message: Message) -> None:
        """Take an event of this program."""
        if isinstance(message, MotionStarted):
            if not self.started:
                self._first_sample = max(self._first_sample, self._connection.feed.count - _OVERTAKING)
            self._note(MotionEvent("begun", message.item), item=message.item, segment=-1)
            self._begun.set()
        elif isinstance(message, SegmentReached):
            self._note(MotionEvent("segment", message.item, message.segment), segment=message.segment)
        elif isinstance(message, ItemReached):
            self._note(MotionEvent("ended", message.item), item=max(self._item, message.item))
        elif isinstance(message, TriggerFired):
            self._note(self._trigger_event(message))
        elif isinstance(message, ConditionFired):
            self._fired_at = message
        elif isinstance(message, MotionFinished):
            if self.started:
                self._note(MotionEvent("ended", message.item))
            self._finish(message)

    def on_lost(self, error: HeptarmError) -> None:
        """End with the error of a lost connection."""
        self._last_sample = self._connection.feed.count
        lost = ConnectionLost(
            f"motion {self._id} was interrupted: {error.text}",
            code=error.code,
            hint="arm.reconnect(), then check where the arm is",
        )
        self._set_error(lost.with_black_box(error))

    def on_fork(self, error: HeptarmError) -> None:
        """End the copy in a fork of the process; what waits in the original process is not touched."""
        self._changed, self._begun, self._future = threading.Condition(), threading.Event(), Future()
        self._listeners = []
        self._set_error(ConnectionLost(error.text, hint=error.hint))

    def _trigger_event(self, message: TriggerFired) -> MotionEvent:
        triggers = self._triggers[message.item] if message.item < len(self._triggers) else ()
        return MotionEvent(
            "trigger",
            message.item,
            trigger=triggers[message.trigger] if message.trigger < len(triggers) else None,
            time=message.time,
            state=self._connection.state_of(message),
            code=message.code,
            text=message.text,
        )

    def _note(self, event: MotionEvent, *, item: int | None = None, segment: int | None = None) -> None:
        with self._changed:
            self._item = self._item if item is None else item
            self._segment = self._segment if segment is None else segment
            self._events.append(event)
            for listener in self._listeners:
                _call(listener, event)
            self._changed.notify_all()

    def _finish(self, message: MotionFinished) -> None:
        self._last_sample = self._connection.feed.count
        result = self._connection.result_of(message)
        if 0 <= message.fired < len(self._until):
            fired = None if self._fired_at is None else self._connection.state_of(self._fired_at)
            result = replace(result, stopped_by=self._until[message.fired], fired_at=fired)
        error = (
            self._break_error(result)
            or self._arrival_error(message.id, result)
            or self._abort_error(message, result)
        )
        if error is None:
            self._set_result(result)
        else:
            if isinstance(error, (MotionError, StreamError, ConnectionLost)):
                error.with_black_box(self._connection.capture(f"motion {message.id} {result.cause.value}"))
            self._set_error(error)

    def _break_error(self, result: Result) -> HeptarmError | None:
        """The error of the break rule that ended the motion; None: there is none."""
        for rule in self._breaks:
            if rule.error is not None and result.stopped_by is not None and rule.ended(result):
                try:
                    return rule.error(result)
                except Exception as failure:  # the link thread has to go on
                    _log.exception("the error of a break condition could not be made")
                    return MotionAborted(
                        f"a break condition ended the motion; making its error failed: {failure!r}",
                        result=result,
                    )
        return None

    def _arrival_error(self, number: int, result: Result) -> ArrivalError | None:
        """The error of a motion that ended short of its target in position control."""
        if (
            not self._is_stiff
            or result.cause is not Cause.FINISHED
            or not result.residual > ARRIVAL_TOLERANCE
        ):
            return None
        return ArrivalError(
            f"motion {number} ended {np.degrees(result.residual):.1f} deg short of its target; "
            f"allowed are {np.degrees(ARRIVAL_TOLERANCE):.1f} deg",
            result=result,
            history=self._connection.history(),
            value=result.residual,
            allowed=f"[0, {ARRIVAL_TOLERANCE}] rad",
            hint="check whether something blocks the arm, and whether the load data are right",
        )

    def _abort_error(self, message: MotionFinished, result: Result) -> HeptarmError | None:
        """The error of a motion that was ended early; None if it ended well."""
        if result.cause in _GOOD:
            return None
        meaning = MEANINGS.get(message.code)
        what = without_java(message.text) or ("" if meaning is None else meaning.title)
        author = what.removeprefix("stopped ") if result.cause is Cause.STOPPED else what
        joint = ": " if author == what else " "  # "was stopped by panel at 10.0.0.5"
        text = f"motion {message.id} {_ABORTED[result.cause]}{joint + author if what else ''}"
        hint = "" if meaning is None else meaning.advice
        if result.cause is Cause.LOST:
            return ConnectionLost(text, code=message.code, hint=hint)
        if result.cause is Cause.STARVED:
            return Starved(text, code=message.code, hint=hint)
        kind = MotionAborted if meaning is None else getattr(errors, meaning.error)
        if result.cause is Cause.FAILED and issubclass(kind, CommandRejected | NotReady) and not self.started:
            return error_of(message.code, text)  # found while planning: nothing has moved
        return MotionAborted(
            text, result=result, history=self._connection.history(), code=message.code, hint=hint
        )

    def _set_result(self, result: Result) -> None:
        if not self._future.done():
            self._future.set_result(result)
        self._wake()

    def _set_error(self, error: HeptarmError) -> None:
        with contextlib.suppress(Exception):  # InvalidStateError: it has ended before
            self._future.set_exception(error)
        self._wake()

    def _wake(self) -> None:
        self._begun.set()
        with self._changed:
            self._changed.notify_all()


def _call(listener: Callable[[MotionEvent], None], event: MotionEvent) -> None:
    try:
        listener(event)
    except Exception:  # the link thread has to go on
        _log.exception("an event callback raised an error")


def _ends_stiff(item: wire.Item) -> bool:
    """Whether an item ends in position control, so that the arm has to be at its target."""
    is_position = item.mode is None or isinstance(item.mode, wire.PositionMode)
    return is_position and not isinstance(item.motion, wire.HandGuide)
