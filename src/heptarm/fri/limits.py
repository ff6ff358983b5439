"""What the guard keeps of commanded positions, torques and wrenches."""

from __future__ import annotations

import math
from dataclasses import dataclass

from heptarm.errors import LimitError
from heptarm.values.robot import RobotModel


@dataclass(frozen=True, slots=True)
class Limits:
    """What the guard keeps.

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
        reach: how far a wish may be from the interpolator [rad].

    Raises:
        LimitError: a limit is no positive number, or a position range is empty.
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
            if name in ("q_min", "q_max"):
                continue
            values = getattr(self, name)
            for value in (values,) if name == "reach" else values:
                if not value > 0.0:
                    raise LimitError(
                        f"{name} is {value:g}; a positive number is wanted", parameter=name, value=value
                    )
        for axis, (low, high) in enumerate(zip(self.q_min, self.q_max, strict=True), 1):
            if not low < high:
                raise LimitError(
                    f"A{axis} may be from {low:g} to {high:g} rad, which is empty", parameter="q_min"
                )

    @classmethod
    def of(
        cls,
        robot: RobotModel,
        *,
        share: float = 0.95,
        margin: float = math.radians(1.0),
        reach: float = math.inf,
    ) -> Limits:
        """The limits of a robot, a little inside its own.

        Args:
            robot: whose limits.
            share: of velocity, acceleration, jerk and torque, (0, 1].
            margin: distance kept from the position limits [rad].
            reach: how far a wish may be from the interpolator [rad].

        Raises:
            LimitError: an argument leaves no room.
        """
        tau = tuple(float(value) * share for value in robot.tau_max)
        return cls(
            q_min=tuple(float(value) + margin for value in robot.q_min),
            q_max=tuple(float(value) - margin for value in robot.q_max),
            dq_max=tuple(float(value) * share for value in robot.dq_max),
            ddq_max=tuple(float(value) * share for value in robot.ddq_max),
            dddq_max=tuple(float(value) * share for value in robot.dddq_max),
            tau_max=tau,
            dtau_max=tuple(20.0 * value for value in tau),
            reach=reach,
        )
