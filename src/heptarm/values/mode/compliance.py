"""Cartesian impedances for a purpose: guiding along chosen directions, pressing along one."""

from __future__ import annotations

import numpy as np

from heptarm.errors import ShapeError
from heptarm.values.checks import optional, shown, within
from heptarm.values.condition.contact import axis_of
from heptarm.values.frames import TOOL
from heptarm.values.mode.directions import DIRECTIONS, one
from heptarm.values.mode.impedance import STIFFEST, STRONGEST, CartesianImpedance

#: Stiffness of the directions that are held, along [N/m] and about an axis [Nm/rad].
HOLDING = (4000.0, 300.0)
#: Highest bounds of guiding by hand, along [m/s] and about axes [rad/s], and the velocity that stops it in proportion.
FASTEST, STOPPING = (2.0, 4.0), 1.25
#: Stiffness of a press: across its direction, along it [N/m], and about any axis [Nm/rad].
PRESSING = (3000.0, 200.0, 300.0)


def compliance(
    free: str,
    *,
    frame: str = TOOL,
    stiffness: float = HOLDING[0],
    turning: float = HOLDING[1],
    damping: float = 1.0,
    nullspace_stiffness: float = 0.0,
    speed: float | None = None,
    turning_speed: float | None = None,
) -> CartesianImpedance:
    """Cartesian impedance that is compliant along some directions and holds the arm in all others.

    Along the free directions a damper resists the hand, and the speed is bounded: the arm brakes at the bound, and a
    quarter above it the motion stops. Its axes stay below half of their maxima, or above that in proportion to a
    higher `speed`. On a robot only the stop is certain: how Sunrise damps a direction without stiffness is unknown.

    Args:
        free: the directions, such as "z" (a line), "xy" (a plane), "a" (about z), "xya" (the plane, and turning in it);
            "b" is about y, "c" about x.
        frame: the frame whose axes count: "tool" (the motion frame at the start), "base", or the name of a frame.
        stiffness: along the axes that are held [N/m], up to 5000.
        turning: about the axes that are held [Nm/rad], up to 300.
        damping: damping ratio, 0.1 to 1.
        nullspace_stiffness: of the spring that holds the elbow [Nm/rad]; at 0 the elbow moves freely.
        speed: bound along the free axes [m/s], up to 2; None: 0.25.
        turning_speed: bound about the free axes [rad/s], up to 4; None: 1.

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
    chosen = [DIRECTIONS[name] for name in free]
    held[chosen] = 0.0
    stops = np.full(6, np.nan)
    stops[:3] = STOPPING * optional(speed, "speed", 0.0, FASTEST[0], above=True, unit="m/s")
    stops[3:] = STOPPING * optional(turning_speed, "turning_speed", 0.0, FASTEST[1], above=True, unit="rad/s")
    return CartesianImpedance(
        held,
        damping=damping,
        nullspace_stiffness=nullspace_stiffness,
        max_velocity=np.where(held > 0.0, np.nan, stops),
        frame=frame,
    )


def pressing(
    direction: str,
    force: float,
    *,
    frame: str = TOOL,
    stiffness: float = PRESSING[0],
    along: float = PRESSING[1],
    turning: float = PRESSING[2],
    damping: float = 0.9,
) -> CartesianImpedance:
    """Cartesian impedance that presses with a force along one axis, and holds the arm in all other directions.

    Along the axis the arm exerts the force and a spring to its set-point: where the path is a distance d above or below
    the surface, the force differs by `along` times d. Without a surface the arm moves on until the spring balances the
    force.

    Args:
        direction: an axis of the frame, such as "z" or "-x", along which the arm presses.
        force: [N], up to 500.
        frame: whose axes: "tool" (the motion frame at the start), "base", or the name of a frame.
        stiffness: across the direction [N/m], up to 5000.
        along: of the spring along the direction [N/m], up to 5000.
        turning: about all axes [Nm/rad], up to 300.
        damping: damping ratio, 0.1 to 1.

    Raises:
        ShapeError: no axis.
        LimitError: a value outside its range.
    """
    axis = axis_of(direction)
    springs = np.full(6, one(stiffness, "stiffness", 0.0, STIFFEST[0], "N/m"))
    springs[3:] = one(turning, "turning", 0.0, STIFFEST[1], "Nm/rad")
    springs[:3][axis != 0.0] = one(along, "along", 0.0, STIFFEST[0], "N/m")
    push = np.zeros(6)
    push[:3] = within(force, "force", 0.0, STRONGEST, unit="N") * axis
    return CartesianImpedance(springs, damping=damping, additional_force=push, frame=frame)
