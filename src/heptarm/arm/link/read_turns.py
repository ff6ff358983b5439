"""Which thread reads the socket of a link: a caller, a loop over states, or else the link thread.

An answer should wake one thread, and a state, too: a second wake-up costs 20 to 50 µs, more on a busy
machine. So the thread that waits reads. The link thread has to keep away from the socket meanwhile, also in
the moments between two requests or two states, or it would be woken by what the next caller waits for; it
must be back when nobody reads any more, since pings, events and the end of the connection wait for no caller.
"""

from __future__ import annotations

import enum
import threading
from _thread import get_ident

#: How long a caller waits for the link thread to finish the read that it is in [s].
_TURN = 0.0002
#: For this long after a request the link thread polls instead of waiting for bytes [ns].
_POLLING = 30_000_000
#: From this state rate on the link thread never polls, since states must be taken at once [Hz].
_FAST_STATES = 250.0
#: From this state rate on a loop over states reads the socket itself [Hz].
_LOOPED_STATES = 100.0
#: The link thread leaves the socket to such a loop while it reads and for at least this long after that [ns]. It looks
#: after the loop a quarter of a period after a state: that has been taken then, and the next one is not due.
_LOOPING = 5_000_000


class Turn(enum.Enum):
    """Whose turn it is, seen from the link thread."""

    LOOP = enum.auto()  #: of a loop over states, which reads, or is back within a moment
    CALLER = (
        enum.auto()
    )  #: of a thread that waits for an answer; most are done within a fraction of a millisecond
    NOBODY = enum.auto()  #: more requests may follow: an answer should wake only its caller
    LINK = enum.auto()  #: of the link thread


class ReadTurns:
    """Turns at the socket of a link.

    A thread may read while it holds `lock`: callers between `take` and `end`, the link thread between `take_now` and
    `leave`.

    Args:
        now: our clock [ns].

    Attributes:
        lock: held by the one thread that reads.
        requested: our clock when a request was last sent or answered [ns].
        serves_loops: whether states come fast enough for a loop over them to read the socket.
    """

    __slots__ = (
        "_caller_reads",
        "_looped",
        "_looping",
        "_loops",
        "_polling",
        "_reader",
        "lock",
        "requested",
        "serves_loops",
    )

    def __init__(self, now: int) -> None:
        self.lock = threading.Lock()
        self.requested = now
        self.serves_loops = False
        self._reader = 0  # identifier of the thread that reads
        self._caller_reads = self._loops = False
        self._polling, self._looping = _POLLING, _LOOPING
        self._looped = now - _LOOPING  # when a loop last read

    def expect_states(self, rate: float) -> None:
        """Prepare for this many states per second of our clock [Hz]."""
        self._polling = _POLLING if rate <= _FAST_STATES else 0
        self.serves_loops = rate >= _LOOPED_STATES
        if self.serves_loops:
            period = max(1, round(1e9 / rate))
            self._looping = (_LOOPING + period - 1) // period * period + period // 4

    # ------------------------------------------------------------------------------- by any thread

    @property
    def is_here(self) -> bool:
        """Whether the calling thread is the one that reads."""
        return self._reader == get_ident()

    def take(self) -> bool:
        """Take the lock, unless another thread reads on; the link thread may have to finish the read that it is in."""
        return self.lock.acquire(blocking=False) or self.lock.acquire(timeout=_TURN)

    def begin(self, *, is_loop: bool = False) -> None:
        """Begin to read; after `take`, where a signal cannot come in between and leave it locked."""
        self._caller_reads, self._loops, self._reader = True, is_loop, get_ident()

    def end(self, now: int) -> None:
        """Let others read."""
        if self._loops:
            self._looped = now
        else:
            self.requested = now
        self._caller_reads, self._loops, self._reader = False, False, 0
        self.lock.release()

    # -------------------------------------------------------------------------- by the link thread

    def of(self, now: int) -> Turn:
        """Whose turn it is."""
        if self.is_looped(now):
            return Turn.LOOP
        if self._caller_reads:
            return Turn.CALLER
        return Turn.NOBODY if now - self.requested < self._polling else Turn.LINK

    def is_looped(self, now: int) -> bool:
        """Whether a loop over states reads, or is back within a moment."""
        return self._loops or now - self._looped < self._looping

    @property
    def patience(self) -> int:
        """For how long the link thread leaves socket and pings to a loop [ns]."""
        return self._looping

    def until_look(self, now: int) -> float:
        """When the link thread looks after a loop [s]."""
        left = self._looped + self._looping - now
        return (left if left > 0 else self._looping) * 1e-9

    def wait(self, seconds: float) -> None:
        """Wait until the caller that reads is done, for so long at most [s]."""
        if self._caller_reads and self.lock.acquire(timeout=seconds):
            self.lock.release()

    def take_now(self) -> bool:
        """Begin to read, unless a caller does; `leave` ends it."""
        if self._caller_reads or not self.lock.acquire(blocking=False):
            return False
        self._reader = get_ident()
        return True

    def leave(self) -> None:
        """End what `take_now` began."""
        self._reader = 0
        self.lock.release()

    def abandon(self) -> None:
        """Begin again in the copy that a fork of the process has: the thread that reads exists in the original only."""
        self.lock = threading.Lock()
        self._caller_reads, self._loops, self._reader = False, False, 0
