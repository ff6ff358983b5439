"""When the points of a stream were sent, by the time at which they arrive.

Networks, busy machines and queues deliver points late, in bursts or not at all. A program sends them at a steady rate,
so their times are those of a clock with the period of the stream, locked to the earliest arrivals: a point may arrive
late, but never before it is sent.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from heptarm.values.arrays import Array

#: How long arrivals count [s]: the earliest of them, by the clock, sets its phase.
_MEMORY = 0.2
#: Time constant with which the clock follows the earliest arrivals [s].
_LOCK = 0.4
#: Deviation at which the clock begins again [s], and gaps between messages from which it takes its period then.
_LOST_LOCK, _GAPS = 0.06, 5
#: Least speed of the stream by which lost points are found [rad/s].
_MOVING = 0.01


class SendTimes:
    """A clock in step with the sender of a stream."""

    def __init__(self) -> None:
        self._period = 0.0
        self._newest: tuple[float, Array] | None = None  # time and place of the newest point
        self._late: deque[tuple[float, float]] = deque()  # arrivals [s], and how late by the clock
        self._arrivals: deque[float] = deque(maxlen=_GAPS + 1)

    def forget(self) -> None:
        """Begin again: the next point belongs to another stream."""
        self._newest = None
        self._late.clear()
        self._arrivals.clear()

    def add(self, now: float, period: float, q: Array, speed: Array) -> float:
        """Estimate when a point was sent.

        Args:
            now: time of its arrival [s].
            period: of the stream, as the point declares it [s].
            q: its positions, shape (7,) [rad].
            speed: velocity of the stream up to now, shape (7,) [rad/s].

        Returns:
            The time [s].
        """
        self._arrivals.append(now)
        if self._newest is None:
            return self._begin(now, period, q)
        time, place = self._newest
        due = time + self._period
        due += self._period * self._lost(now - due, q - place, speed)
        self._late.append((now, now - due))
        while now - self._late[0][0] > _MEMORY:
            self._late.popleft()
        late = min(one for _, one in self._late)
        if abs(late) > max(_LOST_LOCK, 2.0 * self._period):
            return self._begin(now, self._measured(period), q)
        gain = self._period / _LOCK
        shift = gain * late
        self._late = deque((when, one - shift) for when, one in self._late)
        self._period += 0.25 * gain * shift  # damped critically
        self._newest = due + shift, q
        return due + shift

    def _begin(self, now: float, period: float, q: Array) -> float:
        self._late.clear()
        self._late.append((now, 0.0))
        self._period, self._newest = period, (now, q)
        return now

    def _measured(self, period: float) -> float:
        """Period by the arrivals [s]; the declared one while they are few."""
        if len(self._arrivals) <= _GAPS:
            return period
        return max(float(np.median(np.diff(self._arrivals))), 1e-3)

    def _lost(self, late: float, step: Array, speed: Array) -> int:
        """Number of points that were lost before one: its place is as far away as its time is late."""
        most = round(late / self._period)
        if most < 1:
            return 0
        if float(np.abs(speed).max()) < _MOVING:
            return most
        steps = float(step @ speed) / (float(speed @ speed) * self._period)
        return int(np.clip(round(steps) - 1, 0, most))
