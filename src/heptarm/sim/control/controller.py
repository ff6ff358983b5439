"""The control law in force, and the one that takes its place when the control mode changes."""

from __future__ import annotations

import mujoco
import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.guiding import HandGuide
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, SineImpedance
from heptarm.values.pose import rotation
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri.overlay import Superposition
from heptarm.virtual.guiding import HandLaw
from heptarm.virtual.impedance import CartesianSpring, Flange
from heptarm.virtual.law import JointSpring, Law, PositionLaw, Sensed
from heptarm.virtual.order import Order

#: Flange to moved frame, axes of the mode's frame: what a Cartesian spring keeps for its life.
_Fitting = tuple[tuple[float, ...], str, tuple[float, ...] | None]


class Control:
    """Holds the law in force.

    Args:
        robot: the robot.
        model: MuJoCo's model; its first seven joints are the arm's.
        data: its state.
    """

    def __init__(self, robot: RobotModel, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._robot = robot
        self._flange = Flange(model, data)
        self._law: Law = PositionLaw()
        self._fitting: _Fitting | None = None

    @property
    def is_stiff(self) -> bool:
        """Whether the arm follows its set-points stiffly."""
        return self._law.is_stiff

    @property
    def stays(self) -> bool:
        """Whether a motion must not end yet, because a force laid over it has not."""
        return self._law.stays

    @property
    def violation(self) -> str:
        """Which limit that stops the motion is exceeded, in words; "" while none is."""
        return self._law.violation

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        return self._law.torque(sensed)

    def superpose(self, torque: Array, action: Superposition) -> None:
        """Add to the motors' torques, shape (7,) [Nm], what an FRI overlay lays on them."""
        if action.tau is not None:
            torque += action.tau
        if action.wrench is not None:
            self._flange.update()
            torque += self._flange.jacobian.T @ action.wrench

    def take(self, order: Order) -> bool:
        """Bring the law of an order's mode into force.

        Returns:
            Whether it takes the place of another one under which the arm yielded: the set-points then have to become
            what it has yielded to, or the new law would pull it back with a jerk.
        """
        mode, yielding = order.mode, not self._law.is_stiff
        if isinstance(mode, JointImpedance):
            if self.retune(mode):
                return False
            self._law, self._fitting = JointSpring(mode.stiffness, mode.damping), None
        elif isinstance(mode, CartesianImpedance | SineImpedance):
            frame = mode.base.frame if isinstance(mode, SineImpedance) else mode.frame
            fitting = (order.tcp, frame, order.axes)
            if fitting == self._fitting and self.retune(mode):
                return False
            axes = None if order.axes is None else rotation(np.array(order.axes))
            self._law = CartesianSpring(mode, self._robot, self._flange, tcp=order.tcp, axes=axes)
            self._fitting = fitting
        else:
            return self.stiffen()
        return yielding

    def guide(self, guide: HandGuide, q: Array, *, tcp: tuple[float, ...], ceiling: float) -> HandLaw:
        """The law for a hand guiding that begins at joints of shape (7,) [rad]; `lead` brings it into force."""
        return HandLaw(guide, self._robot, self._flange, q=q, tcp=tcp, ceiling=ceiling)

    def lead(self, law: HandLaw) -> None:
        """Bring a hand guiding's law into force."""
        self._law, self._fitting = law, None

    def stiffen(self) -> bool:
        """Return to position control; says whether the arm was yielding, as `take` does."""
        if self._law.is_stiff:
            return False
        self._law, self._fitting = PositionLaw(), None
        return True

    def retune(self, mode: Mode) -> bool:
        """Give the law in force other parameters; says whether the mode is of its kind."""
        law = self._law
        if isinstance(law, JointSpring) and isinstance(mode, JointImpedance):
            law.change(mode.stiffness, mode.damping)
        elif isinstance(law, CartesianSpring) and isinstance(mode, CartesianImpedance | SineImpedance):
            law.change(mode)
        else:
            return False
        return True
