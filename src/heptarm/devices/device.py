"""What every input device offers: deflections, held buttons, and what its buttons are for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from heptarm.errors import HeptarmError, NotReady, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, shown

#: Deflections below this are none, since sticks do not return exactly to their centre.
DEAD_ZONE = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class DeviceInput(Value):
    """What a device reports.

    Attributes:
        twist: deflections x forward, y left, z up, and about x y z by the right-hand rule, shape (6,); each is clipped
            to [-1, 1].
        buttons: names of the buttons that are held.

    Raises:
        ShapeError: not six numbers, or no names.
        LimitError: a number that is not finite.
    """

    twist: Array
    buttons: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        buttons: object = self.buttons
        if isinstance(buttons, str) or not isinstance(buttons, Iterable):
            raise ShapeError(
                f"buttons must be a list of names, got {shown(buttons)}", parameter="buttons", value=buttons
            )
        object.__setattr__(self, "twist", frozen(np.clip(array(self.twist, 6, "twist"), -1.0, 1.0)))
        object.__setattr__(self, "buttons", frozenset(buttons))

    @staticmethod
    def of(twist: npt.ArrayLike, buttons: Iterable[str] = ()) -> DeviceInput:
        """An input from six numbers and names of buttons in any kind of list; raises as the class does."""
        return DeviceInput(twist, buttons)  # type: ignore[arg-type]


#: A device that nobody touches.
REST = DeviceInput.of([0.0] * 6)


@dataclass(frozen=True, slots=True)
class Roles:
    """What the buttons of a device are for, by their names; "": it has none for this.

    Attributes:
        dead_man: the arm moves only while it is held.
        gripper: opens and closes the gripper.
        quit: ends jogging.
    """

    dead_man: str = ""
    gripper: str = ""
    quit: str = ""


class InputDevice(Protocol):
    """What skills and programs need of a device; your own class may be one."""

    @property
    def name(self) -> str:
        """For people."""

    @property
    def roles(self) -> Roles:
        """What its buttons are for, unless the program names others."""

    def read(self) -> DeviceInput:
        """What it reports now; does not wait.

        Raises:
            NotReady: it is gone.
        """

    def close(self) -> None:
        """Release it; calling it again has no effect."""


def without_dead_zone(value: float, zone: float = DEAD_ZONE) -> float:
    """A deflection in [-1, 1] that is 0 within the dead zone and rises from there without a step."""
    size = min(abs(value), 1.0)
    return 0.0 if size <= zone else float(np.copysign((size - zone) / (1.0 - zone), value))


def gone(what: str, error: OSError) -> HeptarmError:
    """The error of a device that cannot be read any more."""
    return NotReady(
        f"the {what} cannot be read: {error.strerror or error}",
        hint="check its cable or battery, and open it again",
    )
