"""Dynamics and blending of motions, and the one typed form in which their constructors accept both.

A motion holds one `Dynamics` and one `Blending`. `ptp(q, speed=0.3)` and `lin(pose, speed_mps=0.1)` are short forms:
`settings` makes the two values from the keywords of a constructor.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isnan, nan
from typing import TYPE_CHECKING, Any, ClassVar, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, Value, fractions, frozen, instance, optional, shown, within
from heptarm.values.motion.motion import Triggered
from heptarm.values.robot import RobotModel

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Limited = TypeVar("_Limited", bound="DynamicMotion")

_OPEN = frozen(np.full(7, nan))
#: The longest straight line inside the workspace of the largest arm [m].
LONGEST_LINE = 2.0
#: Cartesian speed assumed where none is given [m/s].
_SLOW_LINE = 0.1
#: Limits along the path: the highest value that a cabinet accepts, and the unit.
_PATH = {
    "speed_mps": (10.0, "m/s"),
    "acceleration_mps2": (100.0, "m/s²"),
    "jerk_mps3": (1e4, "m/s³"),
    "speed_radps": (20.0, "rad/s"),
    "acceleration_radps2": (200.0, "rad/s²"),
    "jerk_radps3": (2e4, "rad/s³"),
}
_JOINTS = ("joint_speed", "joint_acceleration", "joint_jerk")
#: Short names of the same limits for motions in joint space, which have no others.
_SHORT = dict(zip(("speed", "acceleration", "jerk"), _JOINTS, strict=True))
_BLENDING = {
    "blend_rel": ("relative", 1.0, ""),
    "blend_m": ("distance", 2.0, "m"),
    "blend_rad": ("orientation", 6.3, "rad"),
}


# ------------------------------------------------------------------------------------- keywords, each typed once


class PathLimits(TypedDict, total=False):
    """Limits along a path."""

    speed_mps: float | None
    acceleration_mps2: float | None
    jerk_mps3: float | None
    speed_radps: float | None
    acceleration_radps2: float | None
    jerk_radps3: float | None


class DynamicsKeywords(PathLimits, total=False):
    """Every limit of `Dynamics`."""

    joint_speed: npt.ArrayLike | None
    joint_acceleration: npt.ArrayLike | None
    joint_jerk: npt.ArrayLike | None


class _Shared(TypedDict, total=False):
    dynamics: Dynamics | None


class _Blend(TypedDict, total=False):
    blend_rel: float
    blend_m: float
    blend_rad: float


class SegmentSettings(_Shared, PathLimits, total=False):
    """Keywords of a segment of a spline."""


class SplineSettings(_Shared, DynamicsKeywords, total=False):
    """Keywords of a spline."""


class PathSettings(SplineSettings, _Blend, total=False):
    """Keywords of a motion along a path."""


class JointSplineSettings(_Shared, total=False):
    """Keywords of a spline in joint space."""

    speed: npt.ArrayLike | None
    acceleration: npt.ArrayLike | None
    jerk: npt.ArrayLike | None


class JointSettings(JointSplineSettings, _Blend, total=False):
    """Keywords of a motion in joint space."""


def _names(kind: type) -> dict[str, str]:
    """Names of the keywords and their types as text."""
    return {name: getattr(hint, "__forward_arg__", str(hint)) for name, hint in kind.__annotations__.items()}


def keywords(kind: type) -> Callable[[_Function], _Function]:
    """Decorator: list the keywords of `kind` one by one in help(), notebooks and the documentation."""

    def decorate(function: _Function) -> _Function:
        signature = inspect.signature(function)
        own = [
            parameter
            for parameter in signature.parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        more = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=0.0 if name in _BLENDING else None,
                annotation=hint,
            )
            for name, hint in _names(kind).items()
        ]
        function.__signature__ = signature.replace(parameters=own + more)  # type: ignore[attr-defined]
        return function

    return decorate


def _checked(name: str, value: Any) -> Any:
    """A limit, checked under the name that the user gave it."""
    if name in _PATH:
        high, unit = _PATH[name]
        return optional(value, name, 0.0, high, above=True, unit=unit)
    return fractions(value, name)


def _refuse_others(function: str, kind: type, given: Mapping[str, Any]) -> dict[str, str]:
    allowed = _names(kind)
    for name in given:
        if name not in allowed:
            raise TypeError(
                f"{function}() got an unexpected keyword argument {name!r}; limits and blending are "
                f"{', '.join(allowed)}"
            )
    return allowed


# ------------------------------------------------------------------------------------------------------- values


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Dynamics(Value):
    """Speed, acceleration and jerk of a motion: along its path, of its rotation, and of the joints.

    The slowest limit counts. What is not given (NaN) keeps the cabinet's default: for joints, their maximum.

    Args:
        **limits: as follows.
        speed_mps: speed along the path [m/s], up to 10.
        acceleration_mps2: acceleration along the path, on an arc also towards its centre [m/s²], up to 100.
        jerk_mps3: jerk along the path [m/s³], up to 10 000.
        speed_radps: speed of the rotation [rad/s], up to 20.
        acceleration_radps2: acceleration of the rotation [rad/s²], up to 200.
        jerk_radps3: jerk of the rotation [rad/s³], up to 20 000.
        joint_speed: fraction of each joint's maximum, (0, 1], one number for all joints or shape (7,).
        joint_acceleration: likewise.
        joint_jerk: likewise.

    Raises:
        ShapeError: a joint limit is neither one number nor seven.
        LimitError: a value outside its range; the text names it.
    """

    speed_mps: float
    acceleration_mps2: float
    jerk_mps3: float
    speed_radps: float
    acceleration_radps2: float
    jerk_radps3: float
    joint_speed: Array
    joint_acceleration: Array
    joint_jerk: Array

    @keywords(DynamicsKeywords)
    def __init__(self, **limits: Unpack[DynamicsKeywords]) -> None:
        _refuse_others("Dynamics", DynamicsKeywords, limits)
        given: Mapping[str, Any] = limits
        for name in _PATH:
            value = given.get(name)
            keep = isinstance(value, float) and isnan(value)
            object.__setattr__(self, name, nan if keep else _checked(name, value))
        for name in _JOINTS:
            value = given.get(name, _OPEN)
            keep = value is None or value is _OPEN
            object.__setattr__(self, name, _OPEN if keep else fractions(value, name, nan=True))

    def given(self) -> Iterator[str]:
        """Names of the limits that do not keep the cabinet's default."""
        yield from (name for name in _PATH if not isnan(getattr(self, name)))
        yield from (name for name in _JOINTS if not np.isnan(getattr(self, name)).all())

    def limited_to(self, speed: float) -> Dynamics:
        """The same with no joint faster than a fraction of its maximum in (0, 1]; it can only slow down."""
        speed = within(speed, "speed", 0.0, 1.0, above=True)
        return self if speed == 1.0 else replace(self, joint_speed=np.fmin(self.joint_speed, speed))

    def filled_from(self, whole: Dynamics) -> Dynamics:
        """The same, where it keeps a default with the limit of another one."""
        instance(whole, Dynamics, "whole")
        limits = {name: (getattr(self, name), getattr(whole, name)) for name in (*_PATH, *_JOINTS)}
        return Dynamics(**{name: np.where(np.isnan(a), b, a)[()] for name, (a, b) in limits.items()})

    def turn_time(self, robot: RobotModel) -> float:
        """Time for every joint to move through its whole range, with ramps [s]."""
        limits = (self.joint_speed, self.joint_acceleration, self.joint_jerk)
        speed, acceleration, jerk = (np.nan_to_num(limit, nan=1.0) for limit in limits)
        cruise = (robot.q_max - robot.q_min) / (robot.dq_max * speed)
        ramps = robot.dq_max * speed / (robot.ddq_max * acceleration) + robot.ddq_max / (
            robot.dddq_max * jerk
        )
        return float(np.max(cruise + ramps))

    def path_time(self, length: float) -> float:
        """Time for a path of a length [m] at its speed, or at a slow one if it has none [s]."""
        return length / (_SLOW_LINE if isnan(self.speed_mps) else self.speed_mps)


