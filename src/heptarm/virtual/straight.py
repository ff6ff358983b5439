"""Leads the set-points of a servo motion along straight lines in space, as SmartServoLIN does.

From rest the moved frame goes straight to its target and turns in step about one axis. Where a new target lies in
another direction, the way bends into it as fast as the limits allow. The limits hold along each axis of a frame that
rests. Time runs through `advance`, as for the other followers.

Rotations are counted from the orientation at the last target (exponential coordinates), so that speeds and
accelerations of the coordinates are those of the rotation where the count begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin, sqrt

import numpy as np
from ruckig import Synchronization

from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.robot import RobotModel
from heptarm.virtual.order import Order
from heptarm.virtual.otg import Otg
from heptarm.virtual.path import Tip
from heptarm.virtual.planner import CARTESIAN_DEFAULT, ORIENTATION_DEFAULT

#: Over this time [s] the acceleration of a rotation is told from its speed.
_STEP = 1e-5
#: Angles below it [rad] do not tell their axis.
_TINY = 1e-9
#: A speed or acceleration across the way that is smaller than this [m/s, rad/s, ...] is a rounding error.
_ASIDE = 1e-6


@dataclass(frozen=True, slots=True)
class StraightTerms:
    """What a straight servo motion was begun with; x y z, then about x y z, along the axes of a frame that rests.

    Attributes:
        velocity: shape (6,) [m/s, rad/s].
        acceleration: shape (6,) [m/s², rad/s²].
        jerk: shape (6,) [m/s³, rad/s³].
        axes: that frame's axes as columns in the base, shape (3, 3).
        minimum_time: no trajectory to a target is shorter [s].
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    axes: Array
    minimum_time: float

    @staticmethod
    def of(order: Order) -> StraightTerms:
        """Terms of an order; what it does not say is as in a linear motion, and jerk goes with acceleration."""
        fast = np.repeat((CARTESIAN_DEFAULT, ORIENTATION_DEFAULT), 3, axis=0).T
        told = np.full(12, np.nan) if order.straight is None else np.array(order.straight)
        velocity = np.where(np.isnan(told[:6]), fast[0], told[:6])
        acceleration = np.where(np.isnan(told[6:]), fast[1], told[6:])
        axes = np.eye(3) if order.reference is None else rotation(order.reference)
        return StraightTerms(velocity, acceleration, acceleration * fast[2] / fast[1], axes, order.minimum_time)

    @property
    def hardest(self) -> tuple[Array, ...]:
        """Acceleration and jerk of braking: at least those of a linear motion."""
        fast = np.repeat((CARTESIAN_DEFAULT, ORIENTATION_DEFAULT), 3, axis=0).T
        return np.maximum(self.acceleration, fast[1]), np.maximum(self.jerk, fast[2])


