"""Pushed states: the newest one, the last ones, and streams of them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice
from typing import Any, Protocol

import numpy.typing as npt

from heptarm.errors import CommandRejected, HeptarmError, ShapeError, require
from heptarm.io.clock import Clock
from heptarm.record.samples import SampleQueue, StateSample, states_to_numpy, to_frame
from heptarm.values.checks import shown
from heptarm.values.sealed import Sealed
from heptarm.values.state import GROUP_NAMES, State
from heptarm.wire import messages as wire

#: Groups of the state that are subscribed by default: all but the signals.
GROUPS = tuple(name for name in GROUP_NAMES if name != "io")


def groups_of(names: Sequence[str], offered: wire.Groups) -> wire.Groups:
    """Turn names of groups into the flags of the protocol.

    Raises:
        CommandRejected: the cabinet does not offer one of them; the text lists those that it offers.
    """
    chosen = wire.Groups.NONE
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise ShapeError(
            f"groups must be a list of names, got {shown(names)}",
            parameter="groups",
            value=names,
            hint='for example ("joints", "pose")',
        )
    for name in names:
        group = wire.Groups.__members__.get(str(name).upper(), wire.Groups.NONE)
        if not group & offered:
            known = ", ".join(group.name.lower() for group in wire.Groups if group & offered and group.name)
            raise CommandRejected(
                f"the cabinet offers no state group {shown(name)}",
                parameter="groups",
                value=name,
                allowed=known,
                hint=f"choose from {known}",
            )
        chosen |= group
    return chosen


#: States that are kept, and that an error carries.
HISTORY = 50
#: States that are kept for the black box and for streams of a motion that begin late: their age [ns] and their number.
_KEPT_TIME, _KEPT = 30_000_000_000, 60_000
#: Longest wait of a stream between two checks of the link [s].
_CHECK_INTERVAL = 0.2
#: Longest wait, after the end of a motion, for the state that shows its end [s].
_CLOSING = 1.0


class _KeptStates:
    """The states of the last 30 s, as bytes and integers.

    Python's garbage collector looks at neither, nor do they bring it about. Were each state kept as a tuple, it would
    run once per 700 states, every 70,000 through all objects of the program, which takes 50 ms and more.
    """

    __slots__ = ("_bodies", "_last", "_lock", "_received")

    def __init__(self) -> None:
        self._bodies: deque[bytes] = deque(maxlen=_KEPT)
        self._received: deque[int] = deque(maxlen=_KEPT)
        self._last = 0
        self._lock = threading.Lock()

    def append(self, sample: StateSample) -> None:
        """Keep a sample; its number follows that of the last one."""
        number, body, received = sample
        bodies, times = self._bodies, self._received
        with self._lock:
            self._last = number
            bodies.append(body)
            times.append(received)
            while times[0] < received - _KEPT_TIME:
                bodies.popleft()
                times.popleft()

    def samples(self, *, after: int) -> list[StateSample]:
        """Those with a higher number than `after`, oldest first."""
        with self._lock:
            last, bodies, times = self._last, list(self._bodies), list(self._received)
        before = last - len(bodies)  # number of the newest that is not kept any more
        kept = zip(count(before + 1), bodies, times, strict=False)  # the numbers have no end
        return [StateSample(*entry) for entry in islice(kept, max(0, after - before), None)]


class StateFeed:
    """Distributes states from the link to waiting threads and open streams.

    Args:
        clock: this side's clock.

    Attributes:
        newest: the newest sample; None before the first.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.newest: StateSample | None = None
        self._kept = _KeptStates()
        self._changed = threading.Condition()
        self._waiting = 0
        self._queues: tuple[SampleQueue, ...] = ()

    @property
    def count(self) -> int:
        """Number of the newest sample; 0 before the first."""
        return 0 if self.newest is None else self.newest.number

    def push(self, body: bytes, received: int) -> None:
        """Take a new state; called by the link."""
        newest = self.newest
        sample = StateSample(1 if newest is None else newest.number + 1, body, received)
        self.newest = sample
        self._kept.append(sample)
        for queue in self._queues:
            queue.put(sample)
        if self._waiting:
            self.wake()

    def wake(self) -> None:
        """Wake all waiting threads."""
        with self._changed:
            self._changed.notify_all()

    def abandon(self) -> None:
        """Drop all states in a fork of the process, and the lock, which another thread may hold."""
        self.newest, self._queues, self._kept = None, (), _KeptStates()
        self._changed, self._waiting = threading.Condition(), 0

    def history(self) -> list[StateSample]:
        """The last samples, oldest first."""
        return self._kept.samples(after=self.count - HISTORY)

    def kept(self) -> list[StateSample]:
        """The samples of the last 30 s, oldest first."""
        return self._kept.samples(after=0)

    def note_gap(self, count: int) -> None:
        """Count states that never arrived as lost by all open streams."""
        for queue in self._queues:
            queue.skip(count, after=self.count)

    def after(self, number: int, seconds: float) -> StateSample | None:
        """Wait for a sample newer than `number` and return the newest; None if none arrived in time."""
        deadline = self._clock.nanos() + round(seconds * 1e9)
        with self._changed:
            self._waiting += 1
            try:
                while True:
                    newest = self.newest
                    if newest is not None and newest.number > number:
                        return newest
                    rest = (deadline - self._clock.nanos()) * 1e-9
                    if rest <= 0.0 or not self._changed.wait(rest):
                        return None
            finally:
                self._waiting -= 1

    def open(self, size: int, *, after: int | None = None) -> SampleQueue:
        """Open a queue that receives every sample from now on.

        Args:
            size: samples that it keeps for a slow reader.
            after: number of a sample behind which it begins, as far as samples are kept; None: now.
        """
        queue = SampleQueue(size)
        with self._changed:
            self._queues = (*self._queues, queue)
        if after is not None:
            # after the registration, so that none is missed between
            queue.put_before(self._kept.samples(after=after), after=after)
        return queue

    def close(self, queue: SampleQueue) -> None:
        """Close a queue."""
        with self._changed:
            self._queues = tuple(other for other in self._queues if other is not queue)


