"""What all motions have in common, and the motion that only holds.

Motions are frozen values that say where to move and how, to be reused and composed. They are checked when they are
made, against everything that does not need the robot; limits of the robot itself are checked when they are sent. What
is not given keeps the cabinet's default.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf
from typing import TypeVar

from heptarm.errors import ShapeError
from heptarm.values.checks import Value, within
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.trigger import Action, Trigger
from heptarm.values.robot import RobotModel
from heptarm.values.text import described

_Motion = TypeVar("_Motion", bound="Motion")
_Triggered = TypeVar("_Triggered", bound="Triggered")

#: Most triggers of a motion that the cabinet accepts.
MOST_TRIGGERS = 16
_LONGEST_HOLD = 1e6


class Motion(Value):
    """Base of motions: what `arm.move` and `arm.start` accept."""

    __slots__ = ()

    def __str__(self) -> str:
        """What is not the default, a line each."""
        return described(self, type(self).__name__)

    def limited_to(self: _Motion, speed: float) -> _Motion:
        """The same motion, no joint faster than a fraction of its maximum in (0, 1].

        A hold has no speed, and in hand guiding the person chooses it, within the limits of the motion itself.

        Raises:
            LimitError: the fraction is outside its range.
        """
        within(speed, "speed", 0.0, 1.0, above=True)
        return self

    def longest_duration(self, robot: RobotModel) -> float:
        """Slowest plausible estimate of its duration [s]; infinite: it ends only when it is cancelled."""
        return inf


@dataclass(frozen=True, slots=True, eq=False)
class Triggered(Motion):
    """Base of motions that may have triggers.

    Attributes:
        triggers: up to 16.
    """

    triggers: tuple[Trigger, ...] = field(default=(), kw_only=True)

    def trigger(self: _Triggered, condition: Condition, action: Action) -> _Triggered:
        """The same motion with one more trigger.

        Args:
            condition: when; see heptarm.when. Points of the path count from the ends of this motion.
            action: what the cabinet does then; see heptarm.do.

        Raises:
            ShapeError: no condition, no action, or one trigger too many.
        """
        if len(self.triggers) >= MOST_TRIGGERS:
            raise ShapeError(
                f"a motion has at most {MOST_TRIGGERS} triggers",
                code=3,
                parameter="triggers",
                allowed=f"[0, {MOST_TRIGGERS}]",
                hint="spread them over several motions",
            )
        return replace(self, triggers=(*self.triggers, Trigger(condition, action)))


def triggers_of(motion: Motion) -> tuple[Trigger, ...]:
    """The triggers of a motion; hand guiding has none."""
    return motion.triggers if isinstance(motion, Triggered) else ()


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

    def longest_duration(self, robot: RobotModel) -> float:
        """Its duration [s]."""
        return self.duration


def hold(seconds: float = inf) -> Hold:
    """Hold the position.

    Args:
        seconds: how long [s], up to 1e6; infinite: until it is cancelled.

    Raises:
        LimitError: not positive, or NaN.
    """
    return Hold(seconds)
