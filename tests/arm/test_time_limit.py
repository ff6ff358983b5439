"""How long a program may take before waiting makes no sense: its own time, the override, the clock, the queue."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

import heptarm as ha
from tests.arm.peer import Peer

#: Of a program that holds for ten seconds: three times as long, and 15 s.
OWN = 45.0
DAY = 86400.0


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline, "it never happens"
        time.sleep(0.005)


def limits(arm: ha.Arm, peer: Peer, *seconds: float) -> list[float]:
    """Limits of programs that hold for so long, each behind those before it."""
    for number, _ in enumerate(seconds, 1):
        peer.runs(number)
    return [arm.start(ha.hold(one), when="queue").limit for one in seconds]


def override(arm: ha.Arm) -> float:
    motion = arm.state.motion
    return -1.0 if motion is None else motion.override


@pytest.mark.parametrize(("percent", "limit"), [(100, OWN), (50, 2 * OWN), (1, 100 * OWN), (0, 100 * OWN)])
def test_a_lower_override_gives_more_time(peer: Peer, percent: int, limit: float) -> None:
    peer.override = percent / 100
    with peer.arm() as arm:
        until(lambda: override(arm) == pytest.approx(percent / 100))
        assert limits(arm, peer, 10.0) == pytest.approx([limit])


@pytest.mark.parametrize(("rate", "factor"), [(0.5, 2.0), (1.0, 1.0), (4.0, 1.0)])
def test_a_cabinet_slower_than_time_gives_more_time_and_a_faster_one_not_less(
    peer: Peer, rate: float, factor: float
) -> None:
    peer.clock_rate = rate
    with peer.arm() as arm:
        until(lambda: arm.real_time_factor == pytest.approx(rate, rel=0.1))
        assert limits(arm, peer, 10.0) == pytest.approx([factor * OWN], rel=0.15)


def test_the_programs_before_it_count(peer: Peer) -> None:
    with peer.arm() as arm:
        assert limits(arm, peer, 10.0, 10.0, 20.0) == pytest.approx([OWN, 2 * OWN, 3 * OWN + 75.0])


def test_no_limit_is_longer_than_a_day(peer: Peer) -> None:
    with peer.arm() as arm:
        assert limits(arm, peer, 1e5) == [DAY]
