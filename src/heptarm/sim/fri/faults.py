"""Fault injection on the network and the robot; seeded, so that a run is repeatable to the datagram.

A `FaultyLink` transports datagrams in one direction and applies its `LinkFaults`. Times are nanoseconds on the
caller's clock, those of `LinkFaults` and `FaultScenario` seconds since the link's first datagram.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field, fields, replace
from random import Random

from heptarm.errors import LimitError
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import encode_monitoring
from heptarm.fri.protocol.version import Version

Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkFaults:
    """Faults of a network link; probabilities are independent for each datagram.

    Args:
        loss: probability of a loss.
        duplicate: probability of arriving twice.
        corrupt: probability of one to four changed bytes.
        reorder: probability of being overtaken by the next datagram.
        delay: of every datagram [s].
        jitter: additional delay, uniform between 0 and this [s].
        burst: probability that a burst begins: all datagrams of the next `burst_time` arrive together at its end.
        burst_time: [s].
        silence: spans in which all datagrams are lost [s].
        seed: of the random numbers.

    Raises:
        LimitError: a probability is outside [0, 1], or a time is negative.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    reorder: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    burst: float = 0.0
    burst_time: float = 0.005
    silence: tuple[Span, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        for setting in fields(self)[:8]:
            value = getattr(self, setting.name)
            is_time = setting.name in ("delay", "jitter", "burst_time")
            if not 0.0 <= value <= (float("inf") if is_time else 1.0):
                raise LimitError(
                    f"{setting.name} must be in {'[0, inf) s' if is_time else '[0, 1]'}, got {value}",
                    parameter=setting.name,
                    value=value,
                    allowed="[0, inf) s" if is_time else "[0, 1]",
                )


NONE = LinkFaults()


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultScenario:
    """Faults of a session.

    Args:
        to_client: faults of the cabinet's messages.
        from_client: faults of the client's answers.
        stops: safety stops, each with its span [s].
        strange: spans in which the cabinet sends in `version` instead of its own [s].
        version: the wrong version; None: never.
    """

    to_client: LinkFaults = NONE
    from_client: LinkFaults = NONE
    stops: tuple[tuple[Span, m.Safety], ...] = ()
    strange: tuple[Span, ...] = ((0.0, float("inf")),)
    version: Version | None = None

    def safety(self, elapsed: float) -> m.Safety | None:
        """The safety stop at a time [s], if there is one."""
        return next((stop for span, stop in self.stops if _within(span, elapsed)), None)

    def sent(self, datagram: bytes, message: m.Monitoring, elapsed: float) -> bytes:
        """A monitoring datagram, and its message, as the cabinet sends it at a time [s]."""
        if self.version is None or not any(_within(span, elapsed) for span in self.strange):
            return datagram
        return translate(message, self.version)


def _within(span: Span, time: float) -> bool:
    return span[0] <= time < span[1]


def translate(message: m.Monitoring, other: Version) -> bytes:
    """A monitoring message as a cabinet of another version would send it, without fields that one lacks."""
    traits = other.traits
    monitor, ipo = message.monitor or m.MonitorData(), message.ipo or m.IpoData()
    if not traits.quaternions:
        monitor = replace(monitor, pose=None, redundancy=None, q_cmd=monitor.q_cmd or monitor.q)
        ipo = replace(ipo, pose=None, redundancy=None)
    else:
        monitor = replace(monitor, q_cmd=None)
    monitor = replace(
        monitor, io=monitor.io if traits.io else (), wrench=monitor.wrench if traits.framed else None
    )
    return encode_monitoring(replace(message, monitor=monitor, ipo=ipo, requested=()), other)


@dataclass(slots=True)
class LinkFaultCounts:
    """Datagrams so far, by fault."""

    passed: int = 0
    lost: int = 0
    duplicated: int = 0
    corrupted: int = 0
    reordered: int = 0


@dataclass(order=True, slots=True)
class _InTransit:
    due: int
    rank: int
    datagram: bytes = field(compare=False)


class FaultyLink:
    """One direction of a network link with faults.

    Attributes:
        damage: counts of faults.
    """

    def __init__(self, faults: LinkFaults = NONE) -> None:
        self._faults = faults
        self._random = Random(faults.seed)
        self._in_transit: list[_InTransit] = []
        self._held: list[bytes] = []
        self._rank = 0
        self._start: int | None = None
        self._gate = -1  # a burst holds everything back until this time
        self.damage = LinkFaultCounts()

    def send(self, datagram: bytes, now: int) -> None:
        """Send a datagram at `now` [ns]."""
        faults, chance = self._faults, self._random.random
        if self._start is None:
            self._start = now
        # every random number is drawn for every datagram, so that one fault does not shift the others
        lost, twice, broken, late, bursts, portion = (chance() for _ in range(6))
        elapsed = (now - self._start) * 1e-9
        if lost < faults.loss or any(_within(span, elapsed) for span in faults.silence):
            self.damage.lost += 1
            return
        if broken < faults.corrupt:
            datagram = self._corrupted(datagram)
        if bursts < faults.burst and now >= self._gate:
            self._gate = now + round(faults.burst_time * 1e9)
        due = max(now + round((faults.delay + portion * faults.jitter) * 1e9), self._gate)
        if late < faults.reorder:
            self.damage.reordered += 1
            self._held.append(datagram)
            return
        for _ in range(1 + (twice < faults.duplicate)):
            self._push(datagram, due)
        self.damage.duplicated += twice < faults.duplicate
        for held in self._held:
            self._push(held, due)
        self._held.clear()

    def arrived(self, now: int) -> list[bytes]:
        """Datagrams that have arrived by `now` [ns], in order of arrival."""
        return [datagram for datagram, _ in self.taken(now)]

    def taken(self, now: int) -> list[tuple[bytes, int]]:
        """Datagrams that have arrived by `now` [ns], in order of arrival, with their times of arrival."""
        found = []
        while self._in_transit and self._in_transit[0].due <= now:
            datagram = heapq.heappop(self._in_transit)
            found.append((datagram.datagram, datagram.due))
        self.damage.passed += len(found)
        return found

    def _push(self, datagram: bytes, due: int) -> None:
        self._rank += 1
        heapq.heappush(self._in_transit, _InTransit(due, self._rank, datagram))

    def _corrupted(self, datagram: bytes) -> bytes:
        data = bytearray(datagram)
        for _ in range(self._random.randint(1, 4)):
            data[self._random.randrange(len(data))] ^= self._random.randint(1, 255)
        self.damage.corrupted += 1
        return bytes(data)
