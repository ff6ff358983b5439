"""Leads the set-points of a servo motion: the newest target wins, and every limit holds.

`SmartFollower` plans a limited trajectory to each target anew, as SmartServo does; `DirectFollower` goes straight
for it, as DirectServo does, which suits targets that are close and smooth; `heptarm.virtual.straight` has the one
that leads along lines in space. Time runs through `advance`, so the override and pausing slow a servo motion as they
slow every other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ruckig import Synchronization

from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.order import Order
from heptarm.virtual.otg import Otg, State
from heptarm.virtual.straight import StraightFollower

#: The last approach of a direct follower is an exponential one with this time constant [s].
APPROACH = 0.01
#: A target's velocity may not use all of the axis' speed: Ruckig needs a little room to come to it.
ROOM = 0.999


@dataclass(frozen=True, slots=True)
class ServoTerms:
    """What a servo motion was begun with.

    Attributes:
        velocity: largest speed of each axis, shape (7,) [rad/s].
        acceleration: shape (7,) [rad/s²].
        jerk: shape (7,) [rad/s³].
        minimum_time: no trajectory to a target is shorter [s].
        speed_timeout: how long a target's velocity is kept after it was passed [s].
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    minimum_time: float
    speed_timeout: float

    @staticmethod
    def of(
        robot: RobotModel,
        *,
        velocity: tuple[float, ...],
        acceleration: tuple[float, ...],
        minimum_time: float = 0.02,
        speed_timeout: float = 0.1,
    ) -> ServoTerms:
        """Terms from fractions of a robot's limits, seven each; jerk goes with acceleration."""
        return ServoTerms(
            np.array(velocity) * robot.dq_max,
            np.array(acceleration) * robot.ddq_max,
            np.array(acceleration) * robot.dddq_max,
            minimum_time,
            speed_timeout,
        )


class SmartFollower:
    """Follows targets with a velocity-, acceleration- and jerk-limited trajectory to each.

    Args:
        terms: limits and times.
        here: set-point to begin at, at rest, shape (7,) [rad].

    Attributes:
        resting: time since the target was reached [s]; 0 while it is not.
    """

    def __init__(self, terms: ServoTerms, here: Array) -> None:
        self._terms = terms
        self._otg = Otg(7, synchronization=Synchronization.Time, halting=Synchronization.No)
        self._otg.limit(terms.acceleration, terms.jerk, velocity=terms.velocity)
        self._still = here.copy()
        self._passes = False
        self._stopping = False
        self.resting = 0.0

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s]; NaN without a target."""
        return self._otg.remaining

    def aim(self, q: Array, dq: Array | None = None) -> None:
        """Take a target, shape (7,) [rad], and the velocity to pass it at [rad/s]."""
        if self._stopping:
            return
        pass_at = (
            np.zeros(7)
            if dq is None
            else np.clip(dq, -ROOM * self._terms.velocity, ROOM * self._terms.velocity)
        )
        if self._otg.aim(self._state(), q, speed=pass_at, minimum=self._terms.minimum_time):
            self._passes = bool(pass_at.any())
            self.resting = 0.0

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad]."""
        if not self._otg.has_begun:
            self.resting += dt
            return self._still
        self._otg.time += dt
        over = self._otg.over
        if over >= 0.0:
            if self._passes and over > self._terms.speed_timeout:
                self._halt(self._state())
            elif not self._passes:
                self.resting = over
        return self._state()[0]

    def brake(self, *, scale: float, rate: float, speed: Array | None = None) -> None:
        """Come to rest as fast as the axes may, whatever the targets say; ends when `is_still`.

        Args:
            scale: factor on the motion's time so far; from now on it runs at full speed.
            rate: its change per second.
            speed: velocity instead of the planned one, shape (7,) [rad/s].
        """
        if self._stopping:
            return
        q, dq, ddq = self._state()
        if speed is not None:
            dq = speed
        limit = self._terms.acceleration  # beyond it, braking would end in a swing backwards
        self._halt((q, dq * scale, np.clip(ddq * scale * scale + dq * rate, -limit, limit)))
        self._stopping = True

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        return self._stopping and self._otg.over >= 0.0

    def _halt(self, state: State) -> None:
        self._passes = False
        self._otg.halt(state)

    def _state(self) -> State:
        if self._otg.has_begun:
            return self._otg.at(self._otg.time)
        return self._still, np.zeros(7), np.zeros(7)


class DirectFollower:
    """Follows targets at once, within velocity and acceleration limits only; the same face as `SmartFollower`."""

    def __init__(self, terms: ServoTerms, here: Array) -> None:
        self._terms = terms
        self._q = here.copy()
        self._dq = np.zeros(7)
        self._target = here.copy()
        self._left = 0.0
        self._brake: SmartFollower | None = None
        self.resting = 0.0

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s], about."""
        return self._left

    def aim(self, q: Array, dq: Array | None = None) -> None:
        """Take a target, shape (7,) [rad]; its velocity is what the next targets make of it."""
        self._target = q.copy()
        way = float((np.abs(q - self._q) / self._terms.velocity).max())
        self._left = max(self._terms.minimum_time, way)
        self.resting = 0.0

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad]."""
        if self._brake is not None:
            return self._brake.advance(dt)
        if dt <= 0.0:
            return self._q
        terms, way = self._terms, self._target - self._q
        wanted = way / max(self._left, APPROACH)
        ceiling = np.minimum(terms.velocity, np.sqrt(2.0 * terms.acceleration * np.abs(way)))
        wanted = np.clip(wanted, -ceiling, ceiling)
        self._dq = self._dq + np.clip(wanted - self._dq, -terms.acceleration * dt, terms.acceleration * dt)
        self._q = self._q + self._dq * dt
        self._left = max(0.0, self._left - dt)
        self.resting = self.resting + dt if self._left == 0.0 else 0.0
        return self._q

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest as fast as the axes may."""
        if self._brake is None:
            self._brake = SmartFollower(self._terms, self._q)
            self._brake.brake(scale=1.0, rate=0.0, speed=self._dq * scale)

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        return self._brake is not None and self._brake.is_still


Follower = SmartFollower | DirectFollower | StraightFollower


def follower(robot: RobotModel, order: Order, here: Array) -> Follower:
    """What follows the targets of a servo motion that begins at rest, at a set-point of shape (7,) [rad]."""
    if order.kind == "straight":
        return StraightFollower(robot, order, here)
    terms = ServoTerms.of(
        robot,
        velocity=order.joint_velocity,
        acceleration=order.joint_acceleration,
        minimum_time=order.minimum_time,
        speed_timeout=order.speed_timeout,
    )
    return (DirectFollower if order.kind == "direct" else SmartFollower)(terms, here)