@dataclass(frozen=True, slots=True, eq=False)
class Blending(Value):
    """Where a motion may start to blend into the next one; all 0: it ends in an exact stop.

    Attributes:
        relative: fraction of the path, [0, 1].
        distance: from the end of the path [m], up to 2.
        orientation: from the end of the rotation [rad], up to 6.3.

    Raises:
        LimitError: one is outside its range.
    """

    relative: float = 0.0
    distance: float = 0.0
    orientation: float = 0.0

    def __post_init__(self) -> None:
        for name, high, unit in _BLENDING.values():
            object.__setattr__(self, name, within(getattr(self, name), name, 0.0, high, unit=unit))


#: What a motion has unless it is given something else: the cabinet's defaults, and an exact stop.
DEFAULT = Dynamics()
EXACT = Blending()


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DynamicMotion(Triggered):
    """Base of motions whose speed can be limited.

    Attributes:
        dynamics: limits of its speed, acceleration and jerk.
    """

    dynamics: Dynamics = DEFAULT

    def limited_to(self: _Limited, speed: float) -> _Limited:
        """The same motion, no joint faster than a fraction of its maximum in (0, 1]."""
        return replace(self, dynamics=self.dynamics.limited_to(speed))

    def longest_duration(self, robot: RobotModel) -> float:
        """Slowest plausible estimate of its duration [s]."""
        return self.dynamics.turn_time(robot)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Blended(DynamicMotion):
    """Base of motions that can blend into the next one.

    Attributes:
        blending: where that may start.
    """

    blending: Blending = EXACT


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PathMotion(Blended):
    """Base of motions along a Cartesian path.

    Attributes:
        longest_path: upper bound of the length of its path [m].
    """

    longest_path: ClassVar[float] = LONGEST_LINE

    def longest_duration(self, robot: RobotModel) -> float:
        """Slowest plausible estimate of its duration [s]."""
        return self.dynamics.turn_time(robot) + self.dynamics.path_time(self.longest_path) + 1.0


