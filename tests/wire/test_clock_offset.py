"""The estimate of the cabinet's clock, with simulated clocks."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.wire.clock_sync import ClockOffset


class Cabinet:
    """A clock that is a line over ours, and a network with delays."""

    def __init__(self, *, offset: float = 3e12, rate: float = 1.0, seed: int = 0) -> None:
        self.offset, self.rate = offset, rate
        self.random = random.Random(seed)

    def clock(self, ours: float) -> float:
        return self.offset + self.rate * ours

    def ping(self, estimate: ClockOffset, at: float, *, tail: float = 0.0) -> float:
        there = 20e3 + self.random.expovariate(1 / 10e3) + tail * (self.random.random() < 0.2)
        back = 20e3 + self.random.expovariate(1 / 10e3)
        estimate.feed(round(at), round(self.clock(at + there)), round(at + there + back))
        return at + there + back


def run(
    cabinet: Cabinet, estimate: ClockOffset, *, start: float, pings: int, every: float, **more: float
) -> float:
    for _ in range(pings):
        cabinet.ping(estimate, start, **more)
        start += every
    return start


def test_before_the_first_ping_nothing_is_known() -> None:
    estimate = ClockOffset()
    assert math.isnan(estimate.age(0, 0)) and estimate.uncertainty == math.inf and estimate.count == 0


def test_one_ping_is_within_half_its_round_trip() -> None:
    estimate = ClockOffset()
    estimate.feed(1000, 500_000, 3000)
    assert estimate.to_cabinet(2000) == 500_000
    assert estimate.uncertainty == pytest.approx(1e-6)
    assert estimate.age(400_000, 2000) == pytest.approx(1e-4)


def test_an_answer_from_before_its_ping_is_ignored() -> None:
    estimate = ClockOffset()
    estimate.feed(2000, 500_000, 1000)
    assert math.isnan(estimate.age(0, 0))


@given(st.integers(0, 1000), st.floats(-1e15, 1e15), st.floats(-50e-6, 50e-6))
def test_drifting_clocks_with_slow_pings_now_and_then(seed: int, offset: float, drift: float) -> None:
    cabinet, estimate = Cabinet(offset=offset, rate=1 + drift, seed=seed), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=6, every=3e6)
    for _ in range(60):
        now = run(cabinet, estimate, start=now, pings=1, every=125e6, tail=20e6)
        assert abs(estimate.to_cabinet(round(now)) - cabinet.clock(now)) < 150e3
    assert estimate.rate == pytest.approx(1.0, abs=2e-4)


@pytest.mark.parametrize("rate", [0.1, 0.5, 2.0, 5.0, 10.0, 50.0])
def test_a_clock_that_runs_faster_or_slower(rate: float) -> None:
    cabinet, estimate = Cabinet(rate=rate), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=6, every=3e6)
    assert estimate.rate == pytest.approx(rate, rel=0.02)
    now = run(cabinet, estimate, start=now, pings=40, every=50e6)
    assert estimate.rate == pytest.approx(rate, rel=2e-4)
    assert abs(estimate.to_cabinet(round(now)) - cabinet.clock(now)) < 100e3 * max(rate, 1)


@pytest.mark.parametrize("step", [-50e6, 5e6, 1e12])
def test_a_stalled_clock_is_followed_at_once(step: float) -> None:
    cabinet, estimate = Cabinet(), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=30, every=125e6)
    cabinet.offset += step
    now = run(cabinet, estimate, start=now, pings=1, every=125e6)
    assert abs(estimate.to_cabinet(round(now)) - cabinet.clock(now)) < 150e3
    assert estimate.rate == 1.0


@pytest.mark.parametrize("rate", [1.0, 3.0])
def test_a_clock_that_stands_for_a_moment_has_not_slowed_down(rate: float) -> None:
    cabinet, estimate = Cabinet(), ClockOffset()
    cabinet.rate, cabinet.offset = 0.0, 3e12
    now = run(cabinet, estimate, start=1e9, pings=6, every=3e6)
    assert estimate.rate == 1.0
    cabinet.offset, cabinet.rate = cabinet.clock(now) - rate * now, rate
    run(cabinet, estimate, start=now, pings=5, every=50e6)
    assert estimate.rate == pytest.approx(rate, rel=0.01)


def test_a_change_of_rate_is_followed_within_a_few_pings() -> None:
    cabinet, estimate = Cabinet(), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=30, every=50e6)
    cabinet.offset, cabinet.rate = cabinet.clock(now) - 5.0 * now, 5.0
    now = run(cabinet, estimate, start=now, pings=5, every=50e6)
    assert estimate.rate == pytest.approx(5.0, rel=0.01)
    assert abs(estimate.to_cabinet(round(now)) - cabinet.clock(now)) < 2e6


def test_old_samples_are_forgotten() -> None:
    cabinet, estimate = Cabinet(), ClockOffset(window=1000, span=1.0)
    run(cabinet, estimate, start=1e9, pings=100, every=50e6)
    assert len(estimate._samples) <= 22


def test_a_small_step_after_a_silence_shows_on_a_clock_of_our_rate() -> None:
    cabinet, estimate = Cabinet(), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=10, every=125e6)
    cabinet.offset += 20e6  # a drift of 100 ppm over ten seconds is 1 ms
    cabinet.ping(estimate, now + 10e9)
    assert abs(estimate.to_cabinet(round(now + 10e9)) - cabinet.clock(now + 10e9)) < 150e3
    assert estimate.rate == 1.0  # it stepped, it does not run faster


def test_a_rate_that_is_not_ours_is_known_to_a_hundredth_so_that_a_ping_after_a_silence_corrects_it() -> None:
    cabinet, estimate = Cabinet(rate=5.0), ClockOffset()
    now = run(cabinet, estimate, start=1e9, pings=10, every=125e6)
    cabinet.offset, cabinet.rate = cabinet.clock(now) - 5.03 * now, 5.03
    cabinet.ping(estimate, now + 10e9)
    assert estimate.rate == pytest.approx(5.03, rel=1e-3)


def test_two_pings_show_a_rate() -> None:
    cabinet, estimate = Cabinet(rate=5.0), ClockOffset()
    run(cabinet, estimate, start=1e9, pings=2, every=1e9)
    assert estimate.rate == pytest.approx(5.0, rel=1e-3)
