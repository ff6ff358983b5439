"""Gamepads, through Linux's input events: sticks are velocities, a shoulder button is the dead-man switch.

They are read with the library evdev: it needs no window and no display server, gets the events as the kernel sends
them, and knows the range of every axis. (pygame and other layers over SDL want a video system and an event loop;
`inputs` has had no release since 2018.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Protocol

import numpy as np

from heptarm.devices.device import DEAD_ZONE, REST, DeviceInput, Roles, gone, without_dead_zone
from heptarm.errors import CommandRejected, NotReady, refuse_windows, require
from heptarm.values.checks import instance, within
from heptarm.values.sealed import Sealed

# Codes of the kernel's interface, as in linux/input-event-codes.h.
_SYNC, _KEY, _ABSOLUTE = 0x00, 0x01, 0x03
_DROPPED = 3
_LEFT_X, _LEFT_Y, _LEFT_TRIGGER, _RIGHT_X, _RIGHT_Y, _RIGHT_TRIGGER = range(6)
_HAT_X, _HAT_Y = 0x10, 0x11
_GAMEPAD = 0x130
#: Names of buttons by their code, as printed on most pads.
BUTTONS = {
    0x130: "A",
    0x131: "B",
    0x133: "X",
    0x134: "Y",
    0x136: "LB",
    0x137: "RB",
    0x138: "LT",
    0x139: "RT",
    0x13A: "BACK",
    0x13B: "START",
    0x13C: "GUIDE",
    0x13D: "LS",
    0x13E: "RS",
}
_TRIGGERS = {_LEFT_TRIGGER: "LT", _RIGHT_TRIGGER: "RT"}
#: Axis of the twist of each axis of the pad, and its sign: a stick pushed away is forward, pushed to the left is left.
_AXES = {
    _LEFT_Y: (0, -1.0),
    _LEFT_X: (1, -1.0),
    _RIGHT_Y: (2, -1.0),
    _HAT_X: (3, 1.0),
    _HAT_Y: (4, -1.0),
    _RIGHT_X: (5, -1.0),
}
#: Deflection from which a trigger counts as held.
_PULLED = 0.5
#: Most events that one reading handles: a pad sends some hundred a second.
_MOST_EVENTS = 1000


class InputEvent(Protocol):
    """An event of the kernel; evdev's class is one."""

    type: int
    code: int
    value: int


class EventSource(Protocol):
    """Where events come from; evdev's `InputDevice` is one."""

    def read_one(self) -> InputEvent | None:
        """The next event; None: there is none now."""

    def close(self) -> None:
        """Release it."""


@dataclass(frozen=True, slots=True)
class AxisRange:
    """Range of an axis of a pad.

    Attributes:
        low: lowest value.
        high: highest value.
    """

    low: int
    high: int

    def centred(self, value: int) -> float:
        """A value as a deflection from the centre, -1 to 1."""
        return float(np.clip(2.0 * (value - self.low) / (self.high - self.low) - 1.0, -1.0, 1.0))

    def pulled(self, value: int) -> float:
        """A value as a fraction of the way from the lowest, 0 to 1."""
        return float(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0))


class Gamepad(Sealed):
    """A gamepad: the left stick moves forward and to the left, the right one up and about z, the cross about x and y.

    Args:
        source: its events.
        ranges: of its axes, by their code.
        name: for people.
        dead_zone: deflections below this are none, 0 to 0.9.
    """

    name: Final[str]
    roles: Roles = Roles(dead_man="LB", gripper="A", quit="START")

    def __init__(
        self,
        source: EventSource,
        ranges: Mapping[int, AxisRange],
        *,
        name: str = "gamepad",
        dead_zone: float = DEAD_ZONE,
    ) -> None:
        self.name = name
        self._source = source
        self._ranges = {code: axis for code, axis in ranges.items() if axis.low < axis.high}
        self._zone = within(dead_zone, "dead_zone", 0.0, 0.9)
        self._axes = np.zeros(6)
        self._held: set[str] = set()
        self._closed = False

    def read(self) -> DeviceInput:
        """What is deflected and held now.

        Raises:
            NotReady: the pad is gone.
        """
        if self._closed:
            return REST
        try:
            for _ in range(_MOST_EVENTS):
                event = self._source.read_one()
                if event is None:
                    break
                self._note(event)
        except OSError as error:
            self._rest()
            raise gone(self.name, error) from error
        return DeviceInput.of(self._axes, self._held)

    def _note(self, event: InputEvent) -> None:
        if event.type == _SYNC and event.code == _DROPPED:
            self._rest()  # events were lost, a release perhaps: everything has to be pressed again
        elif event.type == _KEY and event.code in BUTTONS:
            if event.value:
                self._held.add(BUTTONS[event.code])
            else:
                self._held.discard(BUTTONS[event.code])
        elif event.type == _ABSOLUTE and event.code in self._ranges:
            limits = self._ranges[event.code]
            if event.code in _AXES:
                axis, sign = _AXES[event.code]
                self._axes[axis] = sign * without_dead_zone(limits.centred(event.value), self._zone)
            elif event.code in _TRIGGERS:
                change = self._held.add if limits.pulled(event.value) > _PULLED else self._held.discard
                change(_TRIGGERS[event.code])

    def _rest(self) -> None:
        self._axes[:] = 0.0
        self._held.clear()

    def close(self) -> None:
        """Release it; calling it again has no effect."""
        if not self._closed:
            self._closed = True
            self._source.close()

    def __enter__(self) -> Gamepad:
        """The pad itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Release it."""
        self.close()


def gamepad(path: str | Path | None = None, *, dead_zone: float = DEAD_ZONE) -> Gamepad:
    """Open a gamepad; Linux only, needs `pip install 'heptarm[devices]'`.

    Args:
        path: such as "/dev/input/event7"; None: the first gamepad.
        dead_zone: deflections of its sticks below this are none, 0 to 0.9.

    Raises:
        MissingExtra: evdev is not installed.
        NotReady: there is no gamepad, or it may not be read.
    """
    within(dead_zone, "dead_zone", 0.0, 0.9)
    if path is not None:
        instance(path, (str, Path), "path")
    refuse_windows("a gamepad as an input device")
    evdev: Any = require("evdev", extra="devices")
    device = _first(evdev) if path is None else _opened(evdev, str(path))
    capabilities = device.capabilities()
    if _GAMEPAD not in capabilities.get(_KEY, ()):
        device.close()
        raise CommandRejected(
            f"path must be a gamepad, {device.path} is {device.name!r}",
            parameter="path",
            value=str(path),
            hint="leave it out to open the first gamepad",
        )
    ranges = {code: AxisRange(info.min, info.max) for code, info in capabilities.get(_ABSOLUTE, ())}
    return Gamepad(device, ranges, name=str(device.name), dead_zone=dead_zone)


def _first(evdev: Any) -> Any:
    """The first device that is a gamepad."""
    for path in sorted(evdev.list_devices()):
        device = _opened(evdev, path)
        if _GAMEPAD in device.capabilities().get(_KEY, ()):
            return device
        device.close()
    raise NotReady(
        "no gamepad was found",
        hint="connect one; if one is connected, let this user read it: sudo usermod -aG input $USER, and log in again",
    )


def _opened(evdev: Any, path: str) -> Any:
    try:
        return evdev.InputDevice(path)
    except OSError as error:
        raise gone(f"gamepad {path}", error) from error