# ------------------------------------------------------------------------------------- from keywords to values


def settings(function: str, kind: type, given: Mapping[str, Any]) -> dict[str, Any]:
    """Fields `dynamics` and, where `kind` has it, `blending`, from the keywords of a constructor.

    Args:
        function: name of the constructor, for errors.
        kind: the keywords that it accepts, such as `PathSettings`.
        given: the keywords that the user gave; they go before those of `dynamics=`.

    Raises:
        TypeError: a keyword that the constructor does not have.
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: `dynamics` has limits that this motion does not have.
    """
    allowed = _refuse_others(function, kind, given)
    dynamics = _base(function, allowed, given.get("dynamics"))
    limits = {
        _SHORT.get(name, name): _checked(name, value)
        for name, value in given.items()
        if value is not None and (name in _PATH or name in _JOINTS or name in _SHORT)
    }
    result: dict[str, Any] = {"dynamics": replace(dynamics, **limits) if limits else dynamics}
    if "blend_rel" in allowed:
        blends = {
            field: within(given[name], name, 0.0, high, unit=unit)
            for name, (field, high, unit) in _BLENDING.items()
            if name in given
        }
        result["blending"] = Blending(**blends) if blends else EXACT
    return result


def _base(function: str, allowed: Mapping[str, str], dynamics: Dynamics | None) -> Dynamics:
    if dynamics is None:
        return DEFAULT
    if not isinstance(dynamics, Dynamics):
        raise ShapeError(
            f"dynamics must be a Dynamics, got {shown(dynamics)}",
            parameter="dynamics",
            value=dynamics,
            hint="for example Dynamics(speed_mps=0.1, joint_speed=0.3)",
        )
    known = {_SHORT.get(name, name) for name in allowed}
    others = [name for name in dynamics.given() if name not in known]
    if others:
        raise CommandRejected(
            f"dynamics has {', '.join(others)}, which {function} does not have",
            parameter="dynamics",
            allowed=", ".join(sorted(known & {*_PATH, *_JOINTS})),
            hint="leave these limits out",
        )
    return dynamics
