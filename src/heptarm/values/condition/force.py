"""Conditions on the external forces and torques."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

from heptarm.errors import LimitError
from heptarm.values.arrays import shown, within, word
from heptarm.values.condition.condition import Condition, band_text, check_band
from heptarm.values.frames import TOOL, check_name

#: Largest force [N], torque [Nm] and joint torque [Nm] of a threshold.
FORCE, TORQUE, JOINT = 1000.0, 1000.0, 500.0

_AXES = ("x", "y", "z")


def check_axis(axis: str) -> None:
    """Refuse what is no axis. Raises ShapeError."""
    word(axis, "axis", _AXES)


def check_joint(joint: int) -> None:
    """Refuse what is no joint, 0 for A1 to 6 for A7.

    Raises:
        LimitError: it is none.
    """
    if not isinstance(joint, int) or isinstance(joint, bool) or not 0 <= joint <= 6:
        raise LimitError(
            f"joint must be 0 (A1) to 6 (A7), got {shown(joint)}",
            code=2,
            parameter="joint",
            value=joint,
            allowed="[0, 6]",
        )


def check_estimate(frame: str, tolerance: float, unit: str) -> None:
    """Refuse what is no frame or no tolerance of an estimate."""
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
        check_estimate(self.frame, self.tolerance, "N")

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
        check_axis(self.axis)
        check_estimate(self.frame, self.tolerance, "N")

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
        check_axis(self.axis)
        check_estimate(self.frame, self.tolerance, "N")

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
        check_axis(self.axis)
        check_estimate(self.frame, self.tolerance, "N")

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
        check_axis(self.axis)
        check_estimate(self.frame, self.tolerance, "Nm")

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
        check_joint(self.joint)
        check_band(self.low, self.high, JOINT, "Nm")

    def __str__(self) -> str:
        return f"external torque of A{self.joint + 1} {band_text(self.low, self.high, JOINT, 'Nm')}"
