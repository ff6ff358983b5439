"""A gripper behind two signals: what its switches mean, times, refusals. The program plays the wiring."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

import heptarm as ha

IS_OPEN, IS_CLOSED, HOLDS = "InputX3Pin3", "InputX3Pin4", "InputX3Pin10"
WIRED: dict[str, Any] = {
    "open": "OutputX3Pin1",
    "close": "OutputX3Pin2",
    "is_open": IS_OPEN,
    "is_closed": IS_CLOSED,
}


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture(autouse=True)
def opened(arm: ha.Arm) -> None:
    switch(arm, IS_OPEN)


def switch(arm: ha.Arm, *on: str) -> None:
    for name in (IS_OPEN, IS_CLOSED, HOLDS):
        arm.operator.set_signal(name, name in on)
    for name in (IS_OPEN, IS_CLOSED, HOLDS):
        arm.io.wait(name, name in on, timeout=30.0)


def later(arm: ha.Arm, *on: str) -> None:
    """The fingers arrive after the valve was switched."""

    def follow() -> None:
        arm.io.wait("OutputX3Pin2", timeout=30.0)
        for name in (IS_OPEN, IS_CLOSED, HOLDS):
            arm.operator.set_signal(name, name in on)

    threading.Thread(target=follow, daemon=True).start()


def test_it_closes_on_something_on_nothing_and_opens(arm: ha.Arm) -> None:
    gripper = ha.TwoSignalGripper(arm, **WIRED, settle=0.3)
    gripper.open()
    assert gripper.is_open and not gripper.holds_something
    later(arm)
    gripper.close()
    assert gripper.holds_something and not gripper.is_open and not gripper.is_closed
    assert (arm.io["OutputX3Pin1"], arm.io["OutputX3Pin2"]) == (False, True)
    switch(arm, IS_OPEN)
    gripper.open()
    later(arm, IS_CLOSED)
    gripper.close()
    assert gripper.is_closed and not gripper.holds_something


def test_an_input_for_a_gripped_part_replaces_the_wait(arm: ha.Arm) -> None:
    gripper = ha.TwoSignalGripper(arm, **WIRED, holds=HOLDS, settle=2.0)
    gripper.open()
    later(arm, HOLDS)
    gripper.close()
    assert gripper.holds_something


@pytest.mark.parametrize("holds", [None, HOLDS])
def test_a_gripper_without_air_is_a_timeout(arm: ha.Arm, holds: str | None) -> None:
    gripper = ha.TwoSignalGripper(arm, **WIRED, holds=holds, timeout=0.4, settle=0.2)
    gripper.open()
    with pytest.raises(
        ha.Timeout, match=r"did not close within 0\.4 s: the switch MediaFlange.InputX3Pin4 is off"
    ):
        gripper.close()
    switch(arm)
    with pytest.raises(ha.Timeout, match=r"did not open within 0\.4 s"):
        gripper.open()


def test_refusals(arm: ha.Arm) -> None:
    with pytest.raises(ha.CommandRejected, match="no signal 'DO1'"):
        ha.TwoSignalGripper(arm, **{**WIRED, "open": "DO1"})
    with pytest.raises(ha.LimitError, match="timeout"):
        ha.TwoSignalGripper(arm, **WIRED, timeout=0.0)
    with pytest.raises(ha.LimitError, match="settle"):
        ha.TwoSignalGripper(arm, **WIRED, timeout=1.0, settle=1.5)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"open": IS_OPEN}, "open must be a boolean output, got MediaFlange.InputX3Pin3"),
        ({"is_closed": "OutputX3Pin1"}, "is_closed must be a boolean input, got MediaFlange.OutputX3Pin1"),
        ({"close": "OutputX3Pin1"}, "close must be another signal than open, got MediaFlange.OutputX3Pin1"),
        ({"is_closed": IS_OPEN}, "is_closed must be another signal than is_open"),
        ({"holds": IS_CLOSED}, "holds must be another signal than is_closed"),
        ({"holds": "LEDRed"}, "holds must be a boolean input"),
    ],
)
def test_signals_that_cannot_be_its_own_are_refused_before_anything_is_switched(
    arm: ha.Arm, wrong: dict[str, str], text: str
) -> None:
    before = dict(arm.io.values_now)
    with pytest.raises(ha.CommandRejected, match=text) as caught:
        ha.TwoSignalGripper(arm, **{**WIRED, **wrong})
    assert caught.value.hint and caught.value.parameter in wrong
    assert dict(arm.io.values_now) == before
    assert repr(arm.io).startswith("<Io MediaFlange.InputX3Pin3, ")
    assert repr(ha.TwoSignalGripper(arm, **WIRED)).startswith("<TwoSignalGripper MediaFlange.OutputX3Pin1, ")
