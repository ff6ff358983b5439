"""Control modes: how the arm holds on to its set-points.

::

    arm.move(ptp(q), mode=JointImpedance(stiffness=300.0))

In position control it does so as stiffly as it can; in an impedance mode like a spring with a damper, so that it
yields to whoever pushes. Ranges and defaults are those of Sunrise's control modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.values.arrays import Array, Value, array, frozen, within

#: Largest stiffness of a joint [Nm/rad].
STIFFEST_JOINT = 5000.0


@dataclass(frozen=True, slots=True, eq=False)
class Position(Value):
    """Stiff position control, the default."""


@dataclass(frozen=True, slots=True, eq=False)
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
    damping: Array = 0.7  # type: ignore[assignment]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "stiffness", per_joint(self.stiffness, "stiffness", STIFFEST_JOINT, "Nm/rad")
        )
        object.__setattr__(self, "damping", per_joint(self.damping, "damping", 1.0, ""))


Mode = Position | JointImpedance


def per_joint(value: npt.ArrayLike, name: str, high: float, unit: str) -> Array:
    """Seven numbers in [0, high], from one or seven."""
    result = array(np.full(7, value) if np.ndim(value) == 0 else value, 7, name)
    for index, entry in enumerate(result.tolist()):
        within(entry, f"{name}[{index}]", 0.0, high, unit=unit)
    return frozen(result)