class StraightFollower:
    """Follows poses of the moved frame on straight lines.

    Args:
        robot: the robot.
        order: the servo motion.
        here: set-point to begin at, at rest, shape (7,) [rad].

    Attributes:
        resting: time since the target was reached [s]; 0 while it is not.
    """

    def __init__(self, robot: RobotModel, order: Order, here: Array) -> None:
        tcp = Pose.of(order.tcp[:3], order.tcp[3:])
        origin = Pose.from_matrix(forward(robot, here)) @ tcp
        terms = self._terms = StraightTerms.of(order)
        self._tip = Tip(robot, here, tcp)
        self._q = here.copy()
        self._otg = Otg(6, synchronization=Synchronization.Phase, halting=Synchronization.Phase)
        self._place = terms.axes.T @ origin.xyz  # at rest, along the axes of the limits
        self._centre = origin.quat  # orientation that rotations are counted from
        self._stopping = False
        self.resting = 0.0

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s]; NaN without a target."""
        return self._otg.remaining

    def aim(self, goal: Array, dq: Array | None = None) -> None:
        """Take a pose of the moved frame in the base: x y z [m], quaternion x y z w; shape (7,)."""
        if self._stopping:
            return
        place, turn, speed, change = self._state()
        centre = self._turned(turn)
        inward = self._terms.axes.T
        target = np.concatenate([inward @ goal[:3], inward @ _between(centre, goal[3:])])
        way = target - _uncounted(place)
        free = (self._terms.velocity, self._terms.acceleration, self._terms.jerk)
        (velocity, acceleration, jerk), speed, change = _along(way, free, speed, change)
        self._otg.limit(acceleration, jerk, velocity=velocity)
        start = (_uncounted(place), speed, change)
        if self._otg.aim(start, target, speed=np.zeros(6), minimum=self._terms.minimum_time):
            self._centre, self.resting = centre, 0.0

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad].

        Raises:
            Unreachable: the line leaves the workspace.
        """
        if not self._otg.has_begun:
            self.resting += dt
            return self._q
        self._otg.time += dt
        self.resting = max(0.0, self._otg.over)
        place, turn, _, _ = self._state()
        x, y, z = (self._terms.axes @ place).tolist()
        i, j, k, w = self._turned(turn).tolist()
        self._q = self._tip.joints((x, y, z), (i, j, k, w), self._tip.e1, self._q)
        return self._q

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest along the line; ends when `is_still`.

        Args:
            scale: factor on the motion's time so far; from now on it runs at full speed.
            rate: its change per second.
        """
        if self._stopping:
            return
        self._stopping = True
        if not self._otg.has_begun:
            return
        place, turn, speed, change = self._state()
        speed, change = speed * scale, change * scale * scale + speed * rate
        (acceleration, jerk), speed, change = _along(speed, self._terms.hardest, speed, change)
        self._otg.limit(acceleration, jerk)
        centre = self._turned(turn)
        if self._otg.halt((_uncounted(place), speed, change)):
            self._centre = centre

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        return self._stopping and self._otg.over >= 0.0

    def _turned(self, turn: Array) -> Array:
        """Orientation that lies a rotation away from the centre, quaternion."""
        vector = self._terms.axes @ turn
        angle = sqrt(float(vector @ vector))
        if angle < _TINY:
            return self._centre
        return multiply((*(vector * (sin(angle / 2) / angle)).tolist(), cos(angle / 2)), self._centre)

    def _state(self) -> tuple[Array, Array, Array, Array]:
        """Place and rotation from the centre, shape (3,) each; speed and acceleration, shape (6,)."""
        if not self._otg.has_begun:
            return self._place, np.zeros(3), np.zeros(6), np.zeros(6)
        time = self._otg.time
        x, v, a = self._otg.at(time)
        low, high = max(0.0, time - _STEP), time + _STEP
        change = (self._spin(high) - self._spin(low)) / (high - low)
        return (
            x[:3],
            x[3:],
            np.concatenate([v[:3], self._spin(time)]),
            np.concatenate([a[:3], change]),
        )

    def _spin(self, time: float) -> Array:
        """Angular velocity at a time of the plan, shape (3,) [rad/s]."""
        x, v, _ = self._otg.at(time)
        turn, speed = x[3:], v[3:]
        angle = sqrt(float(turn @ turn))
        if angle < 1e-6:
            almost: Array = speed + 0.5 * np.cross(turn, speed)
            return almost
        # left Jacobian of the rotation group, e.g. Sola et al., "A micro Lie theory", 2018, (145)
        once = np.cross(turn, speed)
        twice = np.cross(turn, once)
        spin: Array = speed + (1.0 - cos(angle)) / angle**2 * once + (angle - sin(angle)) / angle**3 * twice
        return spin


def _uncounted(place: Array) -> Array:
    """The coordinates of a place where the rotation is counted from, shape (6,)."""
    return np.concatenate([place, np.zeros(3)])


def _between(start: Array, end: Array) -> Array:
    """Rotation that leads from one orientation to another the shorter way, in the base, shape (3,) [rad]."""
    x, y, z, w = multiply(end, start * (-1.0, -1.0, -1.0, 1.0)).tolist()
    length = sqrt(x * x + y * y + z * z)
    if length < _TINY:
        return np.zeros(3)
    angle = 2.0 * atan2(length, abs(w)) * (1.0 if w >= 0.0 else -1.0)
    return np.array([x, y, z]) * (angle / length)


def _along(
    way: Array, free: tuple[Array, ...], speed: Array, change: Array
) -> tuple[tuple[Array, ...], Array, Array]:
    """Limits for a way, then speed and acceleration.

    If these lie along it, the limits have the ratio of the way itself, so that it is gone straight.
    """
    length = sqrt(float(way @ way))
    if length < _TINY:
        return free, speed, change
    unit = way / length
    straight = (unit * (unit @ speed), unit * (unit @ change))
    if np.abs(speed - straight[0]).max() > _ASIDE or np.abs(change - straight[1]).max() > _ASIDE:
        return free, speed, change
    share = np.maximum(np.abs(unit), _TINY)
    bound = (np.where(share > _TINY, share * float((limit / share).min()), limit) for limit in free)
    return tuple(bound), *straight
