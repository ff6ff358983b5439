"""Watchdogs: one table of defaults, within the ranges of the protocol."""

from __future__ import annotations

from dataclasses import fields

import pytest

import heptarm as ha
from heptarm.arm import watchdog
from heptarm.arm.watchdog import CONNECTION, TARGETS, Watchdog
from heptarm.wire import messages as wire

TABLE = {name: value for name, value in vars(watchdog).items() if isinstance(value, Watchdog)}


@pytest.mark.parametrize("name", TABLE)
def test_every_default_is_in_the_range(name: str) -> None:
    assert TABLE[name].time(TABLE[name].default) == TABLE[name].default == TABLE[name].time()


def test_the_range_is_that_of_the_messages() -> None:
    for message in (wire.ServoJoints, wire.ServoJointsVelocity, wire.ServoPose, wire.ServoOpen):
        assert message.RANGES["watchdog"] == (TARGETS.low, TARGETS.high), message
    assert (
        next(field.default for field in fields(wire.TakeControl) if field.name == "watchdog")
        == CONNECTION.default
    )


@pytest.mark.parametrize(
    ("rate", "seconds"), [(1000.0, 0.2), (100.0, 0.2), (20.0, 0.25), (10.0, 0.5), (1.0, 2.0)]
)
def test_the_default_for_targets_follows_the_period(rate: float, seconds: float) -> None:
    assert TARGETS.time(period=1.0 / rate) == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("given", "period", "text"),
    [
        (0.004, 0.0, r"watchdog must be in \[0.005, 2\] s, got 0.004 s"),
        (2.5, 0.0, r"watchdog must be in \[0.005, 2\] s, got 2.5 s"),
        (0.05, 0.1, r"watchdog must not be shorter than the period of 0.1 s, got 0.05 s"),
        (None, 3.0, r"watchdog must not be shorter than the period of 3 s, got 2 s"),
    ],
)
def test_an_impossible_time_is_refused(given: float | None, period: float, text: str) -> None:
    with pytest.raises(ha.LimitError, match=text):
        TARGETS.time(given, period=period)
