"""Takeover: a person corrects a policy in the middle of what it does, and hands the arm back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.devices.device import InputDevice
from heptarm.errors import CollisionForeseen, OutsideWorkspace
from heptarm.model.kinematics import forward, jacobian
from heptarm.model.velocity import MARGIN, ElbowTask, VelocityPath, ramped_twist, resolved_twist
from heptarm.skills.teleoperation import SCALE, TURN_SCALE, check_device
from heptarm.values.checks import Array, instance, within, word
from heptarm.values.frames import BASE, FLANGE, TOOL
from heptarm.values.pose import Pose
from heptarm.values.sealed import Sealed

if TYPE_CHECKING:
    from heptarm.arm.motion.servo import TargetServo

#: Ramps of a person's twist [m/s², rad/s²].
_RAMP, _TURN_RAMP = 1.0, 4.0
#: Longest time for which a twist is integrated at once: a late loop is no reason for a jump [s].
_LONGEST_STEP = 0.1
#: Ceiling of the joints' speeds and accelerations, fractions of their maxima.
_JOINT_SPEED, _JOINT_ACCELERATION = 0.5, 0.5


class Takeover(Sealed):
    """A person takes a servo motion over from a policy while a button of a device is held.

    The arm goes on with the velocity that it has, changes to that of the device, and changes back: nothing jumps.
    Recordings flag the time between as corrected.

    Args:
        arm: in control.
        servo: the servo motion whose chunks the arm follows.
        device: a device of `heptarm.devices`, or your own.
        button: that is held for a correction; None: the device's dead-man button; "": any deflection corrects.
        scale: speed at full deflection of one axis [m/s], up to 1.
        turn_scale: angular speed at full deflection of one axis [rad/s], up to 2.
        frame: axes of the motion: "base" or "tool".

    Raises:
        ShapeError: no device.
        LimitError: a value outside its range.
    """

    def __init__(
        self,
        arm: ArmVerbs,
        servo: TargetServo,
        device: InputDevice,
        *,
        button: str | None = None,
        scale: float = SCALE,
        turn_scale: float = TURN_SCALE,
        frame: str = BASE,
    ) -> None:
        self._arm, self._servo, self._device = arm, servo, check_device(device)
        self._robot = arm.robot
        self._button = device.roles.dead_man if button is None else instance(button, str, "button")
        speed = within(scale, "scale", 0.0, 1.0, above=True, unit="m/s")
        turn = within(turn_scale, "turn_scale", 0.0, 2.0, above=True, unit="rad/s")
        self._turns = word(frame, "frame", (BASE, TOOL)) == TOOL
        self._tip = arm.pose(TOOL, reference=FLANGE)
        self._factors = np.repeat([speed, turn], 3)
        self._path: VelocityPath | None = None
        self._elbow: ElbowTask | None = None
        self._twist = np.zeros(6)
        self._last = 0.0

    def corrects(self) -> bool:
        """Read the device; while its button is held, move the arm with it. Call it in every tick.

        Returns:
            Whether the person has the arm: a chunk that is followed now would take it away.

        Raises:
            NotReady: the device is gone; the arm brakes.
        """
        now = self._servo.t
        passed, self._last = min(max(now - self._last, 0.0), _LONGEST_STEP), now
        try:
            seen = self._device.read()
        except BaseException:
            self._servo.hold()
            raise
        holds = self._button in seen.buttons if self._button else bool(seen.twist.any())
        if not holds:
            if self._path is not None:
                self._path = None
                self._servo.hold()
            return False
        path = self._path if self._path is not None else self._begun()
        before = path.q, path.dq
        self._advance(path, self._factors * seen.twist, passed * self._arm.real_time_factor)
        try:
            self._servo.correct(*path.target(self._servo.period))
        except (OutsideWorkspace, CollisionForeseen):
            path.stay_at(before[0])  # at the wall
        return True

    def _begun(self) -> VelocityPath:
        """The path of a correction, from the newest target on with its velocity."""
        robot = self._robot
        q, dq = self._servo.target
        path = self._path = VelocityPath(
            q,
            speed=_JOINT_SPEED * robot.dq_max,
            acceleration=_JOINT_ACCELERATION * robot.ddq_max,
            q_min=robot.q_min + MARGIN,
            q_max=robot.q_max - MARGIN,
        )
        path.dq = dq
        self._elbow = ElbowTask(robot, q)
        self._twist = jacobian(robot, q, self._point(q)) @ dq
        return path

    def _point(self, q: Array) -> Array:
        return (Pose.from_matrix(forward(self._robot, q)) @ self._tip).xyz

    def _advance(self, path: VelocityPath, twist: Array, dt: float) -> None:
        """Move the path on by a time [s], with a twist in the chosen axes."""
        if self._turns:
            axes = (Pose.from_matrix(forward(self._robot, path.q)) @ self._tip).rotation
            twist = np.concatenate([axes @ twist[:3], axes @ twist[3:]])
        self._twist = (
            ramped_twist(self._twist, twist, _RAMP * dt, _TURN_RAMP * dt) if dt > 0.0 else self._twist
        )
        assert self._elbow is not None
        dq, _ = resolved_twist(self._robot, path, self._twist, self._point(path.q), elbow=self._elbow)
        path.advance(dq, dt)
