"""Pushed states: the newest one, the last ones, and streams of them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from heptarm.errors import CommandRejected, HeptarmError, ShapeError
from heptarm.io.clock import Clock
from heptarm.values.arrays import shown
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
            known = ", ".join(one.name.lower() for one in wire.Groups if one & offered and one.name)
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
#: Longest wait of a stream between two checks of the link [s].
_CHECK_INTERVAL = 0.2


class StateSample(NamedTuple):
    """A pushed state, still encoded.

    Attributes:
        number: counts the states of the arm from 1.
        body: its bytes.
        received: our clock at its receipt [ns].
    """

    number: int
    body: bytes
    received: int


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
        self._history: deque[StateSample] = deque(maxlen=HISTORY)
        self._changed = threading.Condition()
        self._waiting = 0
        self._queues: tuple[SampleQueue, ...] = ()

    def push(self, body: bytes, received: int) -> None:
        """Take a new state; called by the link."""
        newest = self.newest
        sample = StateSample(1 if newest is None else newest.number + 1, body, received)
        self.newest = sample
        self._history.append(sample)
        for one in self._queues:
            one.put(sample)
        if self._waiting:
            self.wake()

    def wake(self) -> None:
        """Wake all waiting threads."""
        with self._changed:
            self._changed.notify_all()

    def abandon(self) -> None:
        """Drop all states in a fork of the process, and the lock, which another thread may hold."""
        self.newest, self._queues = None, ()
        self._history.clear()
        self._changed, self._waiting = threading.Condition(), 0

    def history(self) -> list[StateSample]:
        """The last samples, oldest first."""
        return list(self._history)

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

    def open(self, size: int) -> SampleQueue:
        """Open a queue that receives every sample from now on."""
        queue = SampleQueue(size)
        with self._changed:
            self._queues = (*self._queues, queue)
        return queue

    def close(self, queue: SampleQueue) -> None:
        """Close a queue."""
        with self._changed:
            self._queues = tuple(one for one in self._queues if one is not queue)


class SampleQueue:
    """A bounded queue of samples; when it is full the oldest are dropped and counted.

    Attributes:
        lost: number of dropped samples.
    """

    __slots__ = ("_available", "_lock", "_samples", "lost")

    def __init__(self, size: int) -> None:
        self._samples: deque[StateSample] = deque(maxlen=size)
        self._available = threading.Semaphore(0)
        self._lock = threading.Lock()
        self.lost = 0

    def put(self, sample: StateSample) -> None:
        """Append a sample."""
        with self._lock:
            is_full = len(self._samples) == self._samples.maxlen
            self._samples.append(sample)
        if is_full:
            self.lost += 1  # the oldest fell out, its permit stays for this one
        else:
            self._available.release()

    def get(self, seconds: float) -> StateSample | None:
        """Take the oldest sample; None if none arrived in time."""
        if not self._available.acquire(timeout=max(seconds, 0.0)):
            return None
        with self._lock:
            return self._samples.popleft()


class States(Iterator[State]):
    """An iterator over pushed states that returns each at most once; made by `Arm.states`."""

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
    ) -> None:
        self._queue: SampleQueue | None = None
        self._feed = feed
        self._clock = clock
        self._build = build
        self._check = check
        self._period = None if rate is None else round(1e9 / rate)
        now = clock.nanos()
        self._end = None if duration is None else now + round(duration * 1e9)
        self._due = now
        self._seen = 0 if feed.newest is None else feed.newest.number - 1
        self._queue = feed.open(size) if rate is None else None

    @property
    def lost(self) -> int:
        """States dropped because the loop was too slow; 0 for a stream with a rate."""
        return 0 if self._queue is None else self._queue.lost

    def __next__(self) -> State:
        """The next state.

        Raises:
            ConnectionLost: the link has ended.
        """
        while self._end is None or self._clock.nanos() < self._end:
            sample = self._next_queued() if self._queue is not None else self._next_paced()
            if sample is not None:
                return self._build(sample)
            error = self._check()
            if error is not None:
                self.close()
                raise error
        self.close()
        raise StopIteration

    def close(self) -> None:
        """Stop receiving states; the end of the iteration does this by itself."""
        if self._queue is not None:
            self._feed.close(self._queue)

    def __del__(self) -> None:
        """Close the queue of a loop that was left early."""
        self.close()

    def _next_queued(self) -> StateSample | None:
        assert self._queue is not None
        return self._queue.get(self._rest())

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
