"""Hand guiding: a person moves the arm while holding the enabling switch of its hand guiding device."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError
from heptarm.values.checks import Array, array, frozen, optional, word
from heptarm.values.motion.motion import Motion

#: What stops at a limit; what happens to a joint that is beyond its limit at the start.
AT_LIMIT = ("axis", "all")
OUTSIDE = ("free", "pull")
_FASTEST = 10.0


def _open() -> Array:
    return frozen(np.full(7, nan))


@dataclass(frozen=True, slots=True, eq=False)
class HandGuide(Motion):
    """A person moves the arm; made by `hand_guide`.

    Attributes:
        q_min: lowest positions, shape (7,) [rad]; NaN: the joint's own limit.
        q_max: highest positions, likewise.
        joint_velocity: highest speed of a joint [rad/s]; NaN: half of the slowest joint's maximum.
        cartesian_velocity: highest speed of the motion frame [m/s]; NaN: 0.25.
        at_limit: "axis" or "all".
        outside: "free" or "pull".
    """

    q_min: Array = field(default_factory=_open)
    q_max: Array = field(default_factory=_open)
    joint_velocity: float = nan
    cartesian_velocity: float = nan
    at_limit: str = "axis"
    outside: str = "free"


def hand_guide(
    *,
    q_min: npt.ArrayLike | None = None,
    q_max: npt.ArrayLike | None = None,
    joint_velocity: float | None = None,
    cartesian_velocity: float | None = None,
    at_limit: str = "axis",
    outside: str = "free",
) -> HandGuide:
    """Let a person move the arm by hand.

    The arm starts at rest. While the switch of the hand guiding device is held the arm is compliant and its weight is
    compensated; when the switch is released the motion ends, at rest. The cabinet cannot know when: give a timeout.

    Args:
        q_min: lowest joint positions, shape (7,) [rad]; NaN or None: the joint's own limit.
        q_max: highest joint positions, likewise.
        joint_velocity: highest speed of a joint [rad/s], up to 10; None: half of the slowest joint's maximum.
        cartesian_velocity: highest speed of the motion frame [m/s], up to 10; None: 0.25.
        at_limit: "axis": a joint at its limit stops there, all others stay free; "all": every joint is held until the
            switch is released.
        outside: a joint that is beyond its limit at the start can be moved back freely but no further out ("free"), or
            is pulled back while the arm is guided ("pull").

    Raises:
        ShapeError: a wrong shape or word.
        LimitError: a value outside its range, or a lower limit that is not below the upper one.
    """
    low = _open() if q_min is None else array(q_min, 7, "q_min", nan=True)
    high = _open() if q_max is None else array(q_max, 7, "q_max", nan=True)
    crossed = low >= high
    if crossed.any():
        axis = int(crossed.argmax())
        raise LimitError(
            f"q_min[{axis}] must be below q_max[{axis}] = {high[axis]:g} rad, got {low[axis]:g} rad",
            code=2,
            parameter=f"q_min[{axis}]",
            value=float(low[axis]),
            allowed=f"below {high[axis]:g} rad",
        )
    for chosen, name, words in ((at_limit, "at_limit", AT_LIMIT), (outside, "outside", OUTSIDE)):
        word(chosen, name, words)
    return HandGuide(
        low,
        high,
        optional(joint_velocity, "joint_velocity", 0.0, _FASTEST, above=True, unit="rad/s"),
        optional(cartesian_velocity, "cartesian_velocity", 0.0, _FASTEST, above=True, unit="m/s"),
        at_limit,
        outside,
    )
