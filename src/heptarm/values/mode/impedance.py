"""Impedance modes: the arm is compliant like a spring with a damper, in each joint or at the motion frame.

Ranges and defaults are those of Sunrise's control modes. Cartesian directions are in the order x y z, then about x,
about y, about z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError
from heptarm.values.checks import Array, Value, flag, one_or_each, within
from heptarm.values.frames import TOOL, check_name
from heptarm.values.mode.directions import (
    FORCE,
    LENGTH,
    SPEED,
    Directional,
    by_groups,
    each,
    limit,
    one,
    put,
    six,
)
from heptarm.values.text import listing

#: Largest stiffness of a joint [Nm/rad].
STIFFEST_JOINT = 5000.0
#: Largest stiffness along an axis [N/m] and about one [Nm/rad].
STIFFEST = (5000.0, 300.0)
#: Defaults of the impedance modes.
STIFFNESS = (2000.0, 2000.0, 2000.0, 200.0, 200.0, 200.0)
DAMPING = 0.7
NULLSPACE_STIFFNESS = 100.0
#: Largest force [N] or torque [Nm], and largest value of a limit on one.
STRONGEST = 500.0
UNLIMITED = 1e6

NO_FORCE = (0.0,) * 6


@dataclass(frozen=True, slots=True, eq=False, init=False)
class JointImpedance(Value):
    """A spring and a damper in every joint.

    Args:
        stiffness: [Nm/rad], one number for all joints or seven, 0 to 5000; 0 lets the joint float.
        damping: damping ratio, one number or seven, 0 to 1.

    Raises:
        ShapeError: neither one number nor seven.
        LimitError: one is outside its range; the text names the joint.
    """

    stiffness: Array
    damping: Array

    def __init__(self, stiffness: npt.ArrayLike, *, damping: npt.ArrayLike = DAMPING) -> None:
        put(self, "stiffness", each(stiffness, 7, "stiffness", 0.0, STIFFEST_JOINT, "Nm/rad"))
        put(self, "damping", each(damping, 7, "damping", 0.0, 1.0))

    def __str__(self) -> str:
        """One line."""
        return f"joint impedance, {listing(self.stiffness, 'Nm/rad')}, damping {listing(self.damping)}"


@dataclass(frozen=True, slots=True, eq=False, init=False)
class CartesianImpedance(Value):
    """A spring and a damper between the motion frame and its set-point, and another for the elbow (null space).

    Where shape (6,) is asked for, groups of directions may be given instead: `{"xyz": 3000, "abc": 200}`, where "a" is
    about z, "b" about y, "c" about x; the directions that no group names keep the default.

    Args:
        stiffness: shape (6,), or one number for all; along the axes 0 to 5000 N/m, about them 0 to 300 Nm/rad.
        damping: damping ratio, one number for all directions or shape (6,), 0.1 to 1.
        nullspace_stiffness: of the spring that holds the elbow [Nm/rad], 0 to 5000.
        nullspace_damping: its damping ratio, 0.3 to 1.
        additional_force: acts in addition to the springs, shape (6,) [N, Nm], -500 to 500.
        max_force: largest force that the control exerts, shape (6,) [N, Nm], 0 to 1e6; NaN or None: unlimited.
        max_force_stops: reaching it also stops the motion.
        max_velocity: of the motion frame, shape (6,) [m/s, rad/s], up to 100; a higher one stops the motion; NaN or
            None: unlimited, but 0.3125 m/s and 1.25 rad/s in directions that a hand can guide, of less than 10 N/m or
            0.5 Nm/rad. There the virtual cabinet brakes the arm at 0.8 of this velocity.
        max_deviation: from the set-point, shape (6,) [m, rad], up to 100; a larger one stops the motion; NaN or None:
            unlimited.
        frame: the frame whose axes the directions are: "tool" (the motion frame), "base", or the name of a frame.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: max_force_stops without a max_force.
    """

    stiffness: Array
    damping: Array
    nullspace_stiffness: float
    nullspace_damping: float
    additional_force: Array
    max_force: Array
    max_force_stops: bool
    max_velocity: Array
    max_deviation: Array
    frame: str

    def __init__(
        self,
        stiffness: Directional = STIFFNESS,
        *,
        damping: Directional = DAMPING,
        nullspace_stiffness: float = NULLSPACE_STIFFNESS,
        nullspace_damping: float = DAMPING,
        additional_force: Directional = NO_FORCE,
        max_force: Directional | None = None,
        max_force_stops: bool = False,
        max_velocity: Directional | None = None,
        max_deviation: Directional | None = None,
        frame: str = TOOL,
    ) -> None:
        put(self, "stiffness", _stiffness(stiffness))
        put(self, "damping", each(by_groups(damping, "damping", (DAMPING,) * 6), 6, "damping", 0.1, 1.0))
        put(
            self,
            "nullspace_stiffness",
            one(nullspace_stiffness, "nullspace_stiffness", 0.0, 5000.0, "Nm/rad"),
        )
        put(self, "nullspace_damping", one(nullspace_damping, "nullspace_damping", 0.3, 1.0))
        put(
            self,
            "additional_force",
            six(additional_force, "additional_force", -STRONGEST, STRONGEST, FORCE),
        )
        put(self, "max_force", limit(max_force, "max_force", UNLIMITED, FORCE))
        put(self, "max_force_stops", flag(max_force_stops, "max_force_stops"))
        put(self, "max_velocity", limit(max_velocity, "max_velocity", 100.0, SPEED, above=True))
        put(self, "max_deviation", limit(max_deviation, "max_deviation", 100.0, LENGTH, above=True))
        put(self, "frame", check_name(frame, "frame"))
        if self.max_force_stops and np.isnan(self.max_force).all():
            raise CommandRejected(
                "max_force_stops must not be set without a max_force",
                code=2,
                parameter="max_force_stops",
                hint="give a max_force for at least one direction",
            )

    def __str__(self) -> str:
        """One line: the springs, and what else is set."""
        along, about = listing(self.stiffness[:3], "N/m"), listing(self.stiffness[3:], "Nm/rad")
        parts = [
            f"Cartesian impedance, {along}, {about}",
            f"damping {listing(self.damping)}",
            f"null space {self.nullspace_stiffness:g} Nm/rad",
            f"frame {self.frame}",
        ]
        if self.additional_force.any():
            parts.append(f"additional force {listing(self.additional_force, 'N, Nm')}")
        limits = (
            ("max_force", self.max_force, "N, Nm"),
            ("max_velocity", self.max_velocity, "m/s, rad/s"),
            ("max_deviation", self.max_deviation, "m, rad"),
        )
        parts += [
            f"{name} {listing(values, unit)}" for name, values, unit in limits if not np.isnan(values).all()
        ]
        return ", ".join(parts)


def _stiffness(value: Directional) -> Array:
    result = one_or_each(by_groups(value, "stiffness", STIFFNESS), 6, "stiffness")
    for index, entry in enumerate(result.tolist()):
        unit = "N/m" if index < 3 else "Nm/rad"
        try:
            within(entry, f"stiffness[{index}]", 0.0, STIFFEST[index // 3], unit=unit)
        except LimitError as error:
            if index > 2 and 0.0 < entry <= STIFFEST[0]:
                error.hint = 'the stiffness about an axis has a unit of its own: {"xyz": 3000, "abc": 200}'
            raise
    return result
