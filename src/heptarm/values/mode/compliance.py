"""The mode for guiding along chosen directions: compliant along them, stiff along all others."""

from __future__ import annotations

import numpy as np

from heptarm.errors import ShapeError
from heptarm.values.arrays import shown
from heptarm.values.frames import TOOL
from heptarm.values.mode.directions import DIRECTIONS, one
from heptarm.values.mode.impedance import STIFFEST, CartesianImpedance

#: Stiffness of the directions that are held, along [N/m] and about an axis [Nm/rad].
HOLDING = (4000.0, 300.0)


def compliance(
    free: str,
    *,
    frame: str = TOOL,
    stiffness: float = HOLDING[0],
    turning: float = HOLDING[1],
    damping: float = 1.0,
    nullspace_stiffness: float = 0.0,
) -> CartesianImpedance:
    """Cartesian impedance that is compliant along some directions and holds the arm in all others.

    Args:
        free: the directions, such as "z" (a line), "xy" (a plane), "a" (about z), "xya" (the plane, and turning in it);
            "b" is about y, "c" about x.
        frame: the frame whose axes count: "tool" (the motion frame at the start), "base", or the name of a frame.
        stiffness: along the axes that are held [N/m], up to 5000.
        turning: about the axes that are held [Nm/rad], up to 300.
        damping: damping ratio, 0.1 to 1.
        nullspace_stiffness: of the spring that holds the elbow [Nm/rad]; at 0 the elbow moves freely.

    Raises:
        ShapeError: no directions, unknown ones, or one twice.
        LimitError: a value outside its range.
    """
    if (
        not isinstance(free, str)
        or not free
        or len(set(free)) != len(free)
        or not set(free) <= set(DIRECTIONS)
    ):
        raise ShapeError(
            f"free must be letters of 'xyzabc', each at most once, got {shown(free)}",
            parameter="free",
            value=free,
            hint='for example "z", "xy", or "a" for turning about z',
        )
    held = np.array(
        [one(stiffness, "stiffness", 0.0, STIFFEST[0], "N/m")] * 3
        + [one(turning, "turning", 0.0, STIFFEST[1], "Nm/rad")] * 3
    )
    held[[DIRECTIONS[name] for name in free]] = 0.0
    return CartesianImpedance(held, damping=damping, nullspace_stiffness=nullspace_stiffness, frame=frame)
