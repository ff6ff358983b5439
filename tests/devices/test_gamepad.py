"""Gamepads: events in the kernel's format, read by the real library's reader, become deflections and buttons.

There is no pad here: the bytes are made by this test after `struct input_event` of linux/input.h, and come through a
pipe. Where the machine has /dev/uinput, a virtual pad of the kernel is opened and read as well.
"""

from __future__ import annotations

import os
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from heptarm import devices
from heptarm.devices.gamepad import AxisRange, Gamepad
from heptarm.errors import CommandRejected, LimitError, MissingExtra, NotReady

SYNC, KEY, ABSOLUTE = 0, 1, 3
LX, LY, LT, RX, RY, HAT_X, HAT_Y = 0, 1, 2, 3, 4, 16, 17
A, B, LB, START = 0x130, 0x131, 0x136, 0x13B
#: An XBox pad: sticks of 16 bits, triggers of 10, a cross of three positions.
RANGES = {LX: (-32768, 32767), LY: (-32768, 32767), RX: (-32768, 32767), RY: (-32768, 32767)} | {
    LT: (0, 1023),
    5: (0, 1023),
    HAT_X: (-1, 1),
    HAT_Y: (-1, 1),
}


def event(kind: int, code: int, value: int) -> bytes:
    """An event as the kernel writes it."""
    return struct.pack("llHHi", 1_700_000_000, 250_000, kind, code, value)


class Pipe:
    """The kernel's end of a pad: what is written to it is read with evdev."""

    def __init__(self) -> None:
        eventio = pytest.importorskip("evdev.eventio", reason="evdev is for Linux only")
        source, self._file = os.pipe()
        os.set_blocking(source, False)
        self.source = eventio.EventIO.__new__(eventio.EventIO)
        self.source.fd = source

    def write(self, *events: tuple[int, int, int]) -> None:
        os.write(self._file, b"".join(event(*one) for one in (*events, (SYNC, 0, 0))))

    def unplug(self) -> None:
        os.close(self._file)
        os.close(self.source.fd)


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    one = Pipe()
    yield one
    try:
        one.unplug()
    except OSError:
        pass  # a test has done it


@pytest.fixture
def pad(pipe: Pipe) -> Gamepad:
    return Gamepad(pipe.source, {code: AxisRange(*limits) for code, limits in RANGES.items()})


@pytest.mark.parametrize(
    ("axis", "value", "expected"),
    [
        (LY, -32768, [1, 0, 0, 0, 0, 0]),  # away from the person is forward
        (LX, -32768, [0, 1, 0, 0, 0, 0]),  # to the left
        (RY, -32768, [0, 0, 1, 0, 0, 0]),  # up
        (HAT_X, 1, [0, 0, 0, 1, 0, 0]),
        (HAT_Y, -1, [0, 0, 0, 0, 1, 0]),
        (RX, -32768, [0, 0, 0, 0, 0, 1]),  # anticlockwise, seen from above
        (LY, 32767, [-1, 0, 0, 0, 0, 0]),
        (LX, 200, [0] * 6),  # within the dead zone
        (LX, -16384, [0, (0.5 - 0.1) / 0.9, 0, 0, 0, 0]),
    ],
)
def test_each_axis_moves_where_it_points(
    pad: Gamepad, pipe: Pipe, axis: int, value: int, expected: list[float]
) -> None:
    pipe.write((ABSOLUTE, axis, value))
    np.testing.assert_allclose(pad.read().twist, expected, atol=1e-4)
    pipe.write((ABSOLUTE, axis, 0))
    np.testing.assert_allclose(pad.read().twist, 0.0, atol=1e-4)


def test_buttons_are_held_until_they_are_released(pad: Gamepad, pipe: Pipe) -> None:
    assert pad.read().buttons == frozenset()
    pipe.write((KEY, LB, 1), (KEY, A, 1), (ABSOLUTE, LT, 900), (KEY, 0x2FF, 1))
    assert pad.read().buttons == {"LB", "A", "LT"}
    assert pad.read().buttons == {"LB", "A", "LT"}, "nothing new has happened"
    pipe.write((KEY, A, 0), (ABSOLUTE, LT, 100))
    assert pad.read().buttons == {"LB"}
    assert (pad.roles.dead_man, pad.roles.gripper, pad.roles.quit) == ("LB", "A", "START")


def test_after_lost_events_nothing_is_held(pad: Gamepad, pipe: Pipe) -> None:
    pipe.write((KEY, LB, 1), (ABSOLUTE, LY, -32768))
    assert pad.read().buttons == {"LB"}
    pipe.write((SYNC, 3, 0))  # SYN_DROPPED
    seen = pad.read()
    assert not seen.buttons and not seen.twist.any()


def test_a_pad_that_is_gone_is_an_error_and_not_its_last_deflection(pad: Gamepad, pipe: Pipe) -> None:
    pipe.write((KEY, LB, 1), (ABSOLUTE, LY, -32768))
    assert pad.read().twist[0] == 1.0
    pipe.unplug()
    with pytest.raises(NotReady, match="gamepad cannot be read"):
        pad.read()


def test_the_library_that_is_missing_is_named_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "evdev", None)
    with pytest.raises(MissingExtra, match=r"pip install 'heptarm\[devices\]'"):
        devices.gamepad()
    monkeypatch.setitem(sys.modules, "pyspacemouse", None)
    with pytest.raises(MissingExtra, match=r"pip install 'heptarm\[devices\]'"):
        devices.spacemouse()
    with pytest.raises(LimitError, match="dead_zone"):
        devices.gamepad(dead_zone=1.0)


def test_only_gamepads_are_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    mouse = SimpleNamespace(
        path="/dev/input/event0", name="A mouse", close=lambda: None, capabilities=lambda: {KEY: [0x110]}
    )
    evdev = SimpleNamespace(list_devices=lambda: [mouse.path], InputDevice=lambda path: mouse)
    monkeypatch.setitem(sys.modules, "evdev", evdev)
    with pytest.raises(NotReady, match=r"no gamepad was found.*usermod"):
        devices.gamepad()
    with pytest.raises(CommandRejected, match="path must be a gamepad, /dev/input/event0 is 'A mouse'"):
        devices.gamepad(mouse.path)


@pytest.mark.skipif(
    not os.access("/dev/uinput", os.W_OK), reason="this machine has no /dev/uinput that may be written"
)
def test_a_virtual_pad_of_the_kernel_is_found_and_read() -> None:
    import evdev

    axes = [(code, evdev.AbsInfo(0, low, high, 0, 0, 0)) for code, (low, high) in RANGES.items()]
    with evdev.UInput({KEY: [A, B, LB, START], ABSOLUTE: axes}, name="heptarm test pad") as virtual:  # type: ignore[dict-item]
        deadline = time.monotonic() + 20.0
        while not Path(str(virtual.device.path)).exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        with devices.gamepad(str(virtual.device.path)) as pad:
            assert pad.name == "heptarm test pad"
            virtual.write(KEY, LB, 1)
            virtual.write(ABSOLUTE, LY, -32768)
            virtual.syn()
            seen = pad.read()
            while "LB" not in seen.buttons and time.monotonic() < deadline:
                seen = pad.read()
            np.testing.assert_allclose(pad.read().twist, [1, 0, 0, 0, 0, 0], atol=1e-4)
