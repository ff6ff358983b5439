"""Conditions on the external forces and torques, and the names that users compare to make them.

::

    from heptarm.when import force, torque

    (force.along("z") > 15) | (abs(torque[3]) > 8)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan, nan

from heptarm.errors import LimitError, ShapeError
from heptarm.values.arrays import within
from heptarm.values.condition.condition import Condition, band_text, check_band
from heptarm.values.frames import TOOL, check_name

#: Largest force [N], torque [Nm] and joint torque [Nm] of a threshold.
FORCE, TORQUE, JOINT = 1000.0, 1000.0, 500.0

_AXES = ("x", "y", "z")


def _check_estimate(axis: str | None, frame: str, tolerance: float, unit: str) -> None:
    if axis is not None and axis not in _AXES:
        raise ShapeError(f"axis must be 'x', 'y' or 'z', got {axis!r}", parameter="axis", value=axis)
    check_name(frame, "frame")
    if not (isinstance(tolerance, float) and isnan(tolerance)):
        within(tolerance, "tolerance", 0.0, FORCE, above=True, unit=unit)


@dataclass(frozen=True, slots=True, eq=False)
class ForceAbove(Condition):
    """The external force's magnitude is above a threshold.

    Attributes:
        threshold: [N], up to 1000.
        frame: where it is measured and in whose axes; see `heptarm.when.force`.
        tolerance: largest inaccuracy of the estimate that is accepted [N]; NaN: any.
    """

    threshold: float
    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        within(self.threshold, "threshold", 0.0, FORCE, unit="N")
        _check_estimate(None, self.frame, self.tolerance, "N")

    def __str__(self) -> str:
        return f"force > {self.threshold:g} N"


@dataclass(frozen=True, slots=True, eq=False)
class NormalForceAbove(Condition):
    """The external force along an axis, in either direction, is above a threshold; see `ForceAbove`.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        threshold: [N].
        frame: see `ForceAbove`.
        tolerance: see `ForceAbove`.
    """

    axis: str
    threshold: float
    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        within(self.threshold, "threshold", 0.0, FORCE, unit="N")
        _check_estimate(self.axis, self.frame, self.tolerance, "N")

    def __str__(self) -> str:
        return f"force normal to {self.axis} of {self.frame} > {self.threshold:g} N"


@dataclass(frozen=True, slots=True, eq=False)
class ShearForceAbove(Condition):
    """The external force across an axis is above a threshold; see `NormalForceAbove`.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        threshold: [N].
        frame: see `ForceAbove`.
        tolerance: see `ForceAbove`.
    """

    axis: str
    threshold: float
    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        within(self.threshold, "threshold", 0.0, FORCE, unit="N")
        _check_estimate(self.axis, self.frame, self.tolerance, "N")

    def __str__(self) -> str:
        return f"force across {self.axis} of {self.frame} > {self.threshold:g} N"


@dataclass(frozen=True, slots=True, eq=False)
class ForceOutside(Condition):
    """A component of the external force is outside a band.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        low: [N], from -1000.
        high: [N], to 1000.
        frame: see `ForceAbove`.
        tolerance: see `ForceAbove`.
    """

    axis: str
    low: float
    high: float
    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        check_band(self.low, self.high, FORCE, "N")
        _check_estimate(self.axis, self.frame, self.tolerance, "N")

    def __str__(self) -> str:
        return f"force along {self.axis} of {self.frame} {band_text(self.low, self.high, FORCE, 'N')}"


@dataclass(frozen=True, slots=True, eq=False)
class TorqueOutside(Condition):
    """A component of the external torque at the motion frame is outside a band.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        low: [Nm], from -1000.
        high: [Nm], to 1000.
        frame: see `ForceAbove`.
        tolerance: see `ForceAbove` [Nm].
    """

    axis: str
    low: float
    high: float
    frame: str = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        check_band(self.low, self.high, TORQUE, "Nm")
        _check_estimate(self.axis, self.frame, self.tolerance, "Nm")

    def __str__(self) -> str:
        return f"torque about {self.axis} of {self.frame} {band_text(self.low, self.high, TORQUE, 'Nm')}"


@dataclass(frozen=True, slots=True, eq=False)
class JointTorqueOutside(Condition):
    """The external torque of a joint is outside a band.

    Attributes:
        joint: 0 for A1 to 6 for A7.
        low: [Nm], from -500.
        high: [Nm], to 500.
    """

    joint: int
    low: float
    high: float

    def __post_init__(self) -> None:
        if not isinstance(self.joint, int) or isinstance(self.joint, bool) or not 0 <= self.joint <= 6:
            raise LimitError(
                f"joint must be 0 (A1) to 6 (A7), got {self.joint!r}",
                code=2,
                parameter="joint",
                value=self.joint,
                allowed="[0, 6]",
            )
        check_band(self.low, self.high, JOINT, "Nm")

    def __str__(self) -> str:
        return f"external torque of A{self.joint + 1} {band_text(self.low, self.high, JOINT, 'Nm')}"


# ------------------------------------------------------------------------------------------------ expressions


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
        """Its magnitude along an axis, in either direction."""
        return Magnitude(lambda threshold: NormalForceAbove(axis, threshold, self.frame, self.tolerance))

    def shear(self, axis: str) -> Magnitude:
        """Its magnitude across an axis."""
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

    def __call__(self, *, frame: str = TOOL, tolerance: float = nan) -> Torque:
        """The same torque with other axes, or with a tolerance."""
        return Torque(frame, tolerance)

    def __getitem__(self, joint: int) -> Component:
        """External torque of a joint, 0 for A1 to 6 for A7."""
        return Component(lambda low, high: JointTorqueOutside(joint, low, high), JOINT)

    def about(self, axis: str) -> Component:
        """Its component about an axis of the frame."""
        return Component(lambda low, high: TorqueOutside(axis, low, high, self.frame, self.tolerance), TORQUE)


force = Force()
torque = Torque()
