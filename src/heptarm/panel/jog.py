"""Jogging: the arm moves while somebody asks for it again and again, and stops when nobody does.

This is the one module of the panel that makes the arm move by hand. A press of a button becomes a stream of `hold`
calls; each is good for `HOLD` seconds. The arm follows a stream of velocities, which ramps, brakes before limits, and
falls to zero by itself; so a release, a lost page and a lost network all end in the same manner.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, LimitError
from heptarm.values.checks import Array, Value, array
from heptarm.values.frames import BASE
from heptarm.values.pose import Pose

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

#: How long one `hold` is good for [s]: a page sends ten per second, so three may be late.
HOLD = 0.35
#: Largest speeds of jogging, at 100 %: of a joint [rad/s], of the motion frame [m/s] and about it [rad/s].
JOINT_SPEED, LINE_SPEED, TURN_SPEED = 0.5, 0.25, 0.5
#: Accelerations of the motion frame [m/s²], [rad/s²], and of the joints, a fraction of each axis' maximum.
_LINE_RAMP, _TURN_RAMP, _JOINT_RAMP = 1.0, 3.0, 0.5
#: Velocities per second that are set [Hz].
_RATE = 50.0
#: Ceiling of the joints' speeds, a fraction of their maxima.
_CEILING = 0.5
#: On the last piece to a pose the speed is the distance that is left times this [1/s].
_GAIN = 3.0
#: Largest product of that factor and the age of the pose it is computed from: with less than 1/e the arm does not go
#: beyond its goal (the step response of an integrator with a delay in its loop).
_GAIN_TIMES_AGE = 0.3


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
        self._slowed = ""
        self._thread = threading.Thread(target=self._work, name="heptarm-panel-jog", daemon=True)
        self._thread.start()

    @property
    def is_moving(self) -> bool:
        """Whether the arm follows, or brakes after, a request."""
        return self._is_moving

    @property
    def slowed(self) -> str:
        """Why the arm is slower than asked for, such as "limit of A4"; empty: it is not."""
        return self._slowed

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
            self._is_barred = self._is_barred or self._jog is not None
            self._jog = None

    def close(self) -> None:
        """End the movement and the thread; wait until the arm follows no more."""
        with self._changed:
            self._jog, self._is_closed = None, True
            self._changed.notify_all()
        self._thread.join(10.0)

    # --------------------------------------------------------------------------------- the thread

    def _wanted(self, axes: str | None) -> Jog | None:
        """What is held now; None: nothing, or a movement along other axes.

        Args:
            axes: frame whose axes are meant; None: the joints.
        """
        with self._changed:
            if time.monotonic() - self._held_at > HOLD:
                self._jog = None
            return self._jog if self._jog is not None and _axes(self._jog) == axes else None

    def _work(self) -> None:
        while True:
            with self._changed:
                self._is_moving, self._slowed = False, ""
                self._changed.wait_for(lambda: self._jog is not None or self._is_closed)
                if self._is_closed or self._jog is None:
                    return
                axes, self._is_moving = _axes(self._jog), True
            try:
                if axes is None:
                    self._turn()
                else:
                    self._drive(axes)
            except HeptarmError as error:
                self.bar()
                self._on_error(error)

    def _turn(self) -> None:
        """Let the joints turn until nobody asks for it."""
        with self._arm.servo(
            "velocity", rate=_RATE, timeout=HOLD, speed=_CEILING, acceleration=_JOINT_RAMP
        ) as servo:
            while servo.tick() is not None and isinstance(jog := self._wanted(None), JointJog):
                servo.set(jog.velocity)
                self._slowed = servo.stats.slowdown.reason

    def _drive(self, axes: str) -> None:
        """Move the motion frame until nobody asks for it."""
        with self._arm.servo(
            "twist",
            frame=axes,
            rate=_RATE,
            timeout=HOLD,
            speed=_CEILING,
            acceleration=_JOINT_RAMP,
            speed_mps=LINE_SPEED,
            acceleration_mps2=_LINE_RAMP,
            speed_radps=TURN_SPEED,
            acceleration_radps2=_TURN_RAMP,
        ) as servo:
            while servo.tick() is not None:
                jog = self._wanted(axes)
                if isinstance(jog, TwistJog):
                    servo.set(jog.twist)
                elif isinstance(jog, PoseJog):
                    state = self._arm.state
                    age = state.age * self._arm.real_time_factor
                    servo.set(towards(jog, state.pose, age))
                else:
                    return
                self._slowed = servo.stats.slowdown.reason


def _axes(jog: Jog) -> str | None:
    """The frame whose axes a movement has; None: it is one of the joints."""
    return None if isinstance(jog, JointJog) else jog.frame if isinstance(jog, TwistJog) else BASE


def towards(jog: PoseJog, pose: Pose, age: float) -> Array:
    """The twist, base axes, with which a pose of an age [s] goes to that of a movement and stops there, shape (6,)."""
    gain = min(_GAIN, _GAIN_TIMES_AGE / max(age, 1e-3))
    left = pose.displacement(jog.pose)
    return np.concatenate(
        [_slowed(left[:3], jog.speed * LINE_SPEED, gain), _slowed(left[3:], jog.speed * TURN_SPEED, gain)]
    )


def _slowed(left: Array, speed: float, gain: float) -> Array:
    """The velocity along what is left of a path, slower at its end: the distance that is left times a gain [1/s]."""
    size = float(np.linalg.norm(left))
    return np.zeros(3) if size < 1e-6 else left * (min(speed, gain * size) / size)
