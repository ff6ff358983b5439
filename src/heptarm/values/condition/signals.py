"""The names that users compare to make conditions.

::

    from heptarm.when import force, io, torque

    (force.along("z") > 15) | (abs(torque[3]) > 8) | io.user_button
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

from heptarm.errors import ShapeError
from heptarm.values.arrays import finite
from heptarm.values.condition.condition import Condition, PathReached, SignalIs
from heptarm.values.condition.force import (
    FORCE,
    JOINT,
    TORQUE,
    ForceAbove,
    ForceOutside,
    JointTorqueOutside,
    NormalForceAbove,
    ShearForceAbove,
    TorqueOutside,
    check_axis,
    check_estimate,
    check_joint,
)
from heptarm.values.frames import TOOL


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
    """External force that the cabinet estimates at the motion frame [N]; `> threshold` compares its magnitude.

    Attributes:
        frame: the frame whose axes count: "tool" (the motion frame), "flange" or "base".
        tolerance: largest inaccuracy of the estimate that is accepted [N]; NaN: any. A worse estimate, as near a
            singularity, counts as above the threshold.
    """

    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        check_estimate(self.frame, self.tolerance, "N")

    def __call__(self, *, frame: str = TOOL, tolerance: float = nan) -> Force:
        """The same force with other axes, or with a tolerance."""
        return Force(frame, tolerance)

    def __gt__(self, threshold: float) -> Condition:
        return ForceAbove(threshold, self.frame, self.tolerance)

    def __lt__(self, threshold: float) -> Condition:
        return ~ForceAbove(threshold, self.frame, self.tolerance)

    def along(self, axis: str) -> Component:
        """Its component along an axis, with sign."""
        check_axis(axis)
        return Component(lambda low, high: ForceOutside(axis, low, high, self.frame, self.tolerance), FORCE)

    def normal(self, axis: str) -> Magnitude:
        """Its magnitude along an axis, in either direction."""
        check_axis(axis)
        return Magnitude(lambda threshold: NormalForceAbove(axis, threshold, self.frame, self.tolerance))

    def shear(self, axis: str) -> Magnitude:
        """Its magnitude across an axis."""
        check_axis(axis)
        return Magnitude(lambda threshold: ShearForceAbove(axis, threshold, self.frame, self.tolerance))


@dataclass(frozen=True, slots=True, eq=False)
class Torque:
    """The external torque: `torque[3]` that of joint A4, `torque.about("z")` a component at the motion frame [Nm].

    Attributes:
        frame: the frame whose axes `about` refers to; see `Force`.
        tolerance: see `Force`; for `about` [Nm].
    """

    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        check_estimate(self.frame, self.tolerance, "Nm")

    def __call__(self, *, frame: str = TOOL, tolerance: float = nan) -> Torque:
        """The same torque with other axes, or with a tolerance."""
        return Torque(frame, tolerance)

    def __getitem__(self, joint: int) -> Component:
        """External torque of a joint, 0 for A1 to 6 for A7."""
        check_joint(joint)
        return Component(lambda low, high: JointTorqueOutside(joint, low, high), JOINT)

    def about(self, axis: str) -> Component:
        """Its component about an axis of the frame."""
        check_axis(axis)
        return Component(lambda low, high: TorqueOutside(axis, low, high, self.frame, self.tolerance), TORQUE)


class IoSignals:
    """Signals of the cabinet by name: `io["MediaFlange.UserButton"]`, or `io.user_button` where that is unique."""

    __slots__ = ()

    def __getitem__(self, name: str) -> SignalIs:
        """A signal; by itself a condition that it is true."""
        return SignalIs(name)

    def __getattr__(self, name: str) -> SignalIs:
        """A signal."""
        if name.startswith("_"):
            raise AttributeError(name)
        return SignalIs(name)


class Path:
    """Points on the path of a motion; in joint space the path of the motion frame counts."""

    __slots__ = ()

    def after(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """A distance after the start, and a time after (or, negative, before) that point."""
        return PathReached(metres, seconds)

    def before_end(self, metres: float = 0.0, *, seconds: float = 0.0) -> Condition:
        """A distance before the destination, and a time before that point.

        Raises:
            ShapeError: negative seconds: after the end there is no motion.
        """
        finite(metres, "metres", unit="m")
        if finite(seconds, "seconds", unit="s") < 0:
            raise ShapeError(
                f"seconds must not be negative before the end, got {seconds:g} s",
                parameter="seconds",
                value=seconds,
                hint="it counts back from the end",
            )
        return PathReached(-metres if metres else 0.0, -seconds if seconds else 0.0, "destination")


force = Force()
torque = Torque()
io = IoSignals()
path = Path()
