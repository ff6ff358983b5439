"""Clocks."""

from __future__ import annotations

import time

from heptarm.io.clock import Clock, RealClock, StepClock


def test_the_real_clock_goes_on_and_sleeps() -> None:
    clock: Clock = RealClock()
    began = clock.nanos()
    clock.sleep(0.01)
    clock.sleep(-1.0)
    assert 9e6 < clock.nanos() - began < 1e9
    assert abs(clock.nanos() - time.monotonic_ns()) < 1e8


def test_the_real_clock_is_never_early() -> None:
    clock: Clock = RealClock()
    for ahead in (-1_000_000, 20_000, 2_000_000):
        due = clock.nanos() + ahead
        clock.sleep_until(due)
        assert clock.nanos() >= due


def test_a_step_clock_moves_on_request() -> None:
    clock: Clock = StepClock(5)
    clock.sleep_until(7)
    clock.sleep_until(5)
    assert clock.nanos() == 7
    clock = StepClock(5)
    clock.sleep(1.0)
    assert clock.nanos() == 1_000_000_005
    clock.sleep(-1.0)
    assert clock.nanos() == 1_000_000_005
