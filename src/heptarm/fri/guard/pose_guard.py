"""Limits of the pose guard, and its report; the guard itself is native/fri_guard.c."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from heptarm.fri.guard.joint_guard import positive

#: Parts of a pose that are limited separately, as the report names them.
PARTS = ("flange", "rotation", "elbow")


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


class PoseReport:
    """Counts and extremes of what a pose guard has limited.

    Attributes:
        counts: cycles, by `PoseLimited` and part, shape [4][3].
        worst: largest requested magnitude, by `PoseLimited` and part.
        allowed: largest magnitude allowed at that time.
    """

    __slots__ = ("allowed", "counts", "worst")

    def __init__(self) -> None:
        self.counts = [[0] * len(PARTS) for _ in PoseLimited]
        self.worst = [[0.0] * len(PARTS) for _ in PoseLimited]
        self.allowed = [[0.0] * len(PARTS) for _ in PoseLimited]

    def add(self, kind: int, part: int, asked: float, allowed: float) -> None:
        """Count a part that was limited in one cycle."""
        self.counts[kind][part] += 1
        if asked >= self.worst[kind][part]:
            self.worst[kind][part], self.allowed[kind][part] = asked, allowed

    @property
    def lines(self) -> list[str]:
        """One line of text for each quantity and part that was limited."""
        found = []
        for kind in PoseLimited:
            for part, count in enumerate(self.counts[kind]):
                if not count:
                    continue
                where, cycles = PARTS[part], f"{count} cycle{'s' * (count != 1)}"
                if kind is PoseLimited.NOT_FINITE:
                    found.append(f"{where}: target not finite in {cycles}; the last one was kept")
                    continue
                unit = _UNITS[part][kind]
                found.append(
                    f"{where}: {kind.name.lower()} limited in {cycles}: "
                    f"{self.worst[kind][part]:.4g} {unit} requested, {self.allowed[kind][part]:.4g} allowed"
                )
        return found
