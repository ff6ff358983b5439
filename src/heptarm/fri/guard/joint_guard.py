"""Limits of the joint guard, and its report; the guard itself is native/fri_guard.c."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from heptarm.errors import LimitError
from heptarm.fri.guard.report import GuardReport
from heptarm.values.checks import array, finite, instance, scalar, within
from heptarm.values.robot import RobotModel

AXES = 7
#: Fraction of acceleration and jerk with which an approach is planned; the rest corrects deviations. `schema/native.py`
#: takes it, and the next, for the guard in C.
PLANNED = 0.8
#: A target is on track as long as its velocity changes by less than the largest jerk divided by this.
ON_TRACK = 4.0
#: Relative tolerance of the limits, for rounding.
ROUNDING = 1e-9
#: Unit of each limit, for errors.
_LIMIT_UNITS = {
    "dq_max": "rad/s",
    "ddq_max": "rad/s²",
    "dddq_max": "rad/s³",
    "tau_max": "Nm",
    "dtau_max": "Nm/s",
    "wrench_max": "N or Nm",
    "dwrench_max": "N/s or Nm/s",
    "reach": "rad",
}


def positive(value: object, name: str, unit: str) -> float:
    """A positive number; it may be infinite.

    Raises:
        ShapeError: it is no number.
        LimitError: it is not positive, or NaN.
    """
    number = scalar(value, name, unit=unit)
    if not number > 0.0:
        raise LimitError(f"{name} must be positive, got {number:g} {unit}", parameter=name, value=number)
    return number


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the joint guard.

    Attributes:
        q_min: 7 positions [rad].
        q_max: 7 positions [rad].
        dq_max: 7 velocities [rad/s].
        ddq_max: 7 accelerations [rad/s²].
        dddq_max: 7 jerks [rad/s³].
        tau_max: 7 superposed torques [Nm].
        dtau_max: their rates [Nm/s].
        wrench_max: superposed wrench, 6 numbers [N, Nm].
        dwrench_max: its rates [N/s, Nm/s].
        reach: largest distance of a target from the interpolator [rad].

    Raises:
        LimitError: a limit is not positive, or a position range is empty.
    """

    q_min: tuple[float, ...]
    q_max: tuple[float, ...]
    dq_max: tuple[float, ...]
    ddq_max: tuple[float, ...]
    dddq_max: tuple[float, ...]
    tau_max: tuple[float, ...]
    dtau_max: tuple[float, ...]
    wrench_max: tuple[float, ...] = (150.0, 150.0, 150.0, 50.0, 50.0, 50.0)
    dwrench_max: tuple[float, ...] = (3000.0, 3000.0, 3000.0, 1000.0, 1000.0, 1000.0)
    reach: float = math.inf

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            if name == "reach":
                positive(self.reach, name, "rad")
                continue
            values = array(getattr(self, name), 6 if "wrench" in name else AXES, name).tolist()
            object.__setattr__(self, name, tuple(values))
            for value in () if name in ("q_min", "q_max") else values:
                positive(value, name, _LIMIT_UNITS[name])
        for axis, (low, high) in enumerate(zip(self.q_min, self.q_max, strict=True), 1):
            if not low < high:
                raise LimitError(
                    f"q_min of A{axis} must be below q_max = {high:g} rad, got {low:g} rad: the range is empty",
                    parameter="q_min",
                    value=low,
                )

    @classmethod
    def of(
        cls,
        robot: RobotModel,
        *,
        fraction: float = 0.95,
        margin: float = math.radians(1.0),
        reach: float = math.inf,
    ) -> Limits:
        """Make limits slightly inside those of a robot.

        Args:
            robot: the robot.
            fraction: fraction of velocity, acceleration, jerk and torque, (0, 1].
            margin: distance from the position limits [rad].
            reach: largest distance of a target from the interpolator [rad].

        Raises:
            LimitError: an argument makes a limit zero or a position range empty.
        """
        instance(robot, RobotModel, "robot")
        fraction = within(fraction, "fraction", 0.0, 1.0, above=True)
        margin = finite(margin, "margin", unit="rad")
        tau = tuple(float(value) * fraction for value in robot.tau_max)
        return cls(
            q_min=tuple(float(value) + margin for value in robot.q_min),
            q_max=tuple(float(value) - margin for value in robot.q_max),
            dq_max=tuple(float(value) * fraction for value in robot.dq_max),
            ddq_max=tuple(float(value) * fraction for value in robot.ddq_max),
            dddq_max=tuple(float(value) * fraction for value in robot.dddq_max),
            tau_max=tau,
            dtau_max=tuple(20.0 * value for value in tau),
            reach=reach,
        )


class Limited(enum.IntEnum):
    """Quantity that the guard limited."""

    NOT_FINITE = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    JERK = 4
    TORQUE = 5
    WRENCH = 6


_UNITS = ("", "rad", "rad/s", "rad/s²", "rad/s³", "Nm", "N or Nm")


class JointReport(GuardReport):
    """What a joint guard has limited, by `Limited` and axis, shape [7][7]."""

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__(Limited, AXES)

    def _named(self, kind: int, part: int) -> tuple[str, str]:
        return f"wrench[{part}]" if kind == Limited.WRENCH else f"A{part + 1}", _UNITS[kind]
