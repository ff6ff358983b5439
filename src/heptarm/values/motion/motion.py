"""Every kind of motion: frozen values that say where to move and how, to be reused and composed.

They are checked when they are made, against everything that does not need the robot; limits of the robot itself are
checked when they are sent. What is not given keeps the cabinet's default.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TypeAlias, get_args

from heptarm.values.arrays import within
from heptarm.values.condition.trigger import Triggered
from heptarm.values.motion.circle import Circ
from heptarm.values.motion.dynamics import DynamicMotion
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.line import Lin, LinRel
from heptarm.values.motion.ptp import Ptp, PtpHome, PtpPose
from heptarm.values.motion.spline import JointSpline, Spline

_LONGEST_HOLD = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class Hold(Triggered):
    """Hold the position.

    Attributes:
        duration: [s]; infinite: until it is cancelled.
    """

    duration: float = inf

    def __post_init__(self) -> None:
        if not (isinstance(self.duration, float) and self.duration == inf):
            object.__setattr__(
                self, "duration", within(self.duration, "seconds", 0.0, _LONGEST_HOLD, above=True, unit="s")
            )


Motion: TypeAlias = Ptp | PtpHome | PtpPose | Lin | LinRel | Circ | Spline | JointSpline | Hold | HandGuide
#: The same as classes, for isinstance.
MOTIONS: tuple[type, ...] = get_args(Motion)


def limited_to(motion: Motion, speed: float) -> Motion:
    """The same motion, no joint faster than a fraction of its maximum in (0, 1].

    A hold has no speed, and in hand guiding the person chooses it, within the limits of the motion itself.

    Raises:
        LimitError: the fraction is outside its range.
    """
    within(speed, "speed", 0.0, 1.0, above=True)
    return motion.limited_to(speed) if isinstance(motion, DynamicMotion) else motion


def hold(seconds: float = inf) -> Hold:
    """Hold the position.

    Args:
        seconds: how long [s], up to 1e6; infinite: until it is cancelled.

    Raises:
        LimitError: not positive, or NaN.
    """
    return Hold(seconds)
