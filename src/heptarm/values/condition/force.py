"""Conditions on the external forces and torques, and the names that users compare to make them.

::

    from heptarm.when import force, torque

    (force.along("z") > 15) | (abs(torque[3]) > 8)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import isnan, nan
from typing import ClassVar

import numpy as np

from heptarm.errors import LimitError
from heptarm.values.checks import shown, within, word
from heptarm.values.condition.condition import Condition, band_text, check_band
from heptarm.values.frames import TOOL, check_name
from heptarm.values.pose import Pose

#: Largest force [N], torque [Nm] and joint torque [Nm] of a threshold.
FORCE, TORQUE, JOINT = 1000.0, 1000.0, 500.0

_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True, eq=False)
class _Estimated(Condition):
    """Base of conditions on the cabinet's estimate of the external force and torque.

    Attributes:
        frame: the frame whose axes count, or its pose in the base; see `heptarm.when.force`.
        tolerance: largest inaccuracy of the estimate that is accepted [N], of a torque [Nm]; NaN: any.
    """

    UNIT: ClassVar[str] = "N"

    frame: str | Pose = field(default=TOOL, kw_only=True)
    tolerance: float = field(default=nan, kw_only=True)

    def __post_init__(self) -> None:
        self._check()
        _check_estimate(self.frame, self.tolerance, self.UNIT)

    def _check(self) -> None:
        """Check the fields of the subclass."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, eq=False)
class ForceAbove(_Estimated):
    """The external force's magnitude is above a threshold.

    Attributes:
        threshold: [N], up to 1000.
    """

    threshold: float

    def _check(self) -> None:
        within(self.threshold, "threshold", 0.0, FORCE, unit="N")

    def __str__(self) -> str:
        return f"force > {self.threshold:g} N"


@dataclass(frozen=True, slots=True, eq=False)
class _AxisAbove(_Estimated):
    """Base of thresholds for a part of the external force.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        threshold: [N], up to 1000.
    """

    PART: ClassVar[str]

    axis: str
    threshold: float

    def _check(self) -> None:
        within(self.threshold, "threshold", 0.0, FORCE, unit="N")
        _check_axis(self.axis)

    def __str__(self) -> str:
        return f"force {self.PART} {self.axis} of {_named(self.frame)} > {self.threshold:g} N"


@dataclass(frozen=True, slots=True, eq=False)
class NormalForceAbove(_AxisAbove):
    """The external force along an axis, in either direction, is above a threshold."""

    PART: ClassVar[str] = "normal to"


@dataclass(frozen=True, slots=True, eq=False)
class ShearForceAbove(_AxisAbove):
    """The external force across an axis is above a threshold."""

    PART: ClassVar[str] = "across"


@dataclass(frozen=True, slots=True, eq=False)
class _AxisOutside(_Estimated):
    """Base of bands for a component of the external force or torque.

    Attributes:
        axis: "x", "y" or "z" of the frame.
        low: [N] or [Nm], from -1000.
        high: [N] or [Nm], to 1000.
    """

    COMPONENT: ClassVar[str]
    LIMIT: ClassVar[float]

    axis: str
    low: float
    high: float

    def _check(self) -> None:
        check_band(self.low, self.high, self.LIMIT, self.UNIT)
        _check_axis(self.axis)

    def __str__(self) -> str:
        band = band_text(self.low, self.high, self.LIMIT, self.UNIT)
        return f"{self.COMPONENT} {self.axis} of {_named(self.frame)} {band}"


@dataclass(frozen=True, slots=True, eq=False)
class ForceOutside(_AxisOutside):
    """A component of the external force is outside a band [N]."""

    COMPONENT: ClassVar[str] = "force along"
    LIMIT: ClassVar[float] = FORCE


@dataclass(frozen=True, slots=True, eq=False)
class TorqueOutside(_AxisOutside):
    """A component of the external torque at the motion frame is outside a band [Nm]."""

    COMPONENT: ClassVar[str] = "torque about"
    LIMIT: ClassVar[float] = TORQUE
    UNIT: ClassVar[str] = "Nm"


def _check_axis(axis: str) -> None:
    """Refuse what is no axis. Raises ShapeError."""
    word(axis, "axis", _AXES)


