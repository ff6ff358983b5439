"""A program under way: wait for it, cancel it, see how far it is."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import replace
from functools import partial
from math import isnan, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from heptarm import errors
from heptarm.arm.refusals import error_of
from heptarm.errors import (
    ArrivalError,
    CollisionDetected,
    CommandRejected,
    ConnectionLost,
    HeptarmError,
    MotionAborted,
    NotReady,
    Starved,
    Timeout,
)
from heptarm.values.collision import Collision, CollisionGuard
from heptarm.values.condition import Condition
from heptarm.values.event import MotionEvent
from heptarm.values.result import Cause, Result
from heptarm.values.state import State
from heptarm.values.trigger import Trigger
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

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

_log = logging.getLogger(__name__)

#: Ends that are results; all others are errors.
_GOOD = (Cause.FINISHED, Cause.CANCELLED, Cause.CONDITION, Cause.REPLACED)
#: A stiff arm that ends farther from its target than this has not arrived [rad].
ARRIVAL = 0.02


class MotionHandle:
    """A program that was sent to the cabinet; made by `Arm.start`.

    It can be awaited in asyncio. Its id is the cabinet's.
    """

    def __init__(
        self,
        connection: Connection,
        count: int,
        limit: float,
        *,
        until: tuple[Condition, ...] = (),
        guard: CollisionGuard | None = None,
        triggers: tuple[tuple[Trigger, ...], ...] = (),
    ) -> None:
        self._connection = connection
        self._count = count
        self._limit = limit
        self._until = until
        self._guard = guard
        self._triggers = triggers
        self._told: list[MotionEvent] = []
        self._listeners: list[Callable[[MotionEvent], None]] = []
        self._news = threading.Condition()
        self._segment = -1
        self._fired: State | None = None
        self._id = 0
        self._furthest = 0.0
        self._item = -1
        self._begun = threading.Event()
        #: Whether it ends in position control, so that it has to end at its target.
        self.is_stiff = False
        self._future: Future[Result] = Future()

    def __repr__(self) -> str:
        """Short form."""
        return (
            f"<MotionHandle {self._id}: {'done' if self.done else 'running' if self.started else 'waiting'}>"
        )

    @property
    def id(self) -> int:
        """The cabinet's number of the program."""
        return self._id

    @property
    def limit(self) -> float:
        """How long `wait` waits unless told otherwise [s]."""
        return self._limit

    @property
    def started(self) -> bool:
        """Whether the first motion has begun."""
        return self._item >= 0

    @property
    def done(self) -> bool:
        """Whether it has ended, in whatever way."""
        return self._future.done()

    @property
    def result(self) -> Result | None:
        """How it ended; None while it has not, or if it ended with an error (`wait` raises it)."""
        if not self._future.done() or self._future.exception() is not None:
            return None
        return self._future.result()

    @property
    def progress(self) -> float:
        """How much of it is done, [0, 1]; each motion counts the same. It never goes back."""
        if self.done and self.result is not None and self.result.cause is Cause.FINISHED:
            return 1.0
        # a state at the change from one motion to the next may already tell the progress of the next
        self._furthest = max(self._furthest, self._share())
        return self._furthest

    def _share(self) -> float:
        item = max(self._item, 0)
        state = None if self.done else self._connection.newest()
        seen = None if state is None else state.motion
        told = seen is not None and seen.id == self._id and seen.item == item and not isnan(seen.progress)
        return (item + (seen.progress if told and seen is not None else 0.0)) / self._count

    @property
    def item(self) -> int:
        """Index of the motion under way, or of the last one that was; -1 before the first."""
        return self._item

    @property
    def segment(self) -> int:
        """Index of the segment of a spline that is under way; -1: none, or the cabinet does not tell."""
        return self._segment

    @property
    def remaining(self) -> float:
        """Time to the end of the motion, or of those blended with it [s], at full override; NaN if it is not told."""
        state = None if self.done else self._connection.newest()
        seen = None if state is None else state.motion
        return seen.remaining if seen is not None and seen.id == self._id else nan

    def events(self, *, timeout: float | None = None) -> Iterator[MotionEvent]:
        """What becomes of it, from its beginning: motions and segments that begin and end, triggers that fire.

        The iteration ends with the program, however that ends; `wait` then says how.

        Args:
            timeout: how long to wait for the next one [s]; None: as long as `wait` does.

        Raises:
            Timeout: nothing came and it has not ended; it goes on.
        """
        limit, seen = self._limit if timeout is None else timeout, 0
        while True:
            with self._connection.stopping_on_interrupt(), self._news:
                if not self._news.wait_for(partial(self._has_news, seen), limit):
                    raise Timeout(f"nothing was told of motion {self._id} within {limit:.1f} s")
                told, ended = self._told[seen:], self.done
            yield from told
            seen += len(told)
            if ended and seen == len(self._told):
                return

    def add_event_callback(self, callback: Callable[[MotionEvent], None]) -> None:
        """Call `callback(event)` for each event, those before as well; from the link's thread, so it must not block."""
        with self._news:
            self._listeners.append(callback)
            for event in self._told:
                self._tell(callback, event)

    def wait(self, *, timeout: float | None = None) -> Result:
        """Wait until it has ended.

        Args:
            timeout: how long [s]; None: three times as long as the program can take at its speed, and more.

        Returns:
            How it ended. Cancelling, a break condition and replacement are results as well.

        Raises:
            MotionAborted: it was ended under way; carries cause, state and history.
            ArrivalError: it ended short of its target in position control; likewise.
            CommandRejected: the cabinet found while planning that it cannot be done (mostly a LimitError).
            ConnectionLost: the cabinet was lost; what became of the motion is unknown here, the cabinet stops it.
            Timeout: it has not ended; it goes on.
        """
        limit = self._limit if timeout is None else timeout
        try:
            with self._connection.stopping_on_interrupt():
                return self._future.result(limit)
        except FutureTimeout:
            if self._future.done():  # just now, or with an error that is a TimeoutError
                return self._future.result()
            raise Timeout(
                f"motion {self._id} has not ended within {limit:.1f} s",
                hint="give a longer timeout, or look at arm.state whether the arm may move",
            ) from None

    def wait_started(self, timeout: float) -> bool:
        """Wait until the first motion has begun or the program has ended; False if neither came in time [s]."""
        return self._begun.wait(timeout)

    def cancel(self) -> None:
        """End it: a running motion brakes on its path, a waiting one is dropped. Cancelling twice is legal."""
        self._connection.cancel(self)

    def add_done_callback(self, callback: Callable[[MotionHandle], None]) -> None:
        """Call `callback(handle)` when it has ended; from the link's thread, so it must not block."""
        self._future.add_done_callback(lambda _: callback(self))

    def __await__(self) -> Generator[Any, None, Result]:
        """Wait in asyncio; giving up waiting does not cancel the motion."""
        return asyncio.shield(asyncio.wrap_future(self._future)).__await__()

    # ---------------------------------------------------------------------------- from the link

    def accepted(self, number: int) -> None:
        """The cabinet has taken it, under that number."""
        self._id = number

    def on_event(self, message: Message) -> None:
        """An event of this program came."""
        if isinstance(message, MotionStarted):
            self._item, self._segment = message.item, -1
            self._begun.set()
            self._note(MotionEvent("begun", message.item))
        elif isinstance(message, SegmentReached):
            self._segment = message.segment
            self._note(MotionEvent("segment", message.item, message.segment))
        elif isinstance(message, ItemReached):
            self._item = max(self._item, message.item)
            self._note(MotionEvent("ended", message.item))
        elif isinstance(message, TriggerFired):
            self._note(self._fire(message))
        elif isinstance(message, ConditionFired):
            self._fired = self._connection.state_of(message)
        elif isinstance(message, MotionFinished):
            if self.started:
                self._note(MotionEvent("ended", message.item))
            self._finish(message)
            self._wake()

    def lose(self, error: HeptarmError) -> None:
        """The link was lost."""
        self._end(
            ConnectionLost(
                f"motion {self._id} was under way when the connection was lost: {error.text}",
                code=error.code,
                hint="arm.reconnect(), then look where the arm is",
            )
        )

        self._wake()

    def _fire(self, message: TriggerFired) -> MotionEvent:
        state = self._connection.state_of(message)
        mine = self._triggers[message.item] if message.item < len(self._triggers) else ()
        trigger = mine[message.trigger] if message.trigger < len(mine) else None
        return MotionEvent(
            "trigger",
            message.item,
            trigger=trigger,
            time=message.time,
            state=state,
            code=message.code,
            text=message.text,
        )

    def _has_news(self, seen: int) -> bool:
        return len(self._told) > seen or self.done

    def _note(self, event: MotionEvent) -> None:
        with self._news:
            self._told.append(event)
            for listener in self._listeners:
                self._tell(listener, event)
            self._news.notify_all()

    @staticmethod
    def _tell(listener: Callable[[MotionEvent], None], event: MotionEvent) -> None:
        try:
            listener(event)
        except Exception:  # the link's thread has others to serve
            _log.exception("a callback for events ended with an error")

    def _wake(self) -> None:
        with self._news:
            self._news.notify_all()

    def _finish(self, message: MotionFinished) -> None:
        result = self._connection.result_of(message)
        if 0 <= message.fired < len(self._until):
            result = replace(result, stopped_by=self._until[message.fired], fired_at=self._fired)
            if self._guard is not None and result.stopped_by in self._guard.parts:
                found = self._guard.named(result.stopped_by, result.fired_at or result.state)
                told = self._connection.on_collision
                if told is not None:
                    told(found)
                self._end(collided(found, result, self._connection.history()))
                return
        if result.cause is Cause.FINISHED and self.is_stiff and result.residual > ARRIVAL:
            self._end(
                ArrivalError(
                    f"motion {message.id} ended {np.degrees(result.residual):.1f} deg short of its target",
                    result=result,
                    history=self._connection.history(),
                    value=result.residual,
                    allowed=f"[0, {ARRIVAL}] rad",
                    hint="something holds the arm, or the load is more than the drives can carry",
                )
            )
            return
        if result.cause in _GOOD:
            if not self._future.done():
                self._future.set_result(result)
            self._begun.set()
            return
        what = message.text or (MEANINGS[message.code].title if message.code in MEANINGS else "")
        text = f"motion {message.id} {_WORDS[result.cause]}{': ' + what if what else ''}"
        meaning = MEANINGS.get(message.code)
        hint = meaning.advice if meaning is not None else ""
        kind = getattr(errors, meaning.error) if meaning is not None else MotionAborted
        if result.cause is Cause.LOST:
            error: HeptarmError = ConnectionLost(text, code=message.code, hint=hint)
        elif result.cause is Cause.STARVED:
            error = Starved(text, code=message.code, hint=hint)
        elif (
            result.cause is Cause.FAILED and issubclass(kind, CommandRejected | NotReady) and not self.started
        ):
            error = error_of(message.code, text)  # found while planning: nothing has moved
        else:
            error = MotionAborted(
                text, result=result, history=self._connection.history(), code=message.code, hint=hint
            )
        self._end(error)

    def _end(self, error: HeptarmError) -> None:
        with contextlib.suppress(Exception):  # InvalidStateError: it has ended before
            self._future.set_exception(error)
        self._begun.set()


def collided(found: Collision, result: Result | None, history: Sequence[State]) -> CollisionDetected:
    """The error of a collision."""
    return CollisionDetected(
        f"collision at {found}",
        collision=found,
        result=result,
        history=history,
        hint="look what the arm has met; arm.collision_guard() takes the baseline anew",
    )


_WORDS = {
    Cause.STOPPED: "was stopped",
    Cause.LOST: "was stopped because its controller was lost",
    Cause.FAILED: "failed",
    Cause.SAFETY: "was ended by a safety function",
    Cause.DROPPED: "was dropped, because one before it failed",
    Cause.STARVED: "was stopped for want of targets",
}
