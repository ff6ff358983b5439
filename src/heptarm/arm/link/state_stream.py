"""What the cabinet pushes: the newest state, the last ones, and streams of them.

States stay octets until somebody looks at them; a thousand a second cost next to nothing.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock
from heptarm.values.state import State

#: States that an error carries as evidence.
HISTORY = 50
#: Longest a stream waits at once before it looks whether the link still stands [s].
_LOOK = 0.2


class Sample(NamedTuple):
    """A pushed state as it came.

    Attributes:
        number: counts the states of the arm from 1.
        body: its octets.
        received: our clock at its receipt [ns].
    """

    number: int
    body: bytes
    received: int


class Feed:
    """Takes states from the link and hands them to those who want them.

    Args:
        clock: this side's clock.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.newest: Sample | None = None
        self._history: deque[Sample] = deque(maxlen=HISTORY)
        self._changed = threading.Condition()
        self._waiting = 0
        self._queues: tuple[Queue, ...] = ()

    def push(self, body: bytes, received: int) -> None:
        """A state has come; called by the link."""
        newest = self.newest
        sample = Sample(1 if newest is None else newest.number + 1, body, received)
        self.newest = sample
        self._history.append(sample)
        for one in self._queues:
            one.put(sample)
        if self._waiting:
            self.wake()

    def wake(self) -> None:
        """Let those who wait look again."""
        with self._changed:
            self._changed.notify_all()

    def history(self) -> list[Sample]:
        """The last samples, oldest first."""
        return list(self._history)

    def after(self, number: int, seconds: float) -> Sample | None:
        """The newest sample if it is younger than `number`; waits for one, None if none came in time."""
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

    def open(self, size: int) -> Queue:
        """A queue of every sample from now on."""
        queue = Queue(size)
        with self._changed:
            self._queues = (*self._queues, queue)
        return queue

    def shut(self, queue: Queue) -> None:
        """End a queue."""
        with self._changed:
            self._queues = tuple(one for one in self._queues if one is not queue)


class Queue:
    """Every sample, up to a bound; then the oldest are dropped and counted."""

    __slots__ = ("_lock", "_samples", "_there", "lost")

    def __init__(self, size: int) -> None:
        self._samples: deque[Sample] = deque(maxlen=size)
        self._there = threading.Semaphore(0)
        self._lock = threading.Lock()
        self.lost = 0

    def put(self, sample: Sample) -> None:
        """Append one."""
        with self._lock:
            is_full = len(self._samples) == self._samples.maxlen
            self._samples.append(sample)
        if is_full:
            self.lost += 1  # the oldest fell out, its permit stays for this one
        else:
            self._there.release()

    def get(self, seconds: float) -> Sample | None:
        """The oldest one; None if none came in time."""
        if not self._there.acquire(timeout=max(seconds, 0.0)):
            return None
        with self._lock:
            return self._samples.popleft()


class States(Iterator[State]):
    """States one after the other, never one twice; made by `Arm.states`.

    Attributes:
        lost: states that came but could not be kept because the loop was too slow; 0 for a paced stream.
    """

    def __init__(
        self,
        feed: Feed,
        clock: Clock,
        *,
        build: Callable[[Sample], State],
        check: Callable[[], HeptarmError | None],
        rate: float | None,
        duration: float | None,
        size: int,
    ) -> None:
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
        """States that came but could not be kept."""
        return 0 if self._queue is None else self._queue.lost

    def __next__(self) -> State:
        """The next state.

        Raises:
            ConnectionLost: the link has ended.
        """
        while self._end is None or self._clock.nanos() < self._end:
            sample = self._every() if self._queue is not None else self._paced()
            if sample is not None:
                return self._build(sample)
            error = self._check()
            if error is not None:
                self.close()
                raise error
        self.close()
        raise StopIteration

    def close(self) -> None:
        """Take no more; a loop that ends does this itself."""
        if self._queue is not None:
            self._feed.shut(self._queue)

    def __del__(self) -> None:
        """A loop that was left early lets go of its queue."""
        self.close()

    def _every(self) -> Sample | None:
        assert self._queue is not None
        return self._queue.get(self._rest())

    def _paced(self) -> Sample | None:
        assert self._period is not None
        self._clock.sleep(min((self._due - self._clock.nanos()) * 1e-9, self._rest()))
        if self._clock.nanos() < self._due:
            return None
        sample = self._feed.after(self._seen, self._rest())
        if sample is None:
            return None
        self._seen = sample.number
        # a slow loop skips beats instead of catching up with a burst
        self._due = max(self._due + self._period, self._clock.nanos() - self._period)
        return sample

    def _rest(self) -> float:
        if self._end is None:
            return _LOOK
        return min(_LOOK, (self._end - self._clock.nanos()) * 1e-9)
