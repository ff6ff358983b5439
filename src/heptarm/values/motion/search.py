"""Search patterns: where to look for a hole in a plane."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from heptarm.values.checks import Array, Value, within

#: Defaults of a spiral: distance between two turns [m] and speed along it [m/s].
PITCH = 4e-4
SPEED = 0.012
_WIDEST, _FASTEST = 0.1, 1.0
_MOST_POINTS = 900
#: Points of a spiral are at most so far apart: a fraction of a turn [rad].
_STEP = pi / 6


@dataclass(frozen=True, slots=True)
class Spiral(Value):
    """Archimedean spiral in a plane, from its centre outwards.

    Attributes:
        radius: of its last turn [m].
        pitch: distance between two turns [m].
        speed_mps: speed along it [m/s].
    """

    radius: float
    pitch: float = PITCH
    speed_mps: float = SPEED

    def __post_init__(self) -> None:
        radius = within(self.radius, "radius", 0.0, _WIDEST, above=True, unit="m")
        narrowest = 2.0 * pi * radius / (_STEP * _MOST_POINTS)
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "pitch", within(self.pitch, "pitch", narrowest, radius, unit="m"))
        speed = within(self.speed_mps, "speed_mps", 0.0, _FASTEST, above=True, unit="m/s")
        object.__setattr__(self, "speed_mps", speed)

    @property
    def length(self) -> float:
        """Length of its path [m], without the small part along the radius."""
        return pi * self.radius**2 / self.pitch

    @property
    def points(self) -> Array:
        """Points along it, shape (n, 2) [m]: r = pitch * angle / 2 pi, twelve in a turn."""
        last = 2.0 * pi * self.radius / self.pitch
        count = max(4, round(last / _STEP))
        angles = [last * turn / count for turn in range(1, count + 1)]
        return np.array([_at(angle, self.pitch) for angle in angles])


def spiral(radius: float, *, pitch: float = PITCH, speed_mps: float = SPEED) -> Spiral:
    """Search pattern: a spiral from its centre outwards.

    A part is found when it comes within its play of the hole, so `pitch` must be below twice the play of the part in
    the hole (the difference of the radii).

    Args:
        radius: of its last turn [m], up to 0.1: how far the hole may be from where it is looked for.
        pitch: distance between two turns [m].
        speed_mps: speed along it [m/s], up to 1.

    Raises:
        LimitError: a value outside its range, or more turns than a motion can have.
    """
    return Spiral(radius, pitch, speed_mps)


def _at(angle: float, pitch: float) -> tuple[float, float]:
    radius = pitch * angle / (2.0 * pi)
    return radius * cos(angle), radius * sin(angle)
