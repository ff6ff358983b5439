"""Motions as the planner takes them: the union `PlantMotion` of the seam.

The doubles of KUKA's classes describe themselves so, and `look_ahead` makes the same of a program that is not sent yet.
Here stands what their numbers mean: the defaults of what a motion leaves open, what a part takes from its batch or
spline, and the numbers that no motion can have.
"""

from __future__ import annotations

from dataclasses import fields, replace
from math import inf, isnan
from typing import Any, NoReturn, TypeAlias, TypeVar

from heptarm.planning import seam
from heptarm.values.motion.orientation import Orientation

#: Length of one tick [s].
TICK = seam.TICK_NS / 1e9

#: Follows targets that arrive while it runs.
ServoMotion: TypeAlias = seam.ServoSmart | seam.ServoDirect | seam.ServoStraight

#: Limits of a Cartesian motion that names none: m/s, m/s², m/s³ and rad/s, rad/s², rad/s³.
CARTESIAN_DEFAULT = (1.0, 4.0, 40.0)
ORIENTATION_DEFAULT = (1.5, 6.0, 60.0)
#: Smallest speed, acceleration or jerk: a fraction of the axes' maxima, or along a path in SI units.
SLOWEST = 1e-6
#: Farthest position of a target or of a tool frame [m].
FARTHEST = 100.0
#: A motion frame that is the flange: x y z, quaternion.
ON_FLANGE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

_Part = TypeVar("_Part", bound=seam.PlantMotion)
_SETTINGS = (seam.JointDynamics, seam.CartesianDynamics, seam.Blending, seam.Orientation)


class PlanError(ValueError):
    """The motion cannot be planned; the text is of the kind that Sunrise gives.

    Attributes:
        kind: "joint_limit", "unreachable" or "planning".
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


def kind_of(motion: object) -> str:
    """The name of its kind, for an error's text."""
    return type(motion).__name__


# ------------------------------------------------------------------------------------------------------- settings


def or_default(value: float, default: float) -> float:
    """A value of a motion; the default where it is NaN."""
    return default if isnan(value) else value


def fractions(values: tuple[float, ...]) -> tuple[float, ...]:
    """Fractions of each axis' maximum; 1 where they are not given."""
    return tuple(or_default(value, 1.0) for value in values)


def orientation_of(given: seam.Orientation) -> Orientation:
    """How the orientation changes along a path; what is not given: variable, relative to the base.

    Raises:
        CommandRejected: there is no such combination.
    """
    return Orientation(
        "variable" if given.type is None else given.type.name.lower(),
        "base" if given.reference is None else given.reference.name.lower(),
    )


def inherited(part: _Part, whole: seam.Batch | seam.Spline | seam.JointSpline) -> _Part:
    """A part of a batch or a spline, with the settings of the whole where it has none of its own."""
    given = {type(value): value for value in _values(whole).values()}
    return replace(
        part,
        **{
            name: _filled(value, given[type(value)])
            for name, value in _values(part).items()
            if isinstance(value, _SETTINGS) and type(value) in given
        },
    )


def _values(value: Any) -> dict[str, Any]:
    return {field.name: getattr(value, field.name) for field in fields(value)}


def _filled(own: Any, whole: Any) -> Any:
    """Settings with those of the whole where they are not given: None or NaN."""
    if isinstance(own, tuple):
        return tuple(map(_filled, own, whole))
    if own is None or isinstance(own, float):
        return whole if own is None or isnan(own) else own
    if isinstance(own, _SETTINGS):
        return replace(
            own, **{name: _filled(value, getattr(whole, name)) for name, value in _values(own).items()}
        )
    return own


# --------------------------------------------------------------------------------------------------------- checks


def check_numbers(motion: seam.PlantMotion) -> None:
    """Refuse speeds and positions that no motion can have, before anything divides by them or squares them."""
    for value in _values(motion).values():
        if isinstance(value, seam.JointDynamics):
            for factor in (*value.velocity, *value.acceleration, *value.jerk):
                if not (isnan(factor) or SLOWEST <= factor <= 1.0):
                    _refuse_number("relative speeds", factor, f"in [{SLOWEST:g}, 1]")
        elif isinstance(value, seam.CartesianDynamics):
            for number in _values(value).values():
                if not (isnan(number) or SLOWEST <= number < inf):
                    _refuse_number("Cartesian speeds", number, f"finite and at least {SLOWEST:g}")
        elif isinstance(value, seam.Pose):
            check_places((*value.xyz, *value.quat))


def check_places(values: tuple[float, ...]) -> None:
    """Refuse numbers that no pose has."""
    for value in values:
        if not abs(value) <= FARTHEST:
            _refuse_number("positions", value, f"in [{-FARTHEST:g}, {FARTHEST:g}] m")


def _refuse_number(what: str, value: float, allowed: str) -> NoReturn:
    raise PlanError("planning", f"Can not plan motion: {what} must be {allowed}, got {value:g}")
