"""Limits of the pose guard, and its report; the guard itself is native/fri_guard.c."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from heptarm.fri.guard.joint_guard import positive
from heptarm.fri.guard.report import GuardReport

#: Parts of a pose that are limited separately, as the report names them.
PARTS = ("flange", "rotation", "elbow")
#: Smallest norm of a quaternion that defines a rotation; for `schema/native.py`, as the next.
SMALLEST_NORM = 1e-3
#: Largest coordinate of a target [m].
LARGEST_COORDINATE = 1e3


class PoseLimited(enum.IntEnum):
    """Quantity that the guard limited."""

    NOT_FINITE = 0
    REACH = 1
    VELOCITY = 2
    ACCELERATION = 3


_ANGLES = ("", "rad", "rad/s", "rad/s²")
_UNITS = (("", "m", "m/s", "m/s²"), _ANGLES, _ANGLES)
#: Unit of each limit, for errors.
_LIMIT_UNITS = {
    "velocity": "m/s",
    "acceleration": "m/s²",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s²",
    "elbow_velocity": "rad/s",
    "elbow_acceleration": "rad/s²",
    "reach": "m",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseLimits:
    """Limits of the pose guard; the cabinet itself monitors the limits of the axes.

    Attributes:
        velocity: of the flange [m/s].
        acceleration: of the flange [m/s²].
        angular_velocity: of its rotation [rad/s].
        angular_acceleration: of its rotation [rad/s²].
        elbow_velocity: of the redundancy angle [rad/s].
        elbow_acceleration: of the redundancy angle [rad/s²].
        reach: largest distance of a target from the interpolator [m].

    Raises:
        LimitError: a limit is not positive.
    """

    velocity: float = 0.25
    acceleration: float = 1.0
    angular_velocity: float = 1.0
    angular_acceleration: float = 4.0
    elbow_velocity: float = 0.5
    elbow_acceleration: float = 2.0
    reach: float = math.inf

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            positive(getattr(self, name), name, _LIMIT_UNITS[name])


class PoseReport(GuardReport):
    """What a pose guard has limited, by `PoseLimited` and part, shape [4][3]."""

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__(PoseLimited, len(PARTS))

    def _named(self, kind: int, part: int) -> tuple[str, str]:
        return PARTS[part], _UNITS[part][kind]
