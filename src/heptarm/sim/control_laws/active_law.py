"""The control law in force, and its replacement when the control mode changes."""

from __future__ import annotations

import mujoco
import numpy as np

from heptarm.planning.seam import HandGuide
from heptarm.sim.control_laws.cartesian_impedance import CartesianImpedanceLaw, FlangeKinematics
from heptarm.sim.control_laws.hand_guiding_law import HandGuidingLaw
from heptarm.sim.control_laws.laws import (
    GAINS,
    ControlLaw,
    JointImpedanceLaw,
    MeasuredState,
    PositionLaw,
    Superposition,
)
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import rotation
from heptarm.values.robot import RobotModel

#: Flange to tool frame, axes of the mode's frame: fixed for a Cartesian impedance law.
_Frames = tuple[tuple[float, ...], str, tuple[float, ...] | None]


class ActiveLaw:
    """The control law in force.

    Args:
        robot: the robot.
        model: MuJoCo's model; its first seven joints are the arm's.
        data: its state.
        gains: of position control, see `position_gains`.
    """

    def __init__(
        self, robot: RobotModel, model: mujoco.MjModel, data: mujoco.MjData, *, gains: Array = GAINS
    ) -> None:
        self._robot, self._gains = robot, gains
        self._flange = FlangeKinematics(model, data)
        self._law: ControlLaw = PositionLaw(gains=gains)
        self._frames: _Frames | None = None

    @property
    def is_stiff(self) -> bool:
        """Whether the arm tracks its set-points closely."""
        return self._law.is_stiff

    @property
    def is_plain(self) -> bool:
        """Whether the law is position control without anything left of a preload."""
        return self._law.is_plain

    @property
    def stays(self) -> bool:
        """Whether a motion must not end yet, because its overlaid force has not ended."""
        return self._law.stays

    @property
    def violation(self) -> str:
        """Text of the exceeded limit that stops the motion; "" while there is none."""
        return self._law.violation

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        return self._law.torque(sensed)

    def superpose(self, torque: Array, action: Superposition) -> None:
        """Add the load of an FRI overlay to the motors' torques, shape (7,) [Nm]."""
        if action.tau is not None:
            torque += action.tau
        if action.wrench is not None:
            self._flange.update()
            torque += self._flange.jacobian.T @ action.wrench

    def take(self, mode: Mode | None, *, tcp: tuple[float, ...], axes: tuple[float, ...] | None) -> bool:
        """Switch to the law of a command's control mode.

        Args:
            mode: the mode; None: position control.
            tcp: flange to motion frame, x y z [m], quaternion.
            axes: of the mode's frame as a quaternion in the base; None: as in the mode.

        Returns:
            Whether it replaces a law under which the arm was compliant: the set-points then have to be reset to the
            measured position, or the new law would pull the arm back with a jerk.
        """
        was_compliant = not self._law.is_stiff
        if isinstance(mode, JointImpedance):
            if self.retune(mode):
                return False
            law = JointImpedanceLaw(self._robot, self._flange, mode.stiffness, mode.damping, tcp=tcp[:3])
            self._law, self._frames = law, None
        elif isinstance(mode, CartesianImpedance | SineImpedance):
            frame = mode.base.frame if isinstance(mode, SineImpedance) else mode.frame
            frames = (tcp, frame, axes)
            if frames == self._frames and self.retune(mode):
                return False
            turned = None if axes is None else rotation(np.array(axes))
            self._law = CartesianImpedanceLaw(mode, self._robot, self._flange, tcp=tcp, axes=turned)
            self._frames = frames
        else:
            return self.stiffen()
        return was_compliant

    def guide(self, guide: HandGuide, q: Array, *, tcp: tuple[float, ...], ceiling: float) -> HandGuidingLaw:
        """The law for a hand guiding that begins at joints of shape (7,) [rad]; `follow_hand` switches to it."""
        return HandGuidingLaw(guide, self._robot, self._flange, q=q, tcp=tcp, ceiling=ceiling)

    def follow_hand(self, law: HandGuidingLaw) -> None:
        """Switch to the law of a hand guiding."""
        self._law, self._frames = law, None

    def stiffen(self) -> bool:
        """Switch to position control; returns whether the arm was compliant, as `take` does."""
        if self._law.is_stiff:
            return False
        self._law, self._frames = PositionLaw(gains=self._gains), None
        return True

    def take_over(self, law: PositionLaw) -> None:
        """Continue with position control where the brakes have held the arm."""
        self._law, self._frames = law, None

    def retune(self, mode: Mode) -> bool:
        """Change the parameters of the law in force; returns whether the mode is of its kind."""
        law = self._law
        if isinstance(law, JointImpedanceLaw) and isinstance(mode, JointImpedance):
            law.change(mode.stiffness, mode.damping)
        elif isinstance(law, CartesianImpedanceLaw) and isinstance(mode, CartesianImpedance | SineImpedance):
            law.change(mode)
        else:
            return False
        return True