def _check_joint(joint: int) -> None:
    """Refuse what is no joint, 0 for A1 to 6 for A7. Raises LimitError."""
    if not isinstance(joint, int) or isinstance(joint, bool) or not 0 <= joint <= 6:
        raise LimitError(
            f"joint must be 0 (A1) to 6 (A7), got {shown(joint)}",
            code=2,
            parameter="joint",
            value=joint,
            allowed="[0, 6]",
        )


def _named(frame: str | Pose) -> str:
    """A frame in a text: its name, or how its axes are turned."""
    if isinstance(frame, str):
        return frame
    return "axes at a {:.4g} b {:.4g} c {:.4g} deg".format(*np.degrees(frame.abc).tolist())


def _check_estimate(frame: str | Pose, tolerance: float, unit: str) -> None:
    """Refuse what is no frame, or no tolerance of an estimate."""
    if not isinstance(frame, Pose):
        check_name(frame, "frame", hint='for example "tool" or "base", or the pose of any frame in the base')
    if not (isinstance(tolerance, float) and isnan(tolerance)):
        within(tolerance, "tolerance", 0.0, FORCE, above=True, unit=unit)


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
        _check_joint(self.joint)
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
        frame: the frame whose axes count: "tool" (the motion frame), "flange", "base", the name of a frame, or the
            pose of any frame in the base; the force stays the one at the motion frame.
        tolerance: largest inaccuracy of the estimate that is accepted [N]; NaN: any. A worse estimate, as near a
            singularity, counts as above the threshold.
    """

    frame: str | Pose = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        _check_estimate(self.frame, self.tolerance, "N")

    def __call__(self, *, frame: str | Pose = TOOL, tolerance: float = nan) -> Force:
        """The same force with other axes, or with a tolerance."""
        return Force(frame, tolerance)

    def __gt__(self, threshold: float) -> Condition:
        return ForceAbove(threshold, frame=self.frame, tolerance=self.tolerance)

    def __lt__(self, threshold: float) -> Condition:
        return ~ForceAbove(threshold, frame=self.frame, tolerance=self.tolerance)

    def along(self, axis: str) -> Component:
        """Its component along an axis, with sign."""
        _check_axis(axis)
        return Component(
            lambda low, high: ForceOutside(axis, low, high, frame=self.frame, tolerance=self.tolerance), FORCE
        )

    def normal(self, axis: str) -> Magnitude:
        """Its magnitude along an axis, in either direction."""
        _check_axis(axis)
        return Magnitude(
            lambda threshold: NormalForceAbove(axis, threshold, frame=self.frame, tolerance=self.tolerance)
        )

    def shear(self, axis: str) -> Magnitude:
        """Its magnitude across an axis."""
        _check_axis(axis)
        return Magnitude(
            lambda threshold: ShearForceAbove(axis, threshold, frame=self.frame, tolerance=self.tolerance)
        )


@dataclass(frozen=True, slots=True, eq=False)
class Torque:
    """The external torque: `torque[3]` that of joint A4, `torque.about("z")` a component at the motion frame [Nm].

    Attributes:
        frame: the frame whose axes `about` refers to; see `Force`.
        tolerance: see `Force`; for `about` [Nm].
    """

    frame: str | Pose = TOOL
    tolerance: float = nan

    def __post_init__(self) -> None:
        _check_estimate(self.frame, self.tolerance, "Nm")

    def __call__(self, *, frame: str | Pose = TOOL, tolerance: float = nan) -> Torque:
        """The same torque with other axes, or with a tolerance."""
        return Torque(frame, tolerance)

    def __getitem__(self, joint: int) -> Component:
        """External torque of a joint, 0 for A1 to 6 for A7."""
        _check_joint(joint)
        return Component(lambda low, high: JointTorqueOutside(joint, low, high), JOINT)

    def about(self, axis: str) -> Component:
        """Its component about an axis of the frame."""
        _check_axis(axis)
        return Component(
            lambda low, high: TorqueOutside(axis, low, high, frame=self.frame, tolerance=self.tolerance),
            TORQUE,
        )


force = Force()
torque = Torque()
