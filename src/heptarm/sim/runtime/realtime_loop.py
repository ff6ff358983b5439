"""The realtime loop: ticks in real time, or N times faster, and measures its own lateness.

The loop sleeps until a tick is due. After a late wake-up it catches up, since a tick costs a tenth of a millisecond;
after more than 20 missed ticks it re-bases its schedule and counts that. Faster than real time it sleeps until all
ticks of a millisecond are due, unless somebody waits for one before: to wake up costs as much as a tick. With an FRI
session open it leaves `answer_gap` between two ticks, however late they are, and re-bases after one missed tick: no
client could answer ticks that follow each other without a pause, and a machine that was suspended kept its client
from answering as well.
A sensor's reading is there at once, a simulated one has to be computed: so a tick whose state somebody waits for begins
early, by about as long as it takes and as its readers take to wake; they see its state when it is due. With an FRI
session open it begins when it is due, since the answer to the state before is one of its inputs.
While the robot rests, nothing is simulated and the loop wakes only for readers of the state: see `Rest`.
Python's garbage collector does not run by itself: what exists at the start is frozen, and the loop collects what is new
every few seconds, in the pause between two ticks. To look through all that the waiting motions consist of takes
milliseconds: that is done while the robot rests, or once a minute.
Real-time priority is requested while an FRI client has to answer each tick, or always, by the option; a refusal is
named in the statistics. Only then the loop wakes shortly before a tick and spins for the rest: several cabinets that
do so starve a machine. Memory is not locked: that would commit all the memory that the JVM has only reserved.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import sys
import time
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from heptarm.planning.seam import TICK_NS, HeaderWords
from heptarm.sim.plant.shared_state import SharedState
from heptarm.values.simulator_options import RealTime

if TYPE_CHECKING:
    from heptarm.sim.runtime.rest import Rest

#: A parameter of glibc's mallopt(3).
_M_ARENA_MAX = -8
#: Missed ticks that are caught up at once; after more the schedule is re-based.
CATCH_UP = 20
#: The same while an FRI client has to answer each tick.
CATCH_UP_ANSWERED = 1
#: Time between two ticks for the answer, as a fraction of a period.
ANSWER_GAP = 0.4
#: Wake this long before a tick is due and spin [ns]; small, since a spinning real-time thread starves the machine.
SPIN_NS = 60_000
#: At most this fraction of a period is spun.
SPIN_FRACTION = 0.1
#: A tick begins at most this long before it is due, as a fraction of a period.
EARLIEST = 0.35
#: A tick ends in time if its readers have so long to wake until it is due [ns].
WAKING_NS = 80_000
#: After a tick that is late the next one begins so much earlier [ns]; after one in time, by this fraction of what was
#: left later.
EARLIER_NS, LATER = 20_000, 1 / 1024
#: No real-time priority above this speed: Linux throttles a loop that never sleeps for 50 ms in each second.
REAL_TIME_SPEED = 5.0
#: A loop that cannot keep up sleeps this long whenever it re-bases [s], so that other threads run.
YIELD_TIME = 2e-4
PRIORITY = 50
#: Ticks of a motion that are computed at once without pacing; other threads of Python wait meanwhile.
AT_ONCE = 16
#: Time between two collections of reference cycles among new objects [ns], and at the latest [ns]. One takes 0.2 ms.
COLLECT_EVERY = 5_000_000_000
COLLECT_LATEST = 20_000_000_000
#: Time between two collections among all objects [ns]. With 240 waiting motions one takes 3 ms.
COLLECT_ALL_EVERY = 60_000_000_000
#: The oldest generation of Python's garbage collector that is new.
_NEW = 1
#: A collection needs this pause before the next tick, as a fraction of a period, unless it is overdue.
COLLECT_PAUSE = 0.5

_PR_SET_TIMERSLACK = 29
_HISTORY = 1 << 17


@dataclass(slots=True)
class LoopStatistics:
    """Counts and percentiles of the loop, and what the operating system refused.

    Attributes:
        ticks: simulated ticks.
        rested: ticks that have passed at rest, without simulation.
        rebased: how often missed ticks were given up.
        refused: what the operating system refused.
        lateness_us: of simulated ticks [us].
        tick_us: their durations [us].
    """

    ticks: int = 0
    rested: int = 0
    rebased: int = 0
    refused: list[str] = field(default_factory=list)
    lateness_us: dict[str, float] = field(default_factory=dict)
    tick_us: dict[str, float] = field(default_factory=dict)


def request_real_time() -> str:
    """Request SCHED_FIFO for the calling thread; returns the text of a refusal, or ""."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except (OSError, AttributeError) as error:
        return f"real-time priority refused ({error}); the loop may be late under load"
    return ""


