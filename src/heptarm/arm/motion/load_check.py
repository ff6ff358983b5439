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
    """

    robot: RobotModel
    residual: Array
    axis: int
    fraction: float
    mass: float

    @classmethod
    def of(cls, robot: RobotModel, q: Array, tau_ext: Array) -> LoadCheck:
        """Of joint positions [rad] and external torques [Nm], shape (7,) each."""
        parts = np.abs(tau_ext) / robot.tau_max
        axis = int(parts.argmax())
        weight = jacobian(robot, q)[:3].T @ GRAVITY / robot.tau_max
        mass = float(weight @ (tau_ext / robot.tau_max)) / max(float(weight @ weight), 1e-9)
        return cls(robot, frozen(tau_ext), axis + 1, float(parts[axis]), mass)

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
    return _judged(LoadCheck.of(robot, q, tau_ext), refuse)


def _judged(found: LoadCheck, refuse: float) -> LoadCheck:
    """Log a warning where the load data do not fit.

    Raises:
        NotReady: they are wrong by more than a fraction of the highest torque of an axis.
    """
    if found.fraction > refuse:
        raise NotReady(
            f"{found}; at most {refuse:.1%} are allowed before impedance control",
            parameter="load",
            value=found.fraction,
            allowed=f"[0, {refuse:g}]",
            hint=_ADVICE,
        )
    if not found.is_fine:
        _log.warning("a compliant arm sinks under a load that it does not know: %s: %s", found, _ADVICE)
    return found


_ADVICE = "measure the load (heptarm calibrate load), attach its tool, and check that nothing touches the arm"


def check_before(robot: RobotModel, mode: Mode | None, state: State | None, *, refuse: float) -> None:
    """Check the load data before an arm in position control becomes compliant.

    Args:
        robot: the robot.
        mode: of the motion that is to begin; None: position control.
        state: the newest one; None: there is none.
        refuse: fraction of the highest torque of an axis above which it is an error.

    Raises:
        NotReady: more torque is left than that.
    """
    if mode is None or isinstance(mode, Position) or state is None:
        return
    groups = state.groups
    if groups.joints is None or groups.torques is None or groups.mode is None:
        return
    if not isinstance(groups.mode.mode, Position):
        return  # it is compliant already, and may lean on something
    _judged(LoadCheck.of(robot, groups.joints.q, groups.torques.tau_ext), refuse)
