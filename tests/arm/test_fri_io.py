"""Signals of FRI sessions through the whole stack: API, application, doubles, controller, and the loop's process."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import heptarm as ha
from heptarm.fri import Output, State
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.test_fri import LONG, patient

BUTTON, LAMP = "MediaFlange.UserButton", "MediaFlange.LEDBlue"


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    """A cabinet with an operator who presses the button."""
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
        yield arm


def until(condition: Callable[[], object]) -> None:
    """Wait for it."""
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def follow(s: State, out: Output, p: Any) -> None:
    out.io["led_blue"] = s.io["user_button"]


def meddle(s: State, out: Output, p: Any) -> None:
    if s.t > 0.1:
        out.io["user_button"] = True


@patient
def test_inputs_are_read_and_outputs_written_in_the_loop(arm: ha.Arm) -> None:
    arm.io[LAMP] = False
    with arm.fri("position", period_ms=LONG, io=["user_button", "LEDBlue"]) as rt:
        assert rt.inputs == {BUTTON: False} and rt.outputs == {LAMP: False}
        arm.operator.set_signal("UserButton", True)
        for s in rt:
            if s.io.user_button:
                break
        rt.output("LEDBlue", True)
        until(lambda: rt.outputs == {LAMP: True})
        until(lambda: arm.io[LAMP] is True)
        arm.io[LAMP] = False  # the application also writes it, and the session shows it
        until(lambda: rt.state.io[LAMP] is False)
        for name, value, words in (
            ("user_button", True, "is an input of the cabinet"),
            ("LEDRed", True, "no signal 'LEDRed' in this FRI session"),
            ("LEDBlue", 2, r"\(boolean\) must be"),
        ):
            with pytest.raises(ha.CommandRejected, match=words):
                rt.output(name, value)
    arm.operator.set_signal("UserButton", False)


@patient
def test_a_law_has_them_too(arm: ha.Arm) -> None:
    with arm.fri("position", period_ms=LONG, law=follow, io=[BUTTON, LAMP]) as rt:
        for pressed in (True, False):
            arm.operator.set_signal("UserButton", pressed)
            until(lambda: arm.io[LAMP] is pressed)  # noqa: B023
        assert rt.active
    with (
        pytest.raises(ha.StreamError, match="MediaFlange.UserButton is an input of the cabinet"),
        arm.fri("position", period_ms=LONG, law=meddle, io=[BUTTON]) as rt,
    ):
        assert not rt.wait(30.0)


@patient
def test_a_monitor_carries_signals_without_any_motion(arm: ha.Arm) -> None:
    with arm.fri("monitor", period_ms=2, io=[LAMP]) as rt:
        rt.output(LAMP, True)
        until(lambda: rt.state.io[LAMP] is True)
        until(lambda: arm.io[LAMP] is True)
    with arm.fri("monitor", period_ms=2) as rt:  # and the next one has none
        assert not rt.state.io and not rt.inputs and not rt.outputs


@pytest.mark.parametrize(
    ("names", "words", "code"),
    [
        (["Cell.Door"], "(unknown|no) signal .?Cell.Door", Code.UNKNOWN_NAME),
        ([LAMP, LAMP], "MediaFlange.* twice", Code.UNKNOWN_NAME),
        ([f"x{i}" for i in range(11)], "x0", None),
        ("LEDBlue", "a list of names", None),
    ],
)
def test_what_cannot_be_carried_is_refused_here_and_there(
    arm: ha.Arm, names: Any, words: str, code: Code | None
) -> None:
    with pytest.raises(ha.CommandRejected, match=words):
        arm.fri("monitor", io=names)
    if code is not None:
        message = wire.FriOpen(
            host="127.0.0.1", period=0.01, command=wire.FriCommandMode.MONITOR, io=tuple(names)
        )
        with pytest.raises(ha.CommandRejected, match=words) as error:
            arm.connection.request(message)
        assert error.value.code == code


def test_more_than_ten_are_refused(arm: ha.Arm) -> None:
    names = list(arm.io)[:11]
    with pytest.raises(ha.LimitError, match="at most 10"):
        arm.fri("monitor", io=names)