def give_up_real_time() -> None:
    """Return the calling thread to the ordinary scheduler."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def shorten_timer_slack() -> str:
    """Request a timer slack of 1 ns for the calling thread; returns the text of a refusal, or ""."""
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    except (OSError, AttributeError) as error:
        return f"timer slack not set ({error})"
    return ""


def share_memory_pools() -> None:
    """Let the threads of this process use two common pools of memory, where its C library is glibc.

    It would give each new thread one of up to eight pools a processor, and every pool keeps what it once grew to: with
    clients that come and go, the process would grow for an hour.
    """
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, 2)


@contextlib.contextmanager
def batch_scheduled() -> Iterator[None]:
    """Threads started inside do not preempt the thread that wakes them: a real cabinet is another machine."""
    batch, other = (getattr(os, name, None) for name in ("SCHED_BATCH", "SCHED_OTHER"))
    if batch is None or other is None:  # this system has no batch scheduling
        yield
        return
    os.sched_setscheduler(0, batch, os.sched_param(0))
    try:
        yield
    finally:
        os.sched_setscheduler(0, other, os.sched_param(0))


class RealtimeLoop:
    """Call `tick` once per millisecond of plant time.

    Args:
        shared: shared state; its anchor word is the wall time of plant time zero, for Java.
        tick: one tick; without pacing it may be several.
        speed: plant seconds per second; 0: as fast as possible.
        real_time: when to have real-time priority.
        rest: the plant while it rests; None: each tick is simulated.
        at_once: most ticks that a call of `tick` may be; above real time no more than are due each millisecond.

    Attributes:
        allowed: how many ticks the running call of `tick` may be.
        answer_gap: least time between two ticks, as a fraction of a period: `ANSWER_GAP` while an FRI client has to
            answer each of them, else 0; may be set at any time.
        is_real_time: whether real-time priority is wanted now.
    """

    def __init__(
        self,
        shared: SharedState,
        tick: Callable[[], None],
        *,
        speed: float = 1.0,
        real_time: RealTime = "fri",
        rest: Rest | None = None,
        at_once: int = 1,
    ) -> None:
        self.allowed = self._at_once = min(at_once, max(1, int(speed))) if speed > 0 else at_once
        self._shared, self._rest, self._real_time = shared, rest, real_time
        self.is_real_time = False
        self._rested = 0
        self._tick = tick
        self._period = int(TICK_NS / speed) if speed > 0 else 0
        self._early, self._earliest = 0.0, EARLIEST * self._period
        self._speed = speed
        self.answer_gap = 0.0
        self._stop = False
        # no arrays of numpy: between two ticks the caches get cold, and writing into these needs less code
        self._cost = array("q", bytes(8 * _HISTORY))
        self._late = array("q", bytes(8 * _HISTORY))
        self._count = self._ticks = 0  # recorded calls of `tick`, and ticks that they were
        self._collected = self._all_collected = 0  # new objects, and all, when [ns]
        self._rebased = 0
        self._refused: list[str] = []

    def stop(self) -> None:
        """End the loop; may be called from a signal handler or another thread."""
        self._stop = True

    def reset(self) -> None:
        """Reset the statistics."""
        self._count = self._ticks = self._rebased = self._rested = 0

    def run(self) -> None:
        """Tick until stopped."""
        sys.setswitchinterval(2e-4)
        self._refuse(shorten_timer_slack())
        gc.collect()
        gc.freeze()
        gc.disable()
        try:
            self._shared.reals[HeaderWords.RATE] = self._speed
            self._collected = self._all_collected = time.monotonic_ns()
            if self._period:
                self._run_paced()
            else:
                self._run_free()
        finally:
            # otherwise the plant outlives its modules, and the bindings of its libraries report leaks
            gc.enable()
            gc.unfreeze()

    def _refuse(self, text: str) -> None:
        if text and text not in self._refused:
            self._refused.append(text)

    def _prioritise(self) -> None:
        """Request real-time priority, or give it up."""
        self.is_real_time = not self.is_real_time
        if not self.is_real_time:
            give_up_real_time()
        elif 0.0 < self._speed <= REAL_TIME_SPEED:
            self._refuse(request_real_time())
        else:
            self._refuse(
                f"real-time priority not requested: speed must be in (0, {REAL_TIME_SPEED:g}], got {self._speed:g}"
            )

    def _collect(self, now: int, pause: int) -> None:
        """Collect what is new, or all objects, if that is due and the next tick is far enough [ns]."""
        waited = now - self._collected
        if waited <= COLLECT_EVERY or (pause < COLLECT_PAUSE * self._period and waited <= COLLECT_LATEST):
            return
        if now - self._all_collected > COLLECT_ALL_EVERY:
            gc.collect()
            self._all_collected = now
        else:
            gc.collect(_NEW)
        self._collected = now

    def _pass_rest(self, rest: Rest) -> None:
        """Let the time pass while the plant rests."""
        header, over = self._shared.header, False
        while not (over or self._stop):
            newest, anchor = int(header[HeaderWords.NEWEST]), int(header[HeaderWords.ANCHOR])
            over = rest.pass_time()
            self._rested += int(header[HeaderWords.NEWEST]) - newest
            self._rebased += int(header[HeaderWords.ANCHOR]) != anchor
            now = time.monotonic_ns()
            if now - self._all_collected > COLLECT_EVERY:
                gc.collect()
                self._collected = self._all_collected = now

    def _record(self, late: int, cost: int, ticks: int) -> None:
        """Record by how much a call of `tick` was late, how long it took [ns], and how many ticks it was."""
        at = self._count % _HISTORY
        self._late[at], self._cost[at] = late, cost // ticks
        self._count += 1
        self._ticks += ticks

    def _run_free(self) -> None:
        """Tick as fast as possible: no tick is ever due."""
        now_ns, header = time.monotonic_ns, self._shared.header
        end = header[HeaderWords.ANCHOR] = now_ns()
        if self._real_time == "on":
            self._prioritise()
        while not self._stop:
            begin, before = now_ns(), int(header[HeaderWords.NEWEST])
            self._tick()
            late, end = begin - end, now_ns()
            self._record(late, end - begin, max(1, int(header[HeaderWords.NEWEST]) - before))
            self._collect(end, 0)

    def _run_paced(self) -> None:
        """Tick when ticks are due."""
        now_ns, period, header = time.monotonic_ns, self._period, self._shared.header
        spun, spin = min(SPIN_NS, int(SPIN_FRACTION * period)), 0
        always, never = self._real_time == "on", self._real_time == "off"
        rest = self._rest
        done = int(header[HeaderWords.NEWEST])  # ticks of plant time that have passed before the loop
        due = now_ns() + period
        header[HeaderWords.ANCHOR] = due - (done + 1) * period
        end, is_second = now_ns(), False
        moment, awaited = (done + 1) * TICK_NS, 0  # of the next tick; ticks in a row that somebody waited for
        more = self._at_once - 1
        while not self._stop:
            now, gap = now_ns(), int(self.answer_gap * period)
            if self.is_real_time is not (always or (gap > 0 and not never)):
                self._prioritise()
                spin = spun if self.is_real_time else 0
            if now - due > (CATCH_UP_ANSWERED if gap else CATCH_UP + more) * period:
                self._rebased += 1
                time.sleep(YIELD_TIME)
                due = now = now_ns()
                header[HeaderWords.ANCHOR] = due - (int(header[HeaderWords.NEWEST]) + 1) * period
            # who waits for every tick does so only after the last one's state
            is_early = gap == 0 and (awaited > 1 or bool(header[HeaderWords.WAKE] <= moment))
            early = int(self._early) if is_early else 0
            planned = due - early
            if more and not (gap or is_early) and now < due:
                planned += min(more, (int(header[HeaderWords.WAKE]) - moment) // TICK_NS) * period
            start = max(planned, end + gap)
            if now < start:
                exact = 0 if is_early else spin
                if start - now > exact:
                    time.sleep((start - now - exact) * 1e-9)
                while (now := now_ns()) < start:
                    pass
                if (
                    now - start > gap > 0 and not is_second
                ):  # the machine was suspended: leave the gap once more
                    end, is_second = now, True
                    continue
            begin, is_second = now_ns(), False
            awaited = awaited + 1 if header[HeaderWords.WAKE] <= moment else 0
            ticks = 1
            if more:
                self.allowed = 1 if gap else 1 + min(more, max(0, begin - due) // period)
            self._tick()
            end = now_ns()
            if more:
                ticks = max(1, int(header[HeaderWords.NEWEST]) - moment // TICK_NS + 1)
            if is_early:
                spare = due - WAKING_NS - end
                self._early = min(self._earliest, self._early + (EARLIER_NS if spare < 0 else -LATER * spare))
            moment += ticks * TICK_NS
            self._record(begin - planned, end - begin, ticks)
            due += ticks * period
            if rest is not None and rest.begins():
                self._pass_rest(rest)
                end, done = now_ns(), int(header[HeaderWords.NEWEST])
                due = int(header[HeaderWords.ANCHOR]) + (done + 1) * period
                moment = (done + 1) * TICK_NS
            self._collect(end, due - end)

    @property
    def statistics(self) -> LoopStatistics:
        """Percentiles of the last 131,072 ticks, in microseconds."""
        size = min(self._count, _HISTORY)
        return LoopStatistics(
            self._ticks,
            self._rested,
            self._rebased,
            list(self._refused),
            _percentiles(np.array(self._late[:size])),
            _percentiles(np.array(self._cost[:size])),
        )


def _percentiles(values: np.ndarray) -> dict[str, float]:
    if not len(values):
        return {}
    cuts = np.percentile(values, [50, 99, 99.9, 100]) / 1e3
    return {name: round(float(v), 1) for name, v in zip(("p50", "p99", "p99.9", "max"), cuts, strict=True)}
