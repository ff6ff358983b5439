"""How good a connection is, from how the client answers.

KUKA names four classes and publishes no thresholds. The rule here is heptarm's own:

* The client owes one answer in each receive period (send period times multiplier).
* An answer within one receive period of its message is on time and earns 4 points; a later one earns 3; one that is
  not there after `LOST_PERIODS` receive periods, at least `LOST_TIME`, is lost and earns none.
* The window is the last 100 receive periods; where they would last longer than a second, as many as a second holds, at
  least 20. What has not been answered since the session opened counts as lost, so that quality is earned.
* EXCELLENT from 99 % of the window's points on, GOOD from 95 %, FAIR from 75 %, POOR below.

So 1 lost or 4 late answers in a hundred leave it EXCELLENT, 5 lost or 20 late ones GOOD, and GOOD is what commanding
needs; a client that is always late never has it. Silence at 1 kHz is noticed after 26 ms.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from heptarm.fri.messages import Quality

#: Points of an answer.
ON_TIME, LATE, LOST = 4, 3, 0
#: Share of the window's points from which a class is reached.
SHARES = ((Quality.EXCELLENT, 0.99), (Quality.GOOD, 0.95), (Quality.FAIR, 0.75))

WINDOW = 100
WINDOW_LEAST = 20
WINDOW_NS = 1_000_000_000

#: An answer is lost after so many receive periods, but not before so long [ns].
LOST_PERIODS = 5
LOST_TIME = 20_000_000

_SMOOTH = 1.0 / 16.0


@dataclass(slots=True)
class Counts:
    """Receive periods so far, by what became of them."""

    on_time: int = 0
    late: int = 0
    lost: int = 0


class Meter:
    """Judges the answers of one session.

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
        self.counts = Counts()
        self.latency_ns = self.jitter_ns = 0.0
        self._before: float | None = None
        self._thresholds = [(quality, share * ON_TIME * self.window - 1e-9) for quality, share in SHARES]
        self.quality = Quality.POOR

    def asked(self, period: int, now: int) -> None:
        """The first message of a receive period was sent, at `now` [ns]."""
        self._open[period] = now + self._receive_ns + self._lost_ns

    def answered(self, period: int, latency: int) -> bool:
        """An answer came, `latency` [ns] after its message; False if its period was judged before."""
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
    def share(self) -> float:
        """Points of the window, 0 to 1."""
        return self._points / (ON_TIME * self.window)

    def _mark(self, points: int) -> None:
        self._points += points - self._marks[0]
        self._marks.append(points)