class Followed(Protocol):
    """A program whose states a stream returns; `MotionHandle` is one."""

    @property
    def id(self) -> int:
        """The cabinet's number of the program."""
        ...

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        ...

    @property
    def first_sample(self) -> int:
        """Number of the newest sample before it began, or was sent if it has not begun."""
        ...

    @property
    def last_sample(self) -> int:
        """Number of the newest sample at its end."""
        ...


class States(Sealed, Iterator[State]):
    """An iterator over pushed states that returns each at most once; made by `Arm.states` and `MotionHandle.states`.

    Every state that was received before the stream's end is returned, however late the loop takes it, unless more wait
    than the stream keeps: then the oldest are dropped, and `lost` counts them.

    At high rates the thread that waits reads the connection itself, see `Link.read_while`.
    """

    def __init__(
        self,
        feed: StateFeed,
        clock: Clock,
        *,
        build: Callable[[StateSample], State],
        check: Callable[[], HeptarmError | None],
        rate: float | None,
        duration: float | None,
        size: int,
        until: Followed | None = None,
        read: Callable[[Callable[[], bool], float], None] | None = None,
    ) -> None:
        self._queue: SampleQueue | None = None
        self._feed = feed
        self._clock = clock
        self._build = build
        self._check = check
        self._read = read
        self._period = None if rate is None else round(1e9 / rate)
        now = clock.nanos()
        self._end = None if duration is None else now + round(duration * 1e9)
        self._due = now
        self._seen = max(0, feed.count - 1)
        self._until = until
        self._is_inside = False
        self._is_over = False
        self._closing_due: int | None = None
        if rate is None:
            self._queue = feed.open(size, after=None if until is None else until.first_sample)

    @property
    def lost(self) -> int:
        """States that this stream did not return though it should have: the loop was too slow for too long.

        Included are those that the cabinet sampled too late to send, or could not send to a program that reads too
        slowly, and those that were missed while an observer's link was interrupted, by their rate. A stream with a rate
        leaves states out by design and does not count them.
        """
        return 0 if self._queue is None else self._queue.lost

    def __next__(self) -> State:
        """The next state.

        Raises:
            ConnectionLost: the link has ended, unless the stream ends with a motion.
        """
        sample = self._take()
        if sample is None:
            raise StopIteration
        return self._build(sample)

    def _take(self) -> StateSample | None:
        """Wait for the next sample of the stream; None: it has ended. Raises as `__next__` does."""
        while not self._is_over:
            sample = self._received()
            if sample is not None and (
                self._until is None or self._belongs(self._build(sample), sample.number, self._until)
            ):
                return sample
        self.close()
        return None

    def _received(self) -> StateSample | None:
        """The next sample that was received; None: there is none yet, or the stream is over."""
        if self._queue is None and self._end is not None and self._clock.nanos() >= self._end:
            self._is_over = True
            return None
        sample = self._next_paced() if self._queue is None else self._next_queued()
        if sample is not None and (self._end is None or sample.received <= self._end):
            return sample
        now = self._clock.nanos()
        if sample is not None or (self._end is not None and now >= self._end):
            self._is_over = True  # all that were received in time have been returned
            return None
        error = self._check()
        if self._until is None:
            if error is not None:
                self.close()
                raise error
        elif self._until.done:
            self._closing_due = self._closing_due or now + round(_CLOSING * 1e9)
            self._is_over = error is not None or now >= self._closing_due
        return None

    def _belongs(self, state: State, number: int, program: Followed) -> bool:
        """Whether a state is one of a program's: from its first to the first one sampled after its end."""
        motion = state.motion
        is_after = program.done and number > program.last_sample
        if motion is not None and motion.id == program.id:
            self._is_inside = True
            return True
        if motion is None:  # the group is not subscribed
            self._is_over = is_after
            return number > program.first_sample
        self._is_over = self._is_inside or is_after
        return self._is_inside

    def to_numpy(self) -> dict[str, npt.NDArray[Any]]:
        """Take all states to the end of the stream; return arrays by signal name.

        `t` is the cabinet's time since the first state [s], shape (n,); the others are the fields of the groups, such
        as `q` with shape (n, 7) [rad], `pose` (n, 7): x y z [m] and quaternion x y z w, `wrench` (n, 6) [N, Nm]. What
        a group lacks is NaN.

        Raises:
            CommandRejected: the stream has no end.
            ConnectionLost: the link has ended, unless the stream ends with a motion.
        """
        if self._end is None and self._until is None:
            raise CommandRejected(
                "a stream of states without an end never becomes arrays",
                parameter="duration",
                hint="give it an end: arm.states(duration=2.0), handle.states(), or arm.record(...)",
            )
        taken = []
        while (sample := self._take()) is not None:
            taken.append(sample)
        return states_to_numpy(taken)

    def to_pandas(self) -> Any:
        """As `to_numpy`, as a `pandas.DataFrame` with a column per number, such as "q.A1", over `t`.

        Raises:
            MissingExtra: pandas is not installed; others as `to_numpy`.
        """
        return to_frame(self.to_numpy(), require("pandas", extra="record").DataFrame)

    def close(self) -> None:
        """Stop receiving states; the end of the iteration does this by itself."""
        if self._queue is not None:
            self._feed.close(self._queue)

    def __del__(self) -> None:
        """Close the queue of a loop that was left early."""
        self.close()

    def _next_queued(self) -> StateSample | None:
        queue = self._queue
        assert queue is not None
        if self._read is not None and queue.is_empty:
            self._read(lambda: queue.is_empty, self._rest())
        return queue.get(self._rest() if queue.is_empty else 0.0)

    def _next_paced(self) -> StateSample | None:
        assert self._period is not None
        self._clock.sleep(min((self._due - self._clock.nanos()) * 1e-9, self._rest()))
        if self._clock.nanos() < self._due:
            return None
        sample = self._feed.after(self._seen, self._rest())
        if sample is None:
            return None
        self._seen = sample.number
        # a slow loop skips periods instead of catching up with a burst
        self._due = max(self._due + self._period, self._clock.nanos() - self._period)
        return sample

    def _rest(self) -> float:
        """Time to wait before the next check of the link [s]."""
        if self._end is None:
            return _CHECK_INTERVAL
        return min(_CHECK_INTERVAL, (self._end - self._clock.nanos()) * 1e-9)
