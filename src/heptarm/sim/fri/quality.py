"""Quality of the connection, from the client's answers.

KUKA names four classes and publishes no thresholds. These rules are heptarm's own:

* The client owes one answer in each receive period (send period times multiplier).
* An answer within one receive period of its message is on time and earns 4 points; a later one earns 3; one that is
  missing after `LOST_PERIODS` receive periods, at least `LOST_TIME`, is lost and earns none.
* The window is the last 100 receive periods; where they would take longer than a second, those of the last second, at
  least 20. When the session opens, the window counts as lost, so that the quality has to be earned.
* EXCELLENT from 99 % of the window's points, GOOD from 95 %, FAIR from 75 %, POOR below.

With 1 lost or 4 late answers in a hundred it stays EXCELLENT, with 5 lost or 20 late ones GOOD. Commanding needs GOOD;
a client that is always late never reaches it. At 1 kHz a silent client is detected after 26 ms.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from heptarm.fri.protocol.messages import Quality

#: Points of an answer.
ON_TIME, LATE, LOST = 4, 3, 0
#: Fraction of the window's points from which a class is reached.
THRESHOLDS = ((Quality.EXCELLENT, 0.99), (Quality.GOOD, 0.95), (Quality.FAIR, 0.75))

WINDOW = 100
WINDOW_LEAST = 20
WINDOW_NS = 1_000_000_000

#: An answer is lost after this many receive periods, but not before this time [ns].
LOST_PERIODS = 5
LOST_TIME = 20_000_000

_SMOOTH = 1.0 / 16.0


@dataclass(slots=True)
class AnswerCounts:
    """Receive periods so far, by outcome."""

    on_time: int = 0
    late: int = 0
    lost: int = 0


class QualityMeter:
    """Rates the answers of one session.

    Args:
        receive_ns: receive period [ns].

    Attributes:
        counts: since the session opened.
        latency_ns: mean time from message to answer, of about the last 16 [ns].
        jitter_ns: mean change of that time from one answer to the next [ns].
    """

    def __init__(self, receive_ns: int) -> None:
        self._receive_ns = receive_ns
        self._lost_ns = max(LOST_PERIODS * receive_ns, LOST_TIME)
        self.window = max(WINDOW_LEAST, min(WINDOW, WINDOW_NS // receive_ns))
        self._marks: deque[int] = deque([LOST] * self.window, maxlen=self.window)
        self._points = 0
        self._open: dict[int, int] = {}  # receive period -> when its answer counts as lost; oldest first
        self.counts = AnswerCounts()
        self.latency_ns = self.jitter_ns = 0.0
        self._before: float | None = None
        self._thresholds = [
            (quality, fraction * ON_TIME * self.window - 1e-9) for quality, fraction in THRESHOLDS
        ]
        self.quality = Quality.POOR

    def asked(self, period: int, now: int) -> None:
        """Count the first message of a receive period, sent at `now` [ns]."""
        self._open[period] = now + self._receive_ns + self._lost_ns

    def answered(self, period: int, latency: int) -> bool:
        """Count an answer `latency` [ns] after its message; False if its period was rated before."""
        if self._open.pop(period, None) is None:
            return False
        if latency <= self._receive_ns:
            self.counts.on_time += 1
            self._mark(ON_TIME)
        else:
            self.counts.late += 1
            self._mark(LATE)
        if self._before is None:
            self.latency_ns = float(latency)
        else:
            self.jitter_ns += (abs(latency - self._before) - self.jitter_ns) * _SMOOTH
            self.latency_ns += (latency - self.latency_ns) * _SMOOTH
        self._before = float(latency)
        return True

    def advance(self, now: int) -> Quality:
        """The quality at `now` [ns]."""
        while self._open:
            period, deadline = next(iter(self._open.items()))
            if now < deadline:
                break
            del self._open[period]
            self.counts.lost += 1
            self._mark(LOST)
        self.quality = next((q for q, least in self._thresholds if self._points >= least), Quality.POOR)
        return self.quality

    @property
    def fraction(self) -> float:
        """Points of the window as a fraction of the maximum, 0 to 1."""
        return self._points / (ON_TIME * self.window)

    def _mark(self, points: int) -> None:
        self._points += points - self._marks[0]
        self._marks.append(points)
