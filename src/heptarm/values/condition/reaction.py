"""Reactions: what the arm does when a break condition has ended a motion and it has braked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, cast, get_args

from heptarm.errors import ShapeError
from heptarm.values.checks import Value, shown, within

#: Longest retreat [m].
FARTHEST = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Retreat(Value):
    """Move back along the joint positions that the arm has passed, in the control mode of the motion.

    Attributes:
        distance: of the motion frame, from where the arm has braked, (0, 0.5] [m]; at most to the start of the motion.
        speed: fraction of each axis' maximum, (0, 1].

    Raises:
        LimitError: a value outside its range.
    """

    distance: float
    speed: float = 0.1

    def __post_init__(self) -> None:
        distance = within(self.distance, "distance", 0.0, FARTHEST, above=True, unit="m")
        object.__setattr__(self, "distance", distance)
        object.__setattr__(self, "speed", within(self.speed, "speed", 0.0, 1.0, above=True))


_Word: TypeAlias = Literal["stay", "relax"]

#: "stay": hold the position where the arm has braked; in position control it goes on pushing. "relax": be compliant for
#: 0.2 s (1000 Nm/rad in every joint), then hold the position reached. Or move back.
Reaction: TypeAlias = _Word | Retreat


def check_reaction(value: object, parameter: str = "then") -> Reaction:
    """Refuse what is no reaction.

    Raises:
        ShapeError: see above.
    """
    if isinstance(value, Retreat):
        return value
    for known in get_args(_Word):
        if isinstance(value, str) and value == known:
            return cast(_Word, known)
    raise ShapeError(
        f"{parameter} must be 'stay', 'relax' or a Retreat, got {shown(value)}",
        parameter=parameter,
        value=value,
        allowed="'stay', 'relax', Retreat",
        hint="for example then='relax', or then=heptarm.Retreat(0.005)",
    )
