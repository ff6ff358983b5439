"""The keyboard, on a real pseudo-terminal: keys move as long as they are reported."""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator

import numpy as np
import pytest

from heptarm import devices
from heptarm.devices.keyboard import HELP, KEYS, Keyboard
from heptarm.errors import LimitError, NotReady
from heptarm.io.clock import StepClock


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """The side of the person, and that of the program."""
    person, program = os.openpty()
    yield person, program
    for file in (person, program):
        try:
            os.close(file)
        except OSError:
            pass  # a test has closed it


def test_a_key_moves_while_it_is_reported_and_silence_is_a_release(terminal: tuple[int, int]) -> None:
    person, program = terminal
    clock = StepClock()
    with Keyboard(program, clock=clock) as keyboard:
        assert not keyboard.read().twist.any()
        os.write(person, b"w")
        clock.step(0.05)
        assert keyboard.read().twist.tolist() == [1, 0, 0, 0, 0, 0]
        clock.step(0.15)
        assert keyboard.read().twist[0] == 1.0
        os.write(person, b"wd")  # held, and another one
        assert keyboard.read().twist.tolist() == [1, -1, 0, 0, 0, 0]
        clock.step(0.21)
        assert not keyboard.read().twist.any()


def test_every_axis_has_a_key_for_each_direction_and_is_explained() -> None:
    assert sorted(KEYS.values()) == [(axis, sign) for axis in range(6) for sign in (-1.0, 1.0)]
    assert all(f" {key} " in f" {HELP} ".replace(":", " ") for key in KEYS)


def test_keys_against_each_other_cancel_and_buttons_have_names(terminal: tuple[int, int]) -> None:
    person, program = terminal
    with Keyboard(program, clock=StepClock()) as keyboard:
        os.write(person, b"ad q?\xff")
        seen = keyboard.read()
        np.testing.assert_array_equal(seen.twist, np.zeros(6))
        assert seen.buttons == {"SPACE", "Q"} == {keyboard.roles.gripper, keyboard.roles.quit}


def test_the_terminal_is_given_back_as_it_was(terminal: tuple[int, int]) -> None:
    _, program = terminal
    before = termios.tcgetattr(program)
    keyboard = Keyboard(program)
    assert termios.tcgetattr(program)[3] != before[3]
    keyboard.close()
    keyboard.close()
    assert termios.tcgetattr(program) == before
    assert not keyboard.read().twist.any()


def test_a_terminal_that_is_closed_is_an_error(terminal: tuple[int, int]) -> None:
    person, program = terminal
    keyboard = Keyboard(program)
    os.write(person, b"w")
    assert keyboard.read().twist[0] == 1.0
    os.close(person)
    with pytest.raises(NotReady, match="terminal cannot be read"):
        keyboard.read()
    keyboard.close()


def test_no_terminal_is_one_sentence() -> None:
    source, sink = os.pipe()
    try:
        with pytest.raises(NotReady, match=r"needs a terminal.*another device"):
            Keyboard(source)
    finally:
        os.close(source)
        os.close(sink)
    with pytest.raises(LimitError, match="hold"):
        devices.keyboard(hold=5.0)
