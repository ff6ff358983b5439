"""How fast a motion may be, and how early it may turn into its follower."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import nan

import numpy as np

from heptarm.values.arrays import Array, Value, fractions, frozen, within

_OPEN = frozen(np.full(7, nan))


def _open() -> Array:
    return _OPEN


@dataclass(frozen=True, slots=True, eq=False)
class JointDynamics(Value):
    """Fractions of each axis' maximum in (0, 1]; NaN keeps the cabinet's default, which is 1.

    Attributes:
        velocity: shape (7,).
        acceleration: shape (7,).
        jerk: shape (7,).

    Raises:
        ShapeError: neither one number nor seven.
        LimitError: one is outside (0, 1]; the text names the axis.
    """

    velocity: Array = field(default_factory=_open)
    acceleration: Array = field(default_factory=_open)
    jerk: Array = field(default_factory=_open)

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk"):
            value = getattr(self, name)
            object.__setattr__(self, name, value if value is _OPEN else fractions(value, name, nan=True))

    def under(self, ceiling: float) -> JointDynamics:
        """The same with no axis faster than `ceiling`, a fraction in (0, 1]; it can only slow down."""
        ceiling = within(ceiling, "speed", 0.0, 1.0, above=True)
        return self if ceiling == 1.0 else replace(self, velocity=np.fmin(self.velocity, ceiling))


@dataclass(frozen=True, slots=True, eq=False)
class CartesianDynamics(Value):
    """Limits along a Cartesian path; NaN keeps the cabinet's default.

    Attributes:
        velocity: [m/s], up to 10.
        acceleration: [m/s²], up to 100.
        jerk: [m/s³], up to 10 000.
        orientation_velocity: [rad/s], up to 20.
        orientation_acceleration: [rad/s²], up to 200.
        orientation_jerk: [rad/s³], up to 20 000.

    Raises:
        LimitError: one is outside its range.
    """

    velocity: float = nan
    acceleration: float = nan
    jerk: float = nan
    orientation_velocity: float = nan
    orientation_acceleration: float = nan
    orientation_jerk: float = nan

    def __post_init__(self) -> None:
        for name, (high, unit) in _CARTESIAN.items():
            value = getattr(self, name)
            if value == value:  # not NaN
                object.__setattr__(self, name, within(value, name, 0.0, high, above=True, unit=unit))


_CARTESIAN = {
    "velocity": (10.0, "m/s"),
    "acceleration": (100.0, "m/s²"),
    "jerk": (1e4, "m/s³"),
    "orientation_velocity": (20.0, "rad/s"),
    "orientation_acceleration": (200.0, "rad/s²"),
    "orientation_jerk": (2e4, "rad/s³"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Blending(Value):
    """Where a motion may begin to turn into its follower; all 0: it ends in an exact stop.

    Attributes:
        relative: fraction of the path, [0, 1].
        distance: from the end of the path [m], up to 2.
        orientation: from the end of the rotation [rad], up to 6.3.

    Raises:
        LimitError: one is outside its range.
    """

    relative: float = 0.0
    distance: float = 0.0
    orientation: float = 0.0

    def __post_init__(self) -> None:
        for name, high, unit in (("relative", 1.0, ""), ("distance", 2.0, "m"), ("orientation", 6.3, "rad")):
            object.__setattr__(self, name, within(getattr(self, name), name, 0.0, high, unit=unit))
