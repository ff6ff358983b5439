"""Conditions on the external forces and torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isnan, nan
from typing import ClassVar

from heptarm.errors import LimitError, ShapeError
from heptarm.values.arrays import within
from heptarm.values.condition.condition import Condition, band_text, check_band
from heptarm.values.frames import TOOL, check_name

#: Largest force [N], torque [Nm] and joint torque [Nm] of a threshold.
FORCE, TORQUE, JOINT = 1000.0, 1000.0, 500.0

_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True, eq=False)
class _Estimated(Condition):
    """Base of conditions on the cabinet's estimate of the external force and torque.

    Attributes:
        frame: where it is measured and in whose axes; see `heptarm.when.force`.
        tolerance: largest inaccuracy of the estimate that is accepted [N], of a torque [Nm]; NaN: any.
    """

    UNIT: ClassVar[str] = "N"

    frame: str = field(default=TOOL, kw_only=True)
    tolerance: float = field(default=nan, kw_only=True)

    def __post_init__(self) -> None:
        self._check()
        check_name(self.frame, "frame")
        if not (isinstance(self.tolerance, float) and isnan(self.tolerance)):
            within(self.tolerance, "tolerance", 0.0, FORCE, above=True, unit=self.UNIT)

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
        return f"force {self.PART} {self.axis} of {self.frame} > {self.threshold:g} N"


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
        return f"{self.COMPONENT} {self.axis} of {self.frame} {band}"


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
    if axis not in _AXES:
        raise ShapeError(f"axis must be 'x', 'y' or 'z', got {axis!r}", parameter="axis", value=axis)


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
