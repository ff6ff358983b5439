"""Faults of a line and of a robot, injected on purpose: seeded, so that a run can be repeated to the datagram.

A `Line` carries datagrams in one direction and does to them what its `Faults` say. Times are nanoseconds on the
caller's clock, those of `Faults` and `Scenario` seconds since the line's first datagram.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field, fields, replace
from random import Random

from heptarm.errors import LimitError
from heptarm.fri import messages as m
from heptarm.fri.codec import decode_monitoring, encode_monitoring
from heptarm.fri.version import Version

Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Faults:
    """What happens to datagrams under way; shares are probabilities of each datagram by itself.

    Args:
        loss: share that never arrives.
        duplicate: share that arrives twice.
        corrupt: share with one to four octets changed.
        reorder: share that is held back until the next one has passed.
        delay: of every datagram [s].
        jitter: more delay, evenly between 0 and this [s].
        burst: share at which a burst begins: all of the next `burst_time` arrives together at its end.
        burst_time: [s].
        silence: spans in which nothing arrives that is sent in them [s].
        seed: of the random numbers.

    Raises:
        LimitError: a share is no probability, or a time negative.
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
        for one in fields(self)[:8]:
            value = getattr(self, one.name)
            is_time = one.name in ("delay", "jitter", "burst_time")
            if not 0.0 <= value <= (float("inf") if is_time else 1.0):
                raise LimitError(
                    f"{one.name} is {value}; {'a time' if is_time else 'a share'} is wanted",
                    parameter=one.name,
                    value=value,
                    allowed="[0, inf) s" if is_time else "[0, 1]",
                )


NONE = Faults()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """What goes wrong in a session.

    Args:
        to_client: faults of the cabinet's messages under way.
        from_client: faults of the answers under way.
        stops: safety stops, each with its span [s].
        strange: spans in which the cabinet speaks `version` instead of its own [s].
        version: the wrong one; None: never.
    """

    to_client: Faults = NONE
    from_client: Faults = NONE
    stops: tuple[tuple[Span, m.Safety], ...] = ()
    strange: tuple[Span, ...] = ((0.0, float("inf")),)
    version: Version | None = None

    def safety(self, elapsed: float) -> m.Safety | None:
        """The safety stop in force after so many seconds, if there is one."""
        return next((stop for span, stop in self.stops if _within(span, elapsed)), None)

    def spoken(self, datagram: bytes, version: Version, elapsed: float) -> bytes:
        """A monitoring datagram of a version as it leaves the cabinet after so many seconds."""
        if self.version is None or not any(_within(span, elapsed) for span in self.strange):
            return datagram
        return translate(datagram, version, self.version)


def _within(span: Span, time: float) -> bool:
    return span[0] <= time < span[1]


def translate(datagram: bytes, version: Version, other: Version) -> bytes:
    """A monitoring datagram as a cabinet of another version would have sent it, without what that one lacks."""
    message = decode_monitoring(datagram, version)
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
class Damage:
    """Datagrams so far, by what was done to them."""

    passed: int = 0
    lost: int = 0
    duplicated: int = 0
    corrupted: int = 0
    reordered: int = 0


@dataclass(order=True, slots=True)
class _UnderWay:
    due: int
    rank: int
    datagram: bytes = field(compare=False)


class Line:
    """One direction of a network with faults.

    Attributes:
        damage: counts of what was done.
    """

    def __init__(self, faults: Faults = NONE) -> None:
        self._faults = faults
        self._random = Random(faults.seed)
        self._under_way: list[_UnderWay] = []
        self._held: list[bytes] = []
        self._rank = 0
        self._start: int | None = None
        self._gate = -1  # until then a burst holds everything back
        self.damage = Damage()

    def send(self, datagram: bytes, now: int) -> None:
        """Put a datagram on the line at `now` [ns]."""
        faults, chance = self._faults, self._random.random
        if self._start is None:
            self._start = now
        # every random number is drawn for every datagram, so that one fault does not shift the others
        lost, twice, broken, late, bursts, share = (chance() for _ in range(6))
        elapsed = (now - self._start) * 1e-9
        if lost < faults.loss or any(_within(span, elapsed) for span in faults.silence):
            self.damage.lost += 1
            return
        if broken < faults.corrupt:
            datagram = self._corrupted(datagram)
        if bursts < faults.burst and now >= self._gate:
            self._gate = now + round(faults.burst_time * 1e9)
        due = max(now + round((faults.delay + share * faults.jitter) * 1e9), self._gate)
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
        """What has arrived by `now` [ns], in order of arrival."""
        return [datagram for datagram, _ in self.taken(now)]

    def taken(self, now: int) -> list[tuple[bytes, int]]:
        """What has arrived by `now` [ns], in order of arrival, each with its time of arrival."""
        found = []
        while self._under_way and self._under_way[0].due <= now:
            one = heapq.heappop(self._under_way)
            found.append((one.datagram, one.due))
        self.damage.passed += len(found)
        return found

    def _push(self, datagram: bytes, due: int) -> None:
        self._rank += 1
        heapq.heappush(self._under_way, _UnderWay(due, self._rank, datagram))

    def _corrupted(self, datagram: bytes) -> bytes:
        octets = bytearray(datagram)
        for _ in range(self._random.randint(1, 4)):
            octets[self._random.randrange(len(octets))] ^= self._random.randint(1, 255)
        self.damage.corrupted += 1
        return bytes(octets)
