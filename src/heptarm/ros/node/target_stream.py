"""Servo topics: the first target opens a servo motion, and the cabinet's watchdog ends it when targets stop."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.jog import BELOW_CEILING, lag
from heptarm.arm.motion.servo import JointServo, PoseServo
from heptarm.errors import HeptarmError, NotReady
from heptarm.io.clock import RealClock
from heptarm.model.kinematics import forward
from heptarm.model.velocity import MARGIN, Elbow, ElbowTask, VelocityPath, limited_twist, resolved_twist
from heptarm.ros.trajectory.servo_execution import ServoOptions
from heptarm.values.checks import Array, array
from heptarm.values.condition.condition import Condition
from heptarm.values.frames import TOOL
from heptarm.values.pose import Pose
from heptarm.values.result import Cause

_log = logging.getLogger("heptarm.ros")

#: A velocity command becomes a target this far ahead [s]; the cabinet keeps the velocity of a target for longer, and
#: then takes a while to brake.
_AHEAD, _KEPT = 0.05, 0.2
#: The first velocity command counts as if the one before had come so long ago [s].
_FIRST = 0.02


@dataclass(frozen=True, slots=True)
class StreamLimits:
    """Limits of a servo motion that replace those of the parameters.

    Attributes:
        speed: of the joints, a fraction of each axis' maximum in (0, 1].
        acceleration: likewise.
        line_speed: along each axis of the base on straight lines [m/s].
        turn_speed: about each axis of the base on straight lines [rad/s].
    """

    speed: float
    acceleration: float
    line_speed: float
    turn_speed: float


class TargetStream:
    """Follows targets one by one; the cabinet's own watchdog brakes the arm when they stop.

    Args:
        arm: in control.
        timeout: the arm brakes if no target arrives for this time [s].
        options: speed and acceleration limits.
        shortest: trajectory to a target without a velocity [s]: gaps between targets that are shorter do not show in
            the speed of the arm, and it lags the more the longer this is.
        line_speed: along each axis of the base on straight lines, and of twists [m/s].
        turn_speed: of twists [rad/s].
        elbow: of twists and poses, see `Arm.servo`.
        posture: instead of `elbow`, shape (7,) [rad]; see `Arm.servo`.

    Raises:
        LimitError: the posture is outside the limits of the joints.
    """

    def __init__(
        self,
        arm: Arm,
        *,
        timeout: float,
        options: ServoOptions,
        shortest: float,
        line_speed: float = 0.25,
        turn_speed: float = 0.5,
        elbow: Elbow = "keep",
        posture: Array | None = None,
    ) -> None:
        if posture is not None:
            arm.robot.check(posture, "posture")
        self._arm = arm
        self._timeout = timeout
        self._options, self._shortest = options, shortest
        self._line_speed, self._turn_speed, self._elbow = line_speed, turn_speed, elbow
        self._posture = posture
        self._clock = RealClock()
        self._lock = threading.RLock()
        self._servo: JointServo | PoseServo | None = None
        self._path: VelocityPath | None = None  # of the velocities of the open servo motion
        self._task: ElbowTask | None = None  # of its twists
        self._last = 0
        self._guard: Condition | None = None
        self._blocked = ""  # what ended the last servo motion; setting a guard clears it
        self._quiet = threading.Lock()  # of `_held_off`; never held while something is sent
        #: When the last target came after `hold_off` [ns]; None: all are followed.
        self._held_off: int | None = None
        self._opened: dict[str, Any] = {}  # how the open servo motion was opened
        self._again: Callable[[], object] | None = None  # sends the newest target again

    @property
    def guard(self) -> Condition | None:
        """Condition that ends servo motions; setting one re-enables following after it has fired."""
        return self._guard

    @guard.setter
    def guard(self, value: Condition | None) -> None:
        with self._lock:
            self._guard, self._blocked = value, ""

    def block(self, reason: str) -> None:
        """Follow no more targets until a guard is set again; does not wait for the lock."""
        self._blocked = reason

    def hold_off(self) -> None:
        """Follow no targets until none has come for the timeout; does not wait for the lock.

        The sender of a stream goes on after a stop; its next target must not move the arm again.
        """
        with self._quiet:
            self._held_off = self._clock.nanos()

    def admit(self) -> None:
        """Take note of a target.

        Raises:
            NotReady: the stream is held off, and there was no silence since.
        """
        with self._quiet:
            now, last = self._clock.nanos(), self._held_off
            if last is None:
                return
            if (now - last) * 1e-9 > self._timeout:
                self._held_off = None
                return
            self._held_off = now
        raise self._refusal()

    def _refusal(self) -> NotReady:
        return NotReady(
            "the arm was stopped, and messages came all the time since",
            hint=f"publish nothing for {self._timeout:g} s (command_timeout), then begin again",
        )

    @property
    def active(self) -> bool:
        """Whether a servo motion is open."""
        servo = self._servo
        return servo is not None and servo.active

    def joints(self, q: Array, dq: Array | None = None, *, limits: StreamLimits | None = None) -> Array:
        """Follow joint positions, shape (7,) [rad], passed with `dq` [rad/s].

        Returns:
            The positions sent, inside the limits of the joints, shape (7,) [rad].
        """
        with self._lock:
            self.admit()
            target = array(q, 7, "position")
            velocity = None if dq is None else array(dq, 7, "velocity")
            servo = self._joint_servo(limits, shortest=self._shortest if velocity is None else None)
            sent = servo.set(target, velocity)
            self._again = lambda: servo.set(target, velocity)
            self._path = None
            return sent

    def velocity(self, dq: Array) -> None:
        """Move with joint velocities, shape (7,) [rad/s], slowed down in step to the limits of the robot."""
        command = array(dq, 7, "velocity")
        self._move(lambda _: command)
        self._task = None

    def twist(self, twist: Array, frame: Literal["base", "flange", "tool"] = "base") -> None:
        """Move with a Cartesian velocity, scaled down to the limits; it slows down near singularities and joint limits.

        Args:
            twist: velocity and angular velocity of the origin of the flange, of the tool if that is the frame, shape
                (6,) [m/s, rad/s].
            frame: its axes.
        """
        robot = self._arm.robot
        wanted = limited_twist(array(twist, 6, "twist"), self._line_speed, self._turn_speed)

        def command(path: VelocityPath) -> Array:
            flange = forward(robot, path.q)
            turn, point = np.eye(3), None
            if frame == "flange":
                turn = flange[:3, :3]
            elif frame == "tool":
                state = self._arm.state
                offset = np.linalg.inv(forward(robot, state.q)) @ state.pose.matrix
                tool = flange @ offset
                turn, point = tool[:3, :3], tool[:3, 3]
            axes = np.concatenate([turn @ wanted[:3], turn @ wanted[3:]])
            if self._task is None:
                self._task = ElbowTask(robot, path.q, elbow=self._elbow, posture=self._posture)
            return resolved_twist(robot, path, axes, point, elbow=self._task)[0]

        self._move(command)

    def _move(self, command_at: Callable[[VelocityPath], Array]) -> None:
        """Move with the joint velocities [rad/s] that a function returns for the path so far."""
        with self._lock:
            self.admit()
            robot, options, connection = self._arm.robot, self._options, self._arm.connection
            before = self._servo
            servo = self._joint_servo()
            now = self._clock.nanos()
            if servo is not before or self._path is None:
                self._path = VelocityPath(
                    self._arm.state.q if servo is before else servo.start.q,
                    speed=BELOW_CEILING * min(options.speed, self._arm.speed) * robot.dq_max,
                    acceleration=options.acceleration * robot.ddq_max,
                    q_min=robot.q_min + MARGIN,
                    q_max=robot.q_max - MARGIN,
                    reaction=_AHEAD + _KEPT,
                )
                self._task = None
                self._last = now - round(_FIRST * 1e9)
            path, rate = self._path, connection.real_time_factor
            passed = min((now - self._last) * 1e-9, self._timeout) * rate
            self._last = now
            dq = command_at(path)
            behind = lag(path, dq, connection.newest(), now=now, rate=rate)
            path.advance(dq, passed, [] if behind is None else [behind])
            servo.set(*path.target(_AHEAD))
            self._again = None

    def pose(
        self,
        pose: Pose,
        *,
        straight: bool = False,
        moving: str = TOOL,
        limits: StreamLimits | None = None,
    ) -> Pose:
        """Follow a pose of the motion frame in the base, on straight lines or by interpolating joints.

        Args:
            pose: the target.
            straight: move on straight lines.
            moving: the motion frame, see `Arm.servo`.
            limits: None: those of the parameters.

        Returns:
            The pose sent, inside the workspace.
        """
        kind: Literal["pose", "lin"] = "lin" if straight else "pose"
        with self._lock:
            self.admit()
            settings = self._settings_of(kind, limits) | {"moving": moving}
            servo = self._servo
            if not isinstance(servo, PoseServo) or not servo.active or self._opened != settings:
                self._prepare()
                servo = self._servo = self._arm.servo(kind, until=self._guard, **settings).__enter__()
                self._opened = settings
                self._check_opened()
            sent = servo.set(pose)
            opened = servo
            self._again = lambda: opened.set(pose)
            return sent

    def repeat(self) -> bool:
        """Send the newest target again, so that the arm goes on to it.

        Returns:
            False: its servo motion has ended, or velocities have replaced it.
        """
        with self._lock:
            if self._again is None or not self.active or self._held_off is not None:
                self._again = None
                return False
            self._again()
            return True

    def close(self) -> None:
        """End the servo motion at rest; if it ended earlier, log why."""
        with self._lock:
            servo, self._servo, self._again = self._servo, None, None
            if servo is not None:
                try:
                    servo.close()
                except HeptarmError as error:
                    _log.info("servo topic ended: %s", error)
                result = servo.result
                if result is not None and result.cause is Cause.CONDITION:
                    self._blocked = "the guard" if result.stopped_by is None else str(result.stopped_by)

    def _joint_servo(
        self, limits: StreamLimits | None = None, *, shortest: float | None = None
    ) -> JointServo:
        servo = self._servo
        settings = self._settings_of("joint", limits) | {"min_trajectory_time": shortest}
        if not isinstance(servo, JointServo) or not servo.active or self._opened != settings:
            self._prepare()
            servo = self._servo = self._arm.servo("joint", until=self._guard, **settings).__enter__()
            self._opened = settings
            self._check_opened()
        return servo

    def _prepare(self) -> None:
        """End the last servo motion.

        Raises:
            NotReady: the guard has fired and was not set again.
        """
        self.close()
        if self._blocked:
            raise NotReady(
                f"servo topics are blocked: {self._blocked}", hint="set the guard again, or an empty one"
            )

    def _check_opened(self) -> None:
        """End a servo motion that has just opened, if a stop came in the meantime: the cabinet may not have seen it.

        Raises:
            NotReady: a stop came.
        """
        if self._held_off is not None:
            self.close()
            raise self._refusal()

    def _settings_of(self, kind: str, limits: StreamLimits | None) -> dict[str, Any]:
        """Settings of a servo motion: on straight lines ("lin") the limits hold along the path."""
        options = self._options
        settings: dict[str, Any] = {
            "rate": max(options.rate, 1.0 / self._timeout),
            "watchdog": self._timeout,
            "mode": options.mode,
        }
        if kind == "pose":
            settings["min_trajectory_time"] = self._shortest
            settings |= {"elbow": self._elbow} if self._posture is None else {"posture": self._posture}
        if kind != "lin":
            chosen = options if limits is None else limits
            return settings | {"engine": "smart", "speed": chosen.speed, "acceleration": chosen.acceleration}
        if limits is None:
            return settings | {"speed_mps": self._line_speed}
        return settings | {"speed_mps": limits.line_speed, "speed_radps": limits.turn_speed}
