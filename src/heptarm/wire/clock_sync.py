"""Estimate of the cabinet's clock from pings, fed with triples of time stamps.

A ping is sent at `a` (our clock), received by the cabinet at `m` (its clock) and answered at `b` (our clock): so the
cabinet's clock read `m` at some time in [a, b], estimated as the middle with half the round trip as uncertainty.
Because clocks drift, the uncertainty of a sample grows with its age; the sample with the smallest sum of both counts
(the clock filter of NTP, RFC 5905, in its simplest form). The clock of a virtual cabinet may run faster than ours: its
rate follows from the best older and the best newer sample, unless rate 1 explains both. It may also stall on a busy
machine: a sample that no drift explains resets the estimate.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

#: Largest drift between two clocks of nominally equal rate: 100 ppm, twice that of a poor quartz.
DRIFT = 1e-4
#: Largest deviation from the estimate that does not count as a step [ns].
TOLERANCE = 300_000
#: A clock slower than this rate over a time shorter than this [ns] stands for a moment; that is not its rate.
STALLED, SHORT = 0.05, 500_000_000


class PingDeparture(NamedTuple):
    """The newest ping: its round trip begins when it leaves, after its encoding, which takes 30 us after a pause.

    Attributes:
        stated: the time in it, our clock [ns].
        left: when it left.
    """

    stated: int = 0
    left: int = 0

    def of(self, stated: int) -> int:
        """When the ping left with which an answer came [ns]; `stated`: the time in it."""
        return self.left if stated == self.stated else stated


class _Sample(NamedTuple):
    ours: float  # middle of the round trip, our clock [ns]
    theirs: float  # the cabinet's clock then [ns]
    slack: float  # half the round trip [ns]


class ClockOffset:
    """Cabinet's clock as a function of ours.

    Args:
        window: number of samples kept.
        span: largest age of a sample, our clock [s].
    """

    def __init__(self, *, window: int = 64, span: float = 30.0) -> None:
        self._samples: deque[_Sample] = deque(maxlen=window)
        self._span = span * 1e9
        self._anchor = _Sample(0.0, 0.0, float("inf"))
        self._rate = 1.0
        self._shift = 0
        self._count = 0

    def feed(self, sent: int, received: int, returned: int) -> None:
        """Add the time stamps of one ping.

        Args:
            sent: our clock when the ping was sent [ns].
            received: the cabinet's clock when it arrived [ns].
            returned: our clock when the answer arrived [ns].
        """
        self._count += 1
        if returned < sent:
            return
        sample = _Sample((sent + returned) / 2, received, (returned - sent) / 2)
        samples = self._samples
        if len(samples) > 2 and self._is_step(sample):
            samples.clear()
        samples.append(sample)
        while samples[0].ours < returned - self._span:
            samples.popleft()
        self._rate = self._fit()
        self._anchor = min(samples, key=lambda s: s.slack + DRIFT * (sample.ours - s.ours))
        self._shift = round(self._anchor.theirs - self._anchor.ours)

    def _is_step(self, sample: _Sample) -> bool:
        since = sample.ours - self._anchor.ours
        off = sample.theirs - (self._anchor.theirs + since * self._rate)
        round_trips = (sample.slack + self._anchor.slack) * max(self._rate, 1.0)
        drift = DRIFT if self._rate == 1.0 else 0.01 * self._rate
        return abs(off) > round_trips + drift * since + TOLERANCE

    def _fit(self) -> float:
        """Fit the rate nearest to 1 that the best samples of the older and the newer half allow."""
        samples = list(self._samples)
        if len(samples) < 2:
            return self._rate
        half = len(samples) // 2
        old = min(samples[:half], key=lambda s: s.slack)
        new = min(samples[half:], key=lambda s: s.slack)
        base = new.ours - old.ours
        if base <= 0:
            return self._rate
        rate, slack = (new.theirs - old.theirs) / base, (old.slack * max(self._rate, 1.0) + new.slack) / base
        if abs(rate - 1.0) <= slack + DRIFT:
            return 1.0
        if rate < STALLED and base < SHORT:
            return self._rate
        # drift and round trips do not explain it: the clock runs at another rate
        return max(rate, 0.0)

    @property
    def count(self) -> int:
        """Number of pings so far."""
        return self._count

    @property
    def rate(self) -> float:
        """Rate of the cabinet's clock relative to ours."""
        return self._rate

    @property
    def uncertainty(self) -> float:
        """Half the round trip of the best sample [s]; infinite before the first."""
        return self._anchor.slack * 1e-9

    def to_cabinet(self, ours: int) -> int:
        """Convert a time of our clock [ns] to the cabinet's [ns]."""
        if self._rate == 1.0:
            return ours + self._shift
        anchor = self._anchor
        return round(anchor.theirs + (ours - anchor.ours) * self._rate)

    def to_ours(self, theirs: int) -> int:
        """Convert a time of the cabinet's clock [ns] to ours [ns]; 0 before the first ping."""
        if not self._samples:
            return 0
        if self._rate == 1.0:
            return theirs - self._shift
        anchor = self._anchor
        return round(anchor.ours + (theirs - anchor.theirs) / (self._rate or 1.0))

    def age(self, stamp: int, ours: int) -> float:
        """Cabinet time from `stamp` (cabinet clock, ns) to `ours` (our clock, ns) [s]; NaN before the first ping."""
        if not self._samples:
            return float("nan")
        return (self.to_cabinet(ours) - stamp) * 1e-9
