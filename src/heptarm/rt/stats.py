"""How well an FRI client does, from the counts in the shared memory."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.fri.statistics import Counters, Histogram
from heptarm.rt import layout as at


@dataclass(frozen=True, slots=True)
class Stats:
    """How well it goes; counts are over all sessions of the client.

    Attributes:
        received: messages of the controller.
        answered: answers sent.
        lost: messages that never came.
        missed: answers that the controller did not take in time.
        duplicated: messages that came twice.
        reordered: messages overtaken by later ones.
        malformed: datagrams that were no message.
        restarts: sessions that began anew.
        commanded: answers whose commands were effective.
        filled: of those, made by the policy without a fresh command.
        limited: of those, changed by the guard.
        quality: messages by the quality that they named.
        latency: receipt to answer, [s]: median, 99 %, 99.9 %, longest.
        jitter: deviation from the send period, [s]: median, 99 %, 99.9 %, longest.
    """

    received: int
    answered: int
    lost: int
    missed: int
    duplicated: int
    reordered: int
    malformed: int
    restarts: int
    commanded: int
    filled: int
    limited: int
    quality: dict[str, int]
    latency: tuple[float, ...]
    jitter: tuple[float, ...]

    @classmethod
    def of(cls, layout: at.Layout) -> Stats:
        """What a loop has counted so far."""
        counts = Counters()
        counts.load(layout.header, at.COUNTS)
        latency, jitter = Histogram(layout.latency), Histogram(layout.jitter)
        shares = (0.5, 0.99, 0.999)
        return cls(
            received=counts.received,
            answered=counts.answered,
            lost=counts.lost,
            missed=counts.missed,
            duplicated=counts.duplicated,
            reordered=counts.reordered,
            malformed=counts.malformed,
            restarts=counts.restarts,
            commanded=counts.commanded,
            filled=counts.filled,
            limited=counts.limited,
            quality={name: getattr(counts, name) for name in ("poor", "fair", "good", "excellent")},
            latency=(*latency.percentiles(*shares), latency.longest),
            jitter=(*jitter.percentiles(*shares), jitter.longest),
        )
