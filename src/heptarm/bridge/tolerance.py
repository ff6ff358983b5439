"""How far the arm may be off on its way and at its end: defaults of the node, overridden by a goal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from heptarm.bridge.goal import Goal, Tolerance
from heptarm.bridge.trajectory import Sample
from heptarm.values.arrays import Array, Value, frozen

#: In a goal: do not enforce.
ERASED = -1.0


def _zeros() -> Array:
    return frozen(np.zeros(7))


@dataclass(frozen=True, slots=True, eq=False)
class Bounds(Value):
    """Largest errors per joint; 0: not enforced.

    Attributes:
        position: shape (7,) [rad].
        velocity: shape (7,) [rad/s].
        acceleration: shape (7,) [rad/s²]; kept, but an arm tells no accelerations to hold against it.
    """

    position: Array = field(default_factory=_zeros)
    velocity: Array = field(default_factory=_zeros)
    acceleration: Array = field(default_factory=_zeros)

    def worst(self, names: Sequence[str], desired: Sample, q: Array, dq: Array) -> str:
        """The first joint that is too far off, in words; empty: none is. NaN velocities are not looked at."""
        for bound, error, what, unit in (
            (self.position, desired.q - q, "off", "rad"),
            (self.velocity, np.nan_to_num(desired.dq - dq), "off in velocity", "rad/s"),
        ):
            broken = (bound > 0.0) & ~(np.abs(error) <= bound)
            if broken.any():
                index = int(np.argmax(broken))
                return (
                    f"{names[index]} is {error[index]:+.5f} {unit} {what}; allowed is {bound[index]:g} {unit}"
                )
        return ""


@dataclass(frozen=True, slots=True, eq=False)
class Tolerances(Value):
    """Everything that is held against a motion.

    Attributes:
        path: on the way.
        goal: at the end.
        goal_time: how long after the end it may take to arrive [s]; 0: for ever.
    """

    path: Bounds = field(default_factory=Bounds)
    goal: Bounds = field(default_factory=Bounds)
    goal_time: float = 0.0

    def of(self, goal: Goal, names: Sequence[str]) -> tuple[Tolerances, str]:
        """These with a goal's own ones in their places.

        A goal whose tolerances make no sense (a negative number that is not -1, an unknown joint) gets none of its
        own: all defaults count. That is no refusal, so it is told in words.

        Returns:
            The tolerances, and why a goal's own were not taken; empty: they were.
        """
        if math.isnan(goal.goal_time) or (goal.goal_time < 0 and goal.goal_time != ERASED):
            return self, f"goal_time_tolerance is {goal.goal_time:g} s; -1, 0 or more is wanted"
        path, why = _merged(self.path, goal.path_tolerance, names, "path_tolerance")
        if not why:
            final, why = _merged(self.goal, goal.goal_tolerance, names, "goal_tolerance")
        if why:
            return self, why
        return replace(self, path=path, goal=final, goal_time=_one(goal.goal_time, self.goal_time)), ""


def _merged(
    default: Bounds, given: Sequence[Tolerance], names: Sequence[str], label: str
) -> tuple[Bounds, str]:
    columns = {kind: np.array(getattr(default, kind)) for kind in ("position", "velocity", "acceleration")}
    for entry in given:
        if entry.joint not in names:
            return default, f"{label} names the unknown joint {entry.joint!r}"
        index = list(names).index(entry.joint)
        for kind, column in columns.items():
            value = getattr(entry, kind)
            if math.isnan(value) or (value < 0 and value != ERASED):
                return default, f"{label} of {entry.joint}: {kind} is {value:g}; -1, 0 or more is wanted"
            column[index] = _one(value, float(column[index]))
    return Bounds(*(frozen(column) for column in columns.values())), ""


def _one(value: float, default: float) -> float:
    if value == ERASED:
        return 0.0
    return value if value > 0.0 else default
