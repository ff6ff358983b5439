"""The SpaceMouse of 3Dconnexion, read with pyspacemouse."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Any, Protocol

from heptarm.devices.device import DEAD_ZONE, REST, DeviceInput, Roles, without_dead_zone
from heptarm.errors import NotReady, require
from heptarm.values.checks import within
from heptarm.values.sealed import Sealed

#: Most reports that one reading handles: translation, rotation and buttons come as reports of their own.
_MOST_REPORTS = 64
_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_BUTTONS = ("LEFT", "RIGHT")


class MouseState(Protocol):
    """What pyspacemouse reports: deflections and buttons, as its class `SpaceMouseState`."""

    t: float
    buttons: Sequence[int]


class Mouse(Protocol):
    """A device of pyspacemouse."""

    def read(self) -> MouseState:
        """Handle the next report, if there is one."""

    def close(self) -> None:
        """Release it."""


class SpaceMouse(Sealed):
    """A SpaceMouse: its cap moves the arm in all six directions while the left button is held.

    Args:
        mouse: of pyspacemouse, with its axes forward, left and up (`AxisConvention.ROS`).
        dead_zone: deflections below this are none, 0 to 0.9.
    """

    name = "SpaceMouse"
    roles: Roles = Roles(dead_man="LEFT", gripper="RIGHT")

    def __init__(self, mouse: Mouse, *, dead_zone: float = DEAD_ZONE) -> None:
        self._mouse = mouse
        self._zone = within(dead_zone, "dead_zone", 0.0, 0.9)
        self._closed = False

    def read(self) -> DeviceInput:
        """What is deflected and held now.

        Raises:
            NotReady: the mouse is gone.
        """
        if self._closed:
            return REST
        try:
            state = self._mouse.read()
            last = None
            for _ in range(_MOST_REPORTS):
                if state.t == last:
                    break
                last = state.t
                state = self._mouse.read()
        except Exception as error:  # of the library for HID devices, which has no common base
            raise NotReady(
                f"the SpaceMouse cannot be read: {error}", hint="check its cable, and open it again"
            ) from error
        twist = [without_dead_zone(float(getattr(state, axis)), self._zone) for axis in _AXES]
        # the first two buttons have names, further ones numbers
        names = (*_BUTTONS, *(str(number) for number in range(3, 65)))
        return DeviceInput.of(twist, {name for name, held in zip(names, state.buttons) if held})

    def close(self) -> None:
        """Release it; calling it again has no effect."""
        if not self._closed:
            self._closed = True
            self._mouse.close()

    def __enter__(self) -> SpaceMouse:
        """The mouse itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Release it."""
        self.close()


def spacemouse(*, dead_zone: float = DEAD_ZONE) -> SpaceMouse:
    """Open the first SpaceMouse; needs `pip install 'heptarm[devices]'` and the system's library hidapi.

    Args:
        dead_zone: deflections below this are none, 0 to 0.9.

    Raises:
        MissingExtra: pyspacemouse is not installed, or does not find hidapi.
        NotReady: there is no SpaceMouse, or it may not be read.
    """
    within(dead_zone, "dead_zone", 0.0, 0.9)
    library: Any = require("pyspacemouse", extra="devices")
    try:
        mouse = library.open(axis_convention=library.AxisConvention.ROS)
    except Exception as error:  # RuntimeError, and others of the library for HID devices
        raise NotReady(
            f"no SpaceMouse could be opened: {error}",
            hint="connect one; if it is connected, allow this user to read hidraw devices by a rule of udev",
        ) from error
    return SpaceMouse(mouse, dead_zone=dead_zone)
