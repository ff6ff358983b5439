"""The SpaceMouse: reports as its USB interface sends them, decoded by the real library, become deflections.

There is no mouse here: the reports are made by this test after the layout in the library's own table of devices, and
the library for HID devices below it, which needs hidapi of the system, is a stand-in without one function that is used.
"""

from __future__ import annotations

import struct
import sys
from collections import deque
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from heptarm import devices
from heptarm.devices.spacemouse import SpaceMouse
from heptarm.errors import NotReady


class Usb:
    """A HID device that returns reports, then nothing."""

    def __init__(self) -> None:
        self.reports: deque[bytes] = deque()
        self.product_string = self.manufacturer_string = self.serial_number = ""
        self.release_number = 1
        self.is_open = self.is_gone = False

    def open(self) -> None:
        self.is_open = True

    def close(self) -> None:
        self.is_open = False

    def read(self, size: int) -> bytes:
        if self.is_gone:
            raise OSError("the device is gone")
        return self.reports.popleft() if self.reports else b""


@pytest.fixture
def usb(monkeypatch: pytest.MonkeyPatch) -> Usb:
    return Usb()


@pytest.fixture
def mouse(usb: Usb, monkeypatch: pytest.MonkeyPatch) -> SpaceMouse:
    stand_in = ModuleType("easyhid")
    stand_in.HIDException = OSError  # type: ignore[attr-defined]
    stand_in.Device = Usb  # type: ignore[attr-defined]
    stand_in.Enumeration = SimpleNamespace  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "easyhid", stand_in)
    library = pytest.importorskip("pyspacemouse")
    info = library.apply_axis_convention(
        library.get_device_specs()["SpaceNavigator"], library.AxisConvention.ROS
    )
    device = library.SpaceMouseDevice(info, usb)
    device.open()
    return SpaceMouse(device)


def report(channel: int, *values: int) -> bytes:
    return struct.pack(f"<B{len(values)}h", channel, *values)


def test_the_cap_moves_where_it_is_pushed(mouse: SpaceMouse, usb: Usb) -> None:
    assert not mouse.read().twist.any()
    usb.reports.append(report(1, 0, -350, 0))  # away from the person: y of the USB interface points to them
    np.testing.assert_allclose(mouse.read().twist, [1, 0, 0, 0, 0, 0])
    usb.reports.append(report(1, -350, 0, 0))
    np.testing.assert_allclose(mouse.read().twist, [0, 1, 0, 0, 0, 0])
    usb.reports.append(report(1, 0, 0, -175))  # lifted half
    np.testing.assert_allclose(mouse.read().twist, [0, 0, (0.5 - 0.1) / 0.9, 0, 0, 0])
    usb.reports.extend([report(1, 0, 0, 0), report(2, 0, 0, -350)])  # turned anticlockwise: z points down
    np.testing.assert_allclose(mouse.read().twist, [0, 0, 0, 0, 0, 1])


def test_its_buttons_are_the_dead_man_switch_and_the_gripper(mouse: SpaceMouse, usb: Usb) -> None:
    usb.reports.append(bytes([3, 0b01, 0]))
    assert mouse.read().buttons == {"LEFT"} == {mouse.roles.dead_man}
    usb.reports.append(bytes([3, 0b11, 0]))
    assert mouse.read().buttons == {"LEFT", mouse.roles.gripper}
    usb.reports.append(bytes([3, 0, 0]))
    assert not mouse.read().buttons


def test_a_mouse_that_is_gone_is_an_error(mouse: SpaceMouse, usb: Usb) -> None:
    usb.is_gone = True
    with pytest.raises(NotReady, match="SpaceMouse cannot be read"):
        mouse.read()
    mouse.close()
    mouse.close()
    assert not usb.is_open and not mouse.read().twist.any()


def test_no_mouse_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise RuntimeError("No supported device found")

    library = SimpleNamespace(open=refuse, AxisConvention=SimpleNamespace(ROS="ros"))
    monkeypatch.setitem(sys.modules, "pyspacemouse", library)
    with pytest.raises(NotReady, match=r"no SpaceMouse could be opened.*udev"):
        devices.spacemouse()
