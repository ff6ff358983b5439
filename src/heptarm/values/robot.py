"""The robots: dimensions and limits of the LBR family.

Kinematics, position, velocity and torque limits are the data sheets' as collected by lbr_description, Drake
and iiwa_ros. KUKA publishes no acceleration and jerk limits; the values here are parameters of the virtual
cabinet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heptarm.errors import CommandRejected, LimitError
from heptarm.values.arrays import Array
from heptarm.values.pose import deg

#: Acceleration and jerk of every axis in the virtual cabinet; MoveIt configurations have this acceleration.
ACCELERATION = 10.0
JERK = 100.0


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A robot of the LBR family. Chain: Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7).

    Attributes:
        name: short name, as in targets: "iiwa14".
        title: KUKA's name.
        d_bs: base to shoulder [m].
        d_se: shoulder to elbow [m].
        d_ew: elbow to wrist [m].
        d_wf: wrist to flange [m].
        q_min: shape (7,) [rad].
        q_max: shape (7,) [rad].
        dq_max: shape (7,) [rad/s].
        ddq_max: shape (7,) [rad/s²].
        dddq_max: shape (7,) [rad/s³].
        tau_max: shape (7,) [Nm].
    """

    name: str
    title: str
    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    q_min: Array
    q_max: Array
    dq_max: Array
    ddq_max: Array
    dddq_max: Array
    tau_max: Array

    def check(self, q: Array, name: str = "q") -> None:
        """Check joint positions against the limits.

        Raises:
            LimitError: one is outside; the text names axis, value and range in degrees.
        """
        for index in range(7):
            if not self.q_min[index] <= q[index] <= self.q_max[index]:
                low, high, value = np.degrees([self.q_min[index], self.q_max[index], q[index]])
                raise LimitError(
                    f"A{index + 1} is {value:.2f} deg; the {self.title} allows {low:.0f} to {high:.0f} deg",
                    code=50,
                    parameter=f"{name}[{index}]",
                    value=float(q[index]),
                    allowed=f"[{self.q_min[index]:.4f}, {self.q_max[index]:.4f}] rad",
                    hint="keep the target inside the joint limits",
                )


def _frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values


def _robot(
    name: str, title: str, links: tuple[float, float, float, float], speed: Array, torque: tuple[float, ...]
) -> RobotModel:
    reach = _frozen(deg(170, 120, 170, 120, 170, 120, 175))
    return RobotModel(
        name,
        title,
        *links,
        q_min=_frozen(-reach),
        q_max=reach,
        dq_max=_frozen(speed),
        ddq_max=_frozen(np.full(7, ACCELERATION)),
        dddq_max=_frozen(np.full(7, JERK)),
        tau_max=_frozen(np.array(torque)),
    )


_SEVEN = ((0.34, 0.4, 0.4, 0.126), deg(98, 98, 100, 130, 140, 180, 180), (176.0, 176, 110, 110, 110, 40, 40))
_FOURTEEN = (
    (0.36, 0.42, 0.4, 0.126),
    deg(85, 85, 100, 75, 130, 135, 135),
    (320.0, 320, 176, 176, 110, 40, 40),
)

#: All robots by name. The Med variants share the arms of the iiwa ones.
ROBOTS: dict[str, RobotModel] = {
    "iiwa7": _robot("iiwa7", "LBR iiwa 7 R800", *_SEVEN),
    "iiwa14": _robot("iiwa14", "LBR iiwa 14 R820", *_FOURTEEN),
    "med7": _robot("med7", "LBR Med 7 R800", *_SEVEN),
    "med14": _robot("med14", "LBR Med 14 R820", *_FOURTEEN),
}


def robot(name: str) -> RobotModel:
    """The robot of that name.

    Raises:
        CommandRejected: there is none; the text lists the names.
    """
    try:
        return ROBOTS[name]
    except KeyError:
        raise CommandRejected(
            f"no robot {name!r}; there are {', '.join(ROBOTS)}", parameter="model"
        ) from None
