"""When the points of a stream were sent, by the receiver's clock.

Networks, busy machines and queues deliver points late, in bursts or not at all. Their sender makes one in each period,
and its messages are counted: ROS 1 numbers those of a publisher, ROS 2 numbers or stamps them. So the place of a point
in the stream is known, and only the time of the whole stream is estimated: by those arrivals that were delayed least.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from heptarm.values.checks import Array

#: How long arrivals count [s]: for the period of the stream, and for its time.
_HISTORY, _MEMORY = 1.0, 0.5
#: Arrivals from which the period is measured, and the deviation from the declared one that counts, as a fraction.
_ENOUGH, _DEVIATION = 20, 0.01
#: Time constant with which the time of the stream follows the arrivals [s].
_LOCK = 0.4
#: Deviation of an arrival with which the times begin again [s]: the sender has paused, and did not count meanwhile.
_LOST = 0.06


@dataclass(frozen=True, slots=True)
class PublishInfo:
    """When, or as which message of its publisher, a message was published.

    Attributes:
        number: of the message, as its publisher counts; None: unknown.
        time: when it was published, by any clock [s]; None: unknown.
    """

    number: int | None = None
    time: float | None = None


class SendTimes:
    """Estimates when the points of one stream were sent."""

    def __init__(self) -> None:
        self._last: PublishInfo | None = None
        self._count = 0
        self._newest = 0.0  # when the newest point was sent [s]
        self._arrivals: deque[tuple[int, float]] = deque()

    def restart(self) -> None:
        """The next point begins another stream."""
        self._last = None
        self._arrivals.clear()

    def add(self, now: float, period: float, sent: PublishInfo | None) -> tuple[float, float]:
        """Estimate when a point was sent.

        Args:
            now: time of its arrival [s].
            period: of the stream, as the point declares it [s].
            sent: when or as which its message was published; None: unknown.

        Returns:
            The time [s], that of the arrival if the sender does not count; and how much later that is than by the count
            [s], after a pause in which nothing was counted: 0 without one.
        """
        step = None if sent is None else self._step(sent, period)
        self._last = sent
        if step is None:
            return self._begin(now), 0.0
        self._count += step
        self._arrivals.append((self._count, now))
        while now - self._arrivals[0][1] > _HISTORY:
            self._arrivals.popleft()
        counts, times = np.array(self._arrivals).T
        period = _measured(counts, times, period)
        expected = self._newest + step * period
        if abs(now - expected) > _LOST:
            if len(times) < _ENOUGH and now - times[-2] < step * period + _LOST:
                self._newest = now  # no pause: the declared period is wrong, and the true one not known yet
                return now, 0.0
            return self._begin(now), now - expected
        # when the newest point would have arrived had it been delayed as little as another one
        arrivals = (times + (self._count - counts) * period)[times > now - _MEMORY]
        fraction = max(step * period / _LOCK, 1.0 / len(times))
        self._newest = expected + min(1.0, fraction) * (float(arrivals.min()) - expected)
        return self._newest, 0.0

    def _begin(self, now: float) -> float:
        self._arrivals.clear()
        self._arrivals.append((self._count, now))
        self._newest = now
        return now

    def _step(self, sent: PublishInfo, period: float) -> int | None:
        """Periods from the last point to this one; None: it is the first of a stream."""
        last = self._last
        if last is None:
            return None
        if sent.number is not None and last.number is not None:
            step = sent.number - last.number
        elif sent.time is not None and last.time is not None:
            step = max(1, round((sent.time - last.time) / period)) if sent.time > last.time else 0
        else:
            return None
        return step if 0 < step * period <= _HISTORY else None


def _measured(counts: Array, times: Array, period: float) -> float:
    """Period of a stream by its arrivals [s]; the declared one if that is nearly true, or they are few."""
    if len(counts) < _ENOUGH:
        return period
    centred = counts - counts.mean()
    measured = float(centred @ times / (centred @ centred))
    return measured if abs(measured / period - 1.0) > _DEVIATION else period
