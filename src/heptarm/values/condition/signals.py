"""What conditions are made of: signals that compare to conditions.

::

    from heptarm.when import force, io, torque

    (force.along("z") > 15) | (abs(torque[3]) > 8) | io.user_button
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

from heptarm.errors import ShapeError
from heptarm.values.arguments import TOOL
from heptarm.values.condition import Condition, PathReached, SignalIs
from heptarm.values.force_condition import (
    FORCE,
    JOINT,
    TORQUE,
    ForceAbove,
    ForceOutside,
    JointTorqueOutside,
    NormalForceAbove,
    ShearForceAbove,
    TorqueOutside,
)


@dataclass(frozen=True, slots=True, eq=False)
class Magnitude:
    """A number that is never negative: `> threshold` makes a condition."""

    _above: Callable[[float], Condition]

    def __gt__(self, threshold: float) -> Condition:
        return self._above(threshold)

    def __lt__(self, threshold: float) -> Condition:
        return ~self._above(threshold)


@dataclass(frozen=True, slots=True, eq=False)
class Component:
    """A number with a sign: `>`, `<`, `abs(...) >`, `outside` and `inside` make conditions."""

    _band: Callable[[float, float], Condition]
    _limit: float

    def __gt__(self, bound: float) -> Condition:
        return self._band(-self._limit, bound)

    def __lt__(self, bound: float) -> Condition:
        return self._band(bound, self._limit)

    def __abs__(self) -> Magnitude:
        return Magnitude(lambda bound: self._band(-bound, bound))

    def outside(self, low: float, high: float) -> Condition:
        """It is outside [low, high]."""
        return self._band(low, high)

    def inside(self, low: float, high: float) -> Condition:
        """It is inside [low, high]."""
        return ~self._band(low, high)


@dataclass(frozen=True, slots=True, eq=False)
class Force:
    """The external force that the cabinet estimates at the moved frame [N]; `> threshold`: its magnitude.

    Attributes:
        frame: whose axes: "tool" (the moved frame's own), "flange" or "base".
        tolerance: largest inaccuracy of the estimate that is accepted [N]; NaN: any. A worse estimate, as near a
            singularity, counts as exceeding the threshold.
    """

    frame: str = TOOL
    tolerance: float = nan

    def __call__(self, *, frame: str = TOOL, tolerance: float = nan) -> Force:
        """The same force with other axes, or with a tolerance."""
        return Force(frame, tolerance)

    def __gt__(self, threshold: float) -> Condition:
        return ForceAbove(threshold, self.frame, self.tolerance)

    def __lt__(self, threshold: float) -> Condition:
        return ~ForceAbove(threshold, self.frame, self.tolerance)

    def along(self, axis: str) -> Component:
        """Its component along an axis, with sign."""
        return Component(lambda low, high: ForceOutside(axis, low, high, self.frame, self.tolerance), FORCE)

    def normal(self, axis: str) -> Magnitude:
        """How strong it is along an axis, in either direction."""
        return Magnitude(lambda threshold: NormalForceAbove(axis, threshold, self.frame, self.tolerance))

    def shear(self, axis: str) -> Magnitude:
        """How strong it is across an axis."""
        return Magnitude(lambda threshold: ShearForceAbove(axis, threshold, self.frame, self.tolerance))


@dataclass(frozen=True, slots=True, eq=False)
class Torque:
    """The external torque: `torque[3]` that of joint A4, `torque.about("z")` a component at the moved frame [Nm].

    Attributes:
        frame: whose axes `about` means; see `Force`.
        tolerance: see `Force`, of `about` [Nm].
    """

    frame: str = TOOL
    tolerance: float = nan

    def __call__(self, *, frame: str = TOOL, tolerance: float = nan) -> Torque:
        """The same torque with other axes, or with a tolerance."""
        return Torque(frame, tolerance)

    def __getitem__(self, joint: int) -> Component:
        """External torque of a joint, 0 for A1 to 6 for A7."""
        return Component(lambda low, high: JointTorqueOutside(joint, low, high), JOINT)

    def about(self, axis: str) -> Component:
        """Its component about an axis of the frame."""
        return Component(lambda low, high: TorqueOutside(axis, low, high, self.frame, self.tolerance), TORQUE)


class Io:
    """Signals of the cabinet by name: `io["MediaFlange.UserButton"]`, or `io.user_button` where that is unique."""

    __slots__ = ()

    def __getitem__(self, name: str) -> SignalIs:
        """A signal; as it is, a condition that it is true."""
        return SignalIs(name)

    def __getattr__(self, name: str) -> SignalIs:
        """A signal."""
        if name.startswith("_"):
            raise AttributeError(name)
        return SignalIs(name)


class Path:
    """Points on the path of a motion. On one in joint space they count along the way of the moved frame."""

    __slots__ = ()

    def after(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """So far after the start, and so long after (or, negative, before) that point."""
        return PathReached(metres, seconds)

    def before_end(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """So far before the destination, and so long before that point.

        Raises:
            ShapeError: negative seconds: after the end there is no motion.
        """
        if seconds < 0:
            raise ShapeError(f"seconds is {seconds:g}; it counts back from the end", parameter="seconds")
        return PathReached(-metres if metres else 0.0, -seconds if seconds else 0.0, from_start=False)


force = Force()
torque = Torque()
io = Io()
path = Path()
