"""Jogging: the arm moves while somebody asks for it again and again, and stops when nobody does.

This is the one module of the panel that makes the arm move by hand. A press of a button becomes a stream of `hold`
calls; each is good for `HOLD` seconds. The arm follows a servo stream whose targets are integrated here from a velocity
that rises and falls along a ramp, so that a release, a lost page or a lost network all end the same way.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, LimitError
from heptarm.values.arrays import Array, Value, array
from heptarm.values.frames import BASE, TOOL
from heptarm.values.pose import Pose, multiply

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

#: How long one `hold` is good for [s]: a page sends ten per second, so three may be late.
HOLD = 0.35
#: Largest speeds of jogging, at 100 %: of a joint [rad/s], of the motion frame [m/s] and about it [rad/s].
JOINT_SPEED, LINE_SPEED, TURN_SPEED = 0.5, 0.25, 0.5
#: Ramps of these speeds [rad/s²], [m/s²], [rad/s²].
_JOINT_RAMP, _LINE_RAMP, _TURN_RAMP = 2.0, 0.8, 2.0
#: Rate of the servo stream [Hz].
_RATE = 50.0
#: Ceiling of the joints' speed while the motion frame is jogged, a fraction of their maxima.
_CEILING = 0.5
#: Distance from a joint limit at which jogging stops [rad].
_MARGIN = 0.02
#: The target waits while it is further ahead of the commanded pose than this [m], [rad].
_AHEAD, _AHEAD_TURN = 0.03, 0.12
#: A velocity below this is rest, a fraction of the largest.
_REST = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class JointJog(Value):
    """Turn joints.

    Attributes:
        velocity: shape (7,) [rad/s].

    Raises:
        LimitError: faster than `JOINT_SPEED`.
    """

    velocity: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", array(self.velocity, 7, "velocity"))
        _below(self.velocity, JOINT_SPEED, "velocity", "rad/s")


@dataclass(frozen=True, slots=True, eq=False)
class TwistJog(Value):
    """Move the motion frame along and about axes.

    Attributes:
        twist: velocity [m/s] and angular velocity [rad/s] of the motion frame, shape (6,).
        frame: whose axes: "base", "tool" (the motion frame's own, turning with it), or the name of a frame.

    Raises:
        LimitError: faster than `LINE_SPEED` or `TURN_SPEED`.
    """

    twist: Array
    frame: str = BASE

    def __post_init__(self) -> None:
        object.__setattr__(self, "twist", array(self.twist, 6, "twist"))
        _below(self.twist[:3], LINE_SPEED, "twist", "m/s")
        _below(self.twist[3:], TURN_SPEED, "twist", "rad/s")


@dataclass(frozen=True, slots=True, eq=False)
class PoseJog(Value):
    """Move the motion frame straight towards a pose.

    Attributes:
        pose: the goal in the base frame.
        speed: fraction of `LINE_SPEED` and `TURN_SPEED`, (0, 1].
    """

    pose: Pose
    speed: float = 0.2


Jog: TypeAlias = JointJog | TwistJog | PoseJog


def _below(part: Array, most: float, name: str, unit: str) -> None:
    fastest = float(np.abs(part).max())
    if fastest > most * (1 + 1e-9):
        raise LimitError(
            f"{name} must be in [-{most:g}, {most:g}] {unit}, got {fastest:g} {unit}",
            parameter=name,
            value=fastest,
            allowed=f"[-{most:g}, {most:g}] {unit}",
            hint="choose a lower speed",
        )


class Jogger:
    """Moves one arm while `hold` is called.

    Args:
        arm: the arm; it has to be in control when it is to move.
        on_error: called with the error that ended a movement early, from the jogger's thread.
    """

    def __init__(self, arm: Arm, on_error: Callable[[HeptarmError], None]) -> None:
        self._arm = arm
        self._on_error = on_error
        self._changed = threading.Condition()
        self._jog: Jog | None = None
        self._owner: object = None
        self._held_at = 0.0
        self._is_barred = False
        self._is_closed = False
        self._is_moving = False
        self._thread = threading.Thread(target=self._work, name="heptarm-panel-jog", daemon=True)
        self._thread.start()

    @property
    def is_moving(self) -> bool:
        """Whether the arm follows, or brakes after, a request."""
        return self._is_moving

    def hold(self, jog: Jog, owner: object = None) -> None:
        """Ask for a movement for the next `HOLD` seconds.

        After an error, or a release by another thread, a press has to end before the next one counts.

        Args:
            jog: the movement.
            owner: who asks; nobody else may until the arm rests.

        Raises:
            CommandRejected: somebody else moves the arm.
        """
        now = time.monotonic()
        with self._changed:
            if self._is_barred and owner == self._owner and now - self._held_at < HOLD:
                self._held_at = now
                return
            if self._is_moving and owner != self._owner:
                raise CommandRejected(
                    "another page is moving the arm",
                    parameter="jog",
                    hint="wait until its button is released",
                )
            self._is_barred = False
            self._jog, self._owner, self._held_at = jog, owner, now
            self._changed.notify_all()

    def release(self, owner: object = None) -> None:
        """End the movement now, without waiting until it has ended.

        Args:
            owner: end it only if this one asked for it; None: in any case.
        """
        with self._changed:
            if owner is None or owner == self._owner:
                self._jog = None

    def bar(self) -> None:
        """End the movement, and ignore the button that is still held."""
        with self._changed:
            self._jog, self._is_barred = None, True

    def close(self) -> None:
        """End the movement and the thread; wait until the arm follows no more."""
        with self._changed:
            self._jog, self._is_closed = None, True
            self._changed.notify_all()
        self._thread.join(10.0)

    # --------------------------------------------------------------------------------- the thread

    def _wanted(self, kind: tuple[type[Jog], ...]) -> Jog | None:
        """What is held now; None: nothing, or a movement of another kind."""
        with self._changed:
            if time.monotonic() - self._held_at > HOLD:
                self._jog = None
            return self._jog if isinstance(self._jog, kind) else None

    def _work(self) -> None:
        while True:
            with self._changed:
                self._is_moving = False
                self._changed.wait_for(lambda: self._jog is not None or self._is_closed)
                if self._is_closed:
                    return
                jog, self._is_moving = self._jog, True
            try:
                if isinstance(jog, JointJog):
                    self._turn()
                else:
                    self._drive()
            except HeptarmError as error:
                self.bar()
                self._on_error(error)

    def _turn(self) -> None:
        """Follow the joints' velocity until nobody asks for it and it is zero."""
        robot = self._arm.robot
        low, high = robot.q_min + _MARGIN, robot.q_max - _MARGIN
        with self._arm.servo("joint", rate=_RATE, speed=_CEILING, acceleration=_CEILING) as servo:
            q, velocity = np.array(servo.start.q_cmd), np.zeros(7)
            while (passed := servo.tick()) is not None:
                jog = self._wanted((JointJog,))
                wanted = jog.velocity if isinstance(jog, JointJog) else np.zeros(7)
                room = np.where(wanted > 0, high - q, q - low).clip(0.0)
                braking = np.sqrt(2.0 * _JOINT_RAMP * room)
                velocity = _ramped(velocity, wanted.clip(-braking, braking), _JOINT_RAMP * passed)
                if jog is None and np.abs(velocity).max() < _REST * JOINT_SPEED:
                    servo.set(q)
                    return
                q = q + velocity * passed
                servo.set(q, velocity)

    def _drive(self) -> None:
        """Follow the velocity of the motion frame, or move towards a pose, until nobody asks for it."""
        with self._arm.servo("pose", rate=_RATE, speed=_CEILING, acceleration=_CEILING) as servo:
            target, line, turn = servo.start.pose_cmd, np.zeros(3), np.zeros(3)
            while (passed := servo.tick()) is not None:
                jog = self._wanted((TwistJog, PoseJog))
                if isinstance(jog, TwistJog):
                    axes = target.rotation if jog.frame == TOOL else self._arm.pose(jog.frame).rotation
                    wanted_line, wanted_turn = axes @ jog.twist[:3], axes @ jog.twist[3:]
                elif isinstance(jog, PoseJog):
                    wanted_line, wanted_turn = _towards(jog, target)
                else:
                    wanted_line, wanted_turn = np.zeros(3), np.zeros(3)
                line = _ramped(line, wanted_line, _LINE_RAMP * passed)
                turn = _ramped(turn, wanted_turn, _TURN_RAMP * passed)
                is_slow = (
                    np.linalg.norm(line) < _REST * LINE_SPEED and np.linalg.norm(turn) < _REST * TURN_SPEED
                )
                if jog is None and is_slow:
                    servo.set(target)
                    return
                commanded = self._arm.state.pose_cmd
                if target.distance_to(commanded) < _AHEAD and target.angle_to(commanded) < _AHEAD_TURN:
                    target = Pose(
                        target.xyz + line * passed,
                        multiply(Pose.from_rotvec(np.zeros(3), turn * passed).quat, target.quat),
                    )
                servo.set(target)


def _ramped(velocity: Array, wanted: Array, step: float) -> Array:
    """A velocity one step nearer to the wanted one, along the straight line between them."""
    change = wanted - velocity
    size = float(np.linalg.norm(change))
    return wanted if size <= step else velocity + change * (step / size)


def _towards(jog: PoseJog, target: Pose) -> tuple[Array, Array]:
    """Velocity and angular velocity, base axes, with which a target goes to a pose and stops there."""
    away = jog.pose.xyz - target.xyz
    back = target.quat * np.array([-1.0, -1.0, -1.0, 1.0])
    around = Pose(np.zeros(3), multiply(jog.pose.quat, back)).rotvec
    return (
        _braked(away, jog.speed * LINE_SPEED, _LINE_RAMP),
        _braked(around, jog.speed * TURN_SPEED, _TURN_RAMP),
    )


def _braked(rest: Array, speed: float, ramp: float) -> Array:
    """The velocity along what is left of a path, low enough to stop at its end with half of a ramp."""
    size = float(np.linalg.norm(rest))
    return np.zeros(3) if size < 1e-6 else rest * (min(speed, float(np.sqrt(ramp * size))) / size)
