"""Paces ticks in real time (or N times faster) and counts how well that went.

The loop sleeps to shortly before a tick is due and spins the rest; when it wakes late it catches up, since a
tick costs a tenth of a millisecond; beyond 20 missed ticks it re-bases and counts that. Beside an FRI session it
leaves `room` between two ticks, however late they are, and re-bases after one: no client could answer ticks that
follow each other without a pause, and a machine that stood still kept its client from answering, too.
Real-time priority and a short timer slack are asked for and, where refused, named in the report. Memory is not
locked: that would make all that the JVM has only reserved real.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from heptarm.virtual.ring import ANCHOR, NEWEST, RATE, Ring
from heptarm.virtual.tick import TICK_NS

#: Ticks that are caught up in one go; beyond them time is given up.
CATCH_UP = 20
#: The same while somebody has to answer each tick.
CATCH_UP_ANSWERED = 1
#: What is then left between two ticks for the answer, as a share of a period.
ROOM = 0.4
#: Wake this long before a tick is due and spin [ns]; small, since a spinning real-time thread starves the machine.
SPIN_NS = 60_000
#: At most this share of a period is spun.
SPIN_SHARE = 0.1
#: No real-time priority above this speed: a loop that never sleeps is thrown off the processor for 50 ms a second.
REAL_TIME_SPEED = 5.0
#: A loop that cannot keep up sleeps this long whenever it re-bases [s], so that others run.
BREATH = 2e-4
PRIORITY = 50

_PR_SET_TIMERSLACK = 29
_HISTORY = 1 << 17


@dataclass(slots=True)
class Report:
    """What the pacer saw, and what the system refused it."""

    ticks: int = 0
    rebased: int = 0
    refused: list[str] = field(default_factory=list)
    lateness_us: dict[str, float] = field(default_factory=dict)
    tick_us: dict[str, float] = field(default_factory=dict)


def ask_for_real_time() -> list[str]:
    """Ask for SCHED_FIFO and 1 ns timer slack; returns what was refused, in words."""
    refused = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except (OSError, AttributeError) as error:
        refused.append(f"real-time priority refused ({error}); the loop may be late under load")
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    except (OSError, AttributeError) as error:
        refused.append(f"timer slack not set ({error})")
    return refused


@contextlib.contextmanager
def courteous() -> Iterator[None]:
    """Threads begun within take no processor from whoever wakes them: a real cabinet is another machine."""
    batch, other = (getattr(os, name, None) for name in ("SCHED_BATCH", "SCHED_OTHER"))
    if batch is None or other is None:  # this system knows no such threads
        yield
        return
    os.sched_setscheduler(0, batch, os.sched_param(0))
    try:
        yield
    finally:
        os.sched_setscheduler(0, other, os.sched_param(0))


class Pacer:
    """Calls `tick` once per millisecond of plant time.

    Args:
        ring: whose anchor tells Java the wall time of plant time zero.
        tick: one tick.
        speed: plant seconds per second; 0: as fast as it goes.

    Attributes:
        room: pause between two ticks, as a share of a period: `ROOM` while somebody has to answer each of them, else 0;
            may be set at any time.
    """

    def __init__(self, ring: Ring, tick: Callable[[], None], *, speed: float = 1.0) -> None:
        self._ring = ring
        self._tick = tick
        self._period = int(TICK_NS / speed) if speed > 0 else 0
        self._speed = speed
        self.room = 0.0
        self._stop = False
        self._cost = np.zeros(_HISTORY, dtype=np.int64)
        self._late = np.zeros(_HISTORY, dtype=np.int64)
        self._count = 0
        self._rebased = 0
        self._refused: list[str] = []

    def stop(self) -> None:
        """End the loop; may be called from a signal handler or another thread."""
        self._stop = True

    def reset(self) -> None:
        """Forget the statistics so far."""
        self._count = self._rebased = 0

    def run(self) -> None:
        """Tick until stopped."""
        sys.setswitchinterval(2e-4)
        if 0.0 < self._speed <= REAL_TIME_SPEED:
            self._refused = ask_for_real_time()
        else:
            self._refused = [f"no real-time priority at this speed; it ends at {REAL_TIME_SPEED:g}"]
        gc.collect()
        gc.freeze()
        gc.disable()
        self._ring.reals[RATE] = self._speed
        now_ns, period, header = time.monotonic_ns, self._period, self._ring.header
        spin = min(SPIN_NS, int(SPIN_SHARE * period))
        done = int(header[NEWEST])  # ticks of plant time that have passed before the loop
        due = now_ns() + period
        header[ANCHOR] = due - (done + 1) * period
        end, is_second = now_ns(), False
        while not self._stop:
            now, room = now_ns(), int(self.room * period)
            if period == 0:
                due = now
            elif now - due > (CATCH_UP_ANSWERED if room else CATCH_UP) * period:
                self._rebased += 1
                time.sleep(BREATH)
                due = now = now_ns()
                header[ANCHOR] = due - (int(header[NEWEST]) + 1) * period
            start = max(due, end + room)
            if now < start:
                if start - now > spin:
                    time.sleep((start - now - spin) * 1e-9)
                while (now := now_ns()) < start:
                    pass
                if now - start > room > 0 and not is_second:  # the machine stood still: leave room once more
                    end, is_second = now, True
                    continue
            begin, is_second = now_ns(), False
            self._tick()
            end = now_ns()
            at = self._count % _HISTORY
            self._late[at] = begin - due
            self._cost[at] = end - begin
            self._count += 1
            due += period

    @property
    def report(self) -> Report:
        """Percentiles of the last 131,072 ticks, in microseconds."""
        size = min(self._count, _HISTORY)
        return Report(
            self._count,
            self._rebased,
            list(self._refused),
            _percentiles(self._late[:size]),
            _percentiles(self._cost[:size]),
        )


def _percentiles(values: np.ndarray) -> dict[str, float]:
    if not len(values):
        return {}
    cuts = np.percentile(values, [50, 99, 99.9, 100]) / 1e3
    return {name: round(float(v), 1) for name, v in zip(("p50", "p99", "p99.9", "max"), cuts, strict=True)}
