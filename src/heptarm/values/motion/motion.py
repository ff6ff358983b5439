"""Motions: frozen values that say where to go and how, to be reused and composed.

They are checked when they are made, against everything that does not need the robot; limits of the robot
itself are checked when they are sent. What is not given keeps the cabinet's default.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TypeAlias

from heptarm.values.arguments import TOOL
from heptarm.values.arrays import within
from heptarm.values.circ import Circ, arc, circ
from heptarm.values.guiding import HandGuide, hand_guide
from heptarm.values.lines import Lin, LinRel, lin, lin_rel
from heptarm.values.ptp import Ptp, PtpHome, PtpPose, ptp, ptp_home
from heptarm.values.spline import JointSpline, Spl, Spline, ellipse, spl, spline, spline_joints
from heptarm.values.trigger import Triggered

__all__ = [
    "BASE",
    "TOOL",
    "Circ",
    "HandGuide",
    "Hold",
    "JointSpline",
    "Lin",
    "LinRel",
    "Motion",
    "Ptp",
    "PtpHome",
    "PtpPose",
    "Spl",
    "Spline",
    "arc",
    "circ",
    "ellipse",
    "hand_guide",
    "hold",
    "lin",
    "lin_rel",
    "ptp",
    "ptp_home",
    "spl",
    "spline",
    "spline_joints",
]

#: The robot's base frame.
BASE = "base"

_LONGEST_HOLD = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class Hold(Triggered):
    """Holds the position.

    Attributes:
        duration: [s]; infinite: until it is cancelled.
    """

    duration: float = inf

    def __post_init__(self) -> None:
        if self.duration != inf:
            object.__setattr__(
                self, "duration", within(self.duration, "seconds", 0.0, _LONGEST_HOLD, above=True, unit="s")
            )

    def under(self, ceiling: float) -> Hold:
        """The same: a hold has no speed."""
        within(ceiling, "speed", 0.0, 1.0, above=True)
        return self


Motion: TypeAlias = Ptp | PtpHome | PtpPose | Lin | LinRel | Circ | Spline | JointSpline | Hold | HandGuide


def hold(seconds: float = inf) -> Hold:
    """Hold the position.

    Args:
        seconds: how long [s], up to 1e6; infinite: until it is cancelled.

    Raises:
        LimitError: not positive, or NaN.
    """
    return Hold(seconds)
