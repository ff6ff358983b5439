"""Whether the load data in use fit what the torque sensors show: an arm in impedance control sinks under the rest."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from heptarm.errors import NotReady
from heptarm.model.dynamics import GRAVITY
from heptarm.model.kinematics import jacobian
from heptarm.values.checks import Array, Value, frozen
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.robot import RobotModel
from heptarm.values.state import State

_log = logging.getLogger("heptarm.arm")

#: Torque that load data may leave, as a fraction of the highest torque of the axis: a torque sensor has an accuracy of
#: 2 % (KUKA's brochure). Above the first a warning is logged, above the second impedance control is refused.
WARN, REFUSE = 0.03, 0.08
#: Part of the torques, by their squares, that a weight has to explain, so that they are no contact.
_EXPLAINED = 0.75
#: Robot time over which `Arm.verify_load` averages [s].
SECONDS = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class LoadCheck(Value):
    """What the load data in use leave of the measured torques.

    Attributes:
        robot: the robot.
        residual: mean external torque of each axis, shape (7,) [Nm].
        axis: the one with the largest part of its highest torque, 1 to 7.
        fraction: that part.
        mass: mass at the flange that would explain the torques [kg]: what the load data lack, if nothing touches the
            arm; negative: they have too much.
        weight: that part of the highest torque that this mass makes; 0: the torques are not those of a weight that the
            load data lack, but perhaps of a contact.
    """

    robot: RobotModel
    residual: Array
    axis: int
    fraction: float
    mass: float
    weight: float = 0.0

    @classmethod
    def of(cls, robot: RobotModel, q: Array, tau_ext: Array) -> LoadCheck:
        """Of joint positions [rad] and external torques [Nm], shape (7,) each."""
        parts = np.abs(tau_ext) / robot.tau_max
        axis = int(parts.argmax())
        by_mass = jacobian(robot, q)[:3].T @ GRAVITY / robot.tau_max
        mass = float(by_mass @ (tau_ext / robot.tau_max)) / max(float(by_mass @ by_mass), 1e-9)
        torques = mass * by_mass
        is_weight = mass > 0.0 and float(torques @ torques) > _EXPLAINED * float(parts @ parts)
        weight = float(np.abs(torques).max()) if is_weight else 0.0
        return cls(robot, frozen(tau_ext), axis + 1, float(parts[axis]), mass, weight)

    @property
    def is_fine(self) -> bool:
        """Whether the sensors' accuracy explains the torques."""
        return self.fraction <= WARN

    def __str__(self) -> str:
        """One line: the axis, its torque, and the mass that would explain it."""
        torque = float(self.residual[self.axis - 1])
        return (
            f"the load data leave {abs(torque):.1f} Nm of A{self.axis}, {self.fraction:.1%} of its highest torque, as "
            f"if {self.mass:+.2f} kg were at the flange"
        )


def verify(robot: RobotModel, states: list[State], *, refuse: float) -> LoadCheck:
    """Check the load data against states of a resting arm; see `Arm.verify_load`.

    Raises:
        NotReady: more torque is left than a fraction of the highest torque of an axis.
    """
    q, tau_ext = (np.mean([getattr(state, name) for state in states], axis=0) for name in ("q", "tau_ext"))
    found = LoadCheck.of(robot, q, tau_ext)
    return _judged(found, found.fraction, refuse)


def _judged(found: LoadCheck, fraction: float, refuse: float) -> LoadCheck:
    """Log a warning where the load data do not fit.

    Raises:
        NotReady: what counts is more than a fraction of the highest torque of an axis.
    """
    if fraction > refuse:
        raise NotReady(
            f"{found}; at most {refuse:.1%} are allowed before impedance control",
            parameter="load",
            value=fraction,
            allowed=f"[0, {refuse:g}]",
            hint=_ADVICE,
        )
    if not found.is_fine:
        _log.warning("a compliant arm sinks under a load that it does not know: %s: %s", found, _ADVICE)
    return found


_ADVICE = "measure the load (heptarm calibrate load), attach its tool, and check that nothing touches the arm"


def check_before(robot: RobotModel, mode: Mode | None, state: State | None) -> None:
    """Check the load data before an arm in position control becomes compliant.

    It may begin in contact, so that torques are refused only where a weight that the load data lack explains them.

    Args:
        robot: the robot.
        mode: of the motion that is to begin; None: position control.
        state: the newest one; None: there is none.

    Raises:
        NotReady: such a weight makes more than `REFUSE` of the highest torque of an axis.
    """
    if mode is None or isinstance(mode, Position) or state is None:
        return
    groups = state.groups
    if groups.joints is None or groups.torques is None or groups.mode is None:
        return
    if not isinstance(groups.mode.mode, Position):
        return  # it is compliant already, and may lean on something
    found = LoadCheck.of(robot, groups.joints.q, groups.torques.tau_ext)
    _judged(found, found.weight, REFUSE)
