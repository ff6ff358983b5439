"""Contacts: where the arm touched something, and with what force."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.checks import Array, Value, array, frozen, shown
from heptarm.values.pose import Pose
from heptarm.values.result import Result
from heptarm.values.text import degrees, fixed, lines

_AXES = {
    sign + name: tuple((-1.0 if sign == "-" else 1.0) * (i == k) for k in range(3))
    for sign in ("", "+", "-")
    for i, name in enumerate("xyz")
}


def direction_of(value: str | npt.ArrayLike) -> Array:
    """A unit vector, shape (3,), from the name of an axis such as "z" or "-x", or from a vector.

    Raises:
        ShapeError: it is neither, or has no length.
    """
    if isinstance(value, str):
        if value not in _AXES:
            raise ShapeError(
                f"direction must be 'x', '-x', 'y', '-y', 'z', '-z' or a vector, got {shown(value)}",
                parameter="direction",
                value=value,
            )
        return frozen(_AXES[value])
    vector = array(value, 3, "direction")
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise ShapeError(
            f"direction must not be the zero vector, got {shown(value)}", parameter="direction", value=value
        )
    return frozen(vector / length)


def axis_of(name: str) -> Array:
    """A unit vector along an axis, shape (3,), from its name such as "z" or "-x".

    Raises:
        ShapeError: it is no such name.
    """
    if not isinstance(name, str):
        raise ShapeError(
            f"direction must be the name of an axis such as 'z' or '-x', got {shown(name)}",
            parameter="direction",
            value=name,
        )
    return direction_of(name)


@dataclass(frozen=True, slots=True, eq=False)
class Contact(Value):
    """A contact of the arm with something.

    Attributes:
        pose: of the motion frame in the base when the force was detected, before the arm braked.
        force: force on the robot at that moment minus the force before, base axes, shape (3,) [N].
        travel: distance from the start to the contact [m].
        q: joint positions at the contact, shape (7,) [rad].
        result: how the motion towards it ended.
        first: the first, fast contact of a double touch.
    """

    pose: Pose
    force: Array
    travel: float
    q: Array
    result: Result
    first: Contact | None = None

    def __str__(self) -> str:
        """A few lines: where it was, and how strong."""
        rows = {
            "pose": str(self.pose),
            "force": f"{' '.join(fixed(component, 2) for component in self.force)} N",
            "travel": f"{fixed(self.travel * 1e3, 2)} mm",
            "joints": degrees(self.q),
            "spread": ""
            if self.first is None
            else f"{fixed(self.spread * 1e3, 3)} mm from the first contact",
        }
        return lines("Contact", rows)

    @property
    def spread(self) -> float:
        """Distance between the two contacts of a double touch [m]; NaN for a single one."""
        return nan if self.first is None else self.first.pose.distance_to(self.pose)
