"""Joint velocities of a stream of velocities: twists to joints, and every limit on the way to positions.

Twists become joint velocities by damped least squares, and an `ElbowTask` uses the redundant joint. `VelocityPath`
integrates velocities to positions, so that no joint is too fast, accelerates too hard, or cannot brake before its
limit; where it has to be slower than commanded, the direction stays and a `Slowdown` has the reason. Poses become joint
positions in the same manner. Without arm, loop or clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, tau
from typing import Literal, TypeAlias

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.inverse_kinematics import arm_angle, solve
from heptarm.model.kinematics import jacobian
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

#: What the elbow does in a stream: see `ElbowTask`.
Elbow: TypeAlias = Literal["keep", "center"]
ELBOWS: tuple[Elbow, ...] = ("keep", "center")

#: Smallest singular value of the Jacobian below which the damping sets in, and its largest value.
_SINGULAR, _DAMPING = 0.08, 0.1
#: Below it the motion of the elbow is not determined.
_UNDEFINED = 1e-4
#: The elbow comes to where it is to be by this fraction of what is left per time [1/s], with "keep" at most so many
#: times as fast as the fastest joint.
_GAIN, _BACK = 4.0, 1.0
#: Derivative of the arm angle by a motion of the joints below which it is damped, and the step of difference quotients
#: [rad].
_FLAT, _STEP = 0.1, 1e-6
#: Of a pose: most steps of the elbow, the smallest one [rad], and the joint movement per step that shows that it led
#: astray.
_ROUNDS, _STILL, _ASTRAY = 3, 1e-7, 3.0
#: With "keep" the elbow moves at most so many times as far as the joints do for the pose.
_AS_FAR = 3.0
#: Largest place of a joint in its range, -1 to 1, at which the distance to the limits counts.
_BRINK = 0.999
#: Distance that velocities leave to a joint limit, and straight lines to poses [rad].
MARGIN, NEAREST = 0.01, 1e-3
#: Fraction of the acceleration with which braking before a limit is planned; the rest is for following that plan.
_PLANNED = 0.5
#: Parts of a joint motion that are this small do not move the joint, and a velocity that is left this part of is none.
_STUCK, _BLOCKED = 1e-6, 1e-3
#: Velocities below this are none [rad/s, m/s].
_TINY = 1e-9
#: Approach of a wall: the velocity is at most this multiple of the distance [1/s], so that it ends without overshoot.
_APPROACH = 5.0


@dataclass(frozen=True, slots=True)
class Slowdown:
    """Why the arm is slower than commanded.

    Attributes:
        reason: such as "singularity", "limit of A4", "workspace", "near table".
        factor: the velocity is the commanded one times this, 0 to 1.
    """

    reason: str
    factor: float

    def __str__(self) -> str:
        """In words."""
        return f"{self.factor:.0%} of the commanded speed: {self.reason}"


#: Nothing slows the arm down.
FREE = Slowdown("", 1.0)


class ElbowTask:
    """What the elbow does in a stream of twists or poses: the joint motion that leaves the flange where it is.

    Args:
        robot: the robot.
        q: joint positions at the start of the stream, shape (7,) [rad].
        elbow: "keep": the arm angle stays that of the start; "center": the joints stay away from their limits.
        posture: the joints stay as near as they can to these positions, shape (7,) [rad]; None: no posture. It takes
            the place of `elbow`.
    """

    def __init__(
        self, robot: RobotModel, q: Array, *, elbow: Elbow = "keep", posture: Array | None = None
    ) -> None:
        self._robot, self._posture = robot, posture
        self._keeps = posture is None and elbow == "keep"
        self._middle, self._half = 0.5 * (robot.q_max + robot.q_min), 0.5 * (robot.q_max - robot.q_min)
        self._start = self._last = arm_angle(robot, q)

    def rate(self, q: Array, dq: Array, null: Array, *, idle: bool = False) -> float:
        """Wanted velocity along a joint motion that leaves the flange where it is [rad/s].

        Args:
            q: joint positions, shape (7,) [rad].
            dq: joint velocities of the twist, shape (7,) [rad/s].
            null: that motion, of length 1, shape (7,).
            idle: nobody commands anything: the elbow rests as well.
        """
        if self._keeps:
            return self._kept(q, dq, null)
        return 0.0 if idle else _GAIN * self._left(q, null)

    def step(self, q: Array, null: Array, *, moved: float, reach: float) -> float:
        """Distance along a joint motion that leaves the flange where it is, towards where the elbow is to be [rad].

        Args:
            q: joint positions, shape (7,) [rad].
            null: that motion, of length 1, shape (7,).
            moved: by how much the joints move otherwise [rad]: "keep" goes no more than some times as far.
            reach: the largest distance [rad].
        """
        if self._keeps:
            most = min(_AS_FAR * moved, reach)
            wanted = -_divided(self._error(q), self._slope(q, null))
        else:
            most, wanted = reach, self._left(q, null)
        return float(np.clip(wanted, -most, most))

    def _left(self, q: Array, null: Array) -> float:
        """Distance along a motion to the posture, or to the middle of the joints' ranges [rad]: a step of Newton's."""
        if self._posture is not None:
            return float(null @ (self._posture - q))
        # sum of 1 / (1 - x²): Chan and Dubey, "A weighted least-norm solution based scheme for avoiding joint limits
        # for redundant joint manipulators", 1995
        x = np.clip((q - self._middle) / self._half, -_BRINK, _BRINK)
        room = 1.0 - x * x
        slope = 2.0 * x / (room**2 * self._half)
        bend = 2.0 * (1.0 + 3.0 * x * x) / (room**3 * self._half**2)
        return -float(null @ slope) / float(null**2 @ bend)

    def _kept(self, q: Array, dq: Array, null: Array) -> float:
        """Velocity that keeps the arm angle, and brings it back no faster than the joints move for the twist."""
        fastest = float(np.abs(dq).max())
        if fastest < _TINY:
            return 0.0
        error = self._error(q)
        back = float(np.clip(_GAIN * error, -_BACK * fastest, _BACK * fastest))
        return -_divided(self._slope(q, dq / fastest) * fastest + back, self._slope(q, null))

    def _error(self, q: Array) -> float:
        """The arm angle relative to that of the start [rad]."""
        self._last = self._angle(q)
        return _wrapped(self._last - self._start)

    def _slope(self, q: Array, direction: Array) -> float:
        """Derivative of the last arm angle, that of `_error`, along a direction, shape (7,)."""
        return _wrapped(self._angle(q + _STEP * direction) - self._last) / _STEP

    def _angle(self, q: Array) -> float:
        """The arm angle next to the last one [rad]."""
        angle = arm_angle(self._robot, q)
        # what it is measured from turns over where the Status changes, and the arm does not
        return angle if abs(_wrapped(angle - self._last)) < 0.5 * pi else angle + pi


def _wrapped(angle: float) -> float:
    return (angle + pi) % tau - pi


def _divided(value: float, slope: float) -> float:
    """The quotient, smaller where the slope is too small for it."""
    near = max(0.0, 1.0 - (slope / _FLAT) ** 2)
    return value * slope / (slope * slope + near * _FLAT**2)


def joint_velocity(robot: RobotModel, q: Array, twist: Array, point: Array | None = None) -> Array:
    """Joint velocities for a twist: damped least squares (Nakamura and Hanafusa 1986).

    The damping sets in near a singularity, by the singular values (Chiaverini 1997): there the arm moves slower than
    requested, instead of faster than its joints can.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        twist: velocity of a point of the flange and angular velocity, base axes, shape (6,) [m/s, rad/s].
        point: which, in the base frame, shape (3,) [m]; None: the origin of the flange.

    Returns:
        Shape (7,) [rad/s], of the smallest norm.
    """
    return _damped(jacobian(robot, q, point), twist)[0]


def _damped(j: Array, twist: Array) -> tuple[Array, Array, float]:
    """Joint velocities, the joint motion that leaves the flange where it is, and the least singular value."""
    u, s, vt = np.linalg.svd(j)
    near = np.maximum(0.0, 1.0 - (s / _SINGULAR) ** 2)
    return vt[:6].T @ ((s / (s**2 + near * _DAMPING**2)) * (u.T @ twist)), vt[6], float(s[-1])


def resolved_twist(
    robot: RobotModel,
    path: VelocityPath,
    twist: Array,
    point: Array | None = None,
    *,
    elbow: ElbowTask,
    idle: bool = False,
) -> tuple[Array, Slowdown]:
    """Joint velocities for a twist at the end of a path, and how much of the twist they achieve.

    Those of `joint_velocity`, and a motion in the null space of the Jacobian: the elbow follows its task as far as no
    joint slows the twist down, and helps where one would, near a limit of its position or of its speed (after Flacco,
    De Luca and Khatib, "Control of redundant robots under hard joint constraints: saturation in the null space", 2015,
    with one redundant joint).

    Args:
        robot: the robot.
        path: the path of the joints so far.
        twist: velocity of a point of the flange and angular velocity, base axes, shape (6,) [m/s, rad/s].
        point: which, in the base frame, shape (3,) [m]; None: the origin of the flange.
        elbow: what the elbow does.
        idle: nobody commands anything, so the elbow rests as well.

    Returns:
        Shape (7,) [rad/s], and the slowdown of a singularity, which is already part of them.
    """
    q = path.q
    j = jacobian(robot, q, point)
    dq, null, least = _damped(j, twist)
    square = float(twist @ twist)
    achieved = 1.0 if square < _TINY**2 else float(np.clip((j @ dq) @ twist / square, 0.0, 1.0))
    if least > _UNDEFINED:  # else more motions than one leave the flange where it is
        dq = dq + path.eased(dq, null, elbow.rate(q, dq, null, idle=idle)) * null
    return dq, FREE if achieved > 0.995 else Slowdown("singularity", achieved)


def resolved_pose(robot: RobotModel, pose: Pose, near: Array, *, elbow: ElbowTask, reach: float) -> Array:
    """Joint positions for a pose of the flange: those of a stream's next target.

    Args:
        robot: the robot.
        pose: of the flange in the base.
        near: those of the last target, shape (7,) [rad].
        elbow: what the elbow does.
        reach: largest joint movement of the elbow's own [rad].

    Returns:
        Shape (7,) [rad], within the limits of the joints.

    Raises:
        Unreachable: there are none.
    """
    q = solve(robot, pose, near=near.tolist())
    moved = float(np.abs(q - near).max())
    for _ in range(_ROUNDS):
        _, null, least = _damped(jacobian(robot, q), np.zeros(6))
        step = elbow.step(q, null, moved=moved, reach=reach) if least > _UNDEFINED else 0.0
        if abs(step) < _STILL:
            break
        try:
            there = solve(robot, pose, near=np.clip(q + step * null, robot.q_min, robot.q_max).tolist())
        except Unreachable:
            break
        if float(np.abs(there - q).max()) > _ASTRAY * abs(step):
            break  # a limit is in the way: the next solution is elsewhere
        q, reach = there, reach - abs(step)
    return q


def blockage(robot: RobotModel, q: Array, twist: Array) -> Slowdown:
    """What slows the arm down most if the flange goes on with a twist and A3 stays, at the joints' own limits.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        twist: of the flange, base axes, shape (6,) [m/s, rad/s].
    """
    path = VelocityPath(
        q,
        speed=robot.dq_max,
        acceleration=robot.ddq_max,
        q_min=robot.q_min + NEAREST,
        q_max=robot.q_max - NEAREST,
    )
    j = jacobian(robot, q)
    j[:, 2] = 0.0
    dq = _damped(j, twist)[0]
    achieved = float(np.clip((j @ dq) @ twist / max(float(twist @ twist), _TINY**2), 0.0, 1.0))
    singular = FREE if achieved > 0.995 else Slowdown("singularity", achieved)
    return min((singular, *path.slowdowns(dq)), key=lambda slowdown: slowdown.factor)


def limited_twist(twist: Array, speed: float, turn_speed: float) -> Array:
    """Scale a twist down to a speed [m/s] and an angular speed [rad/s]; its direction stays."""
    linear, angular = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    fraction = max(linear / speed, angular / turn_speed, 1.0)
    return np.asarray(twist / fraction)


def ramped_twist(twist: Array, goal: Array, change: float, turn_change: float) -> Array:
    """The twist nearest to a goal, on the straight way to it, that differs by at most so much.

    Args:
        twist: now, shape (6,) [m/s, rad/s].
        goal: shape (6,) [m/s, rad/s].
        change: largest change of the velocity [m/s].
        turn_change: largest change of the angular velocity [rad/s].
    """
    return np.asarray(twist + limited_twist(goal - twist, change, turn_change))


def wall_velocity(velocity: Array, below: Array, above: Array, acceleration: float) -> Array:
    """Clip a velocity, so that a point can brake before the walls of a box; it slides along them.

    Args:
        velocity: along the edges of the box, shape (3,) [m/s].
        below: distance to the lower walls, shape (3,) [m]; negative: outside.
        above: distance to the upper walls.
        acceleration: of braking [m/s²].

    Returns:
        Shape (3,) [m/s].
    """

    def allowed(left: Array) -> Array:
        free = np.maximum(left, 0.0)
        return np.minimum(np.sqrt(2.0 * _PLANNED * acceleration * free), _APPROACH * free)

    return np.clip(velocity, -allowed(below), allowed(above))


class VelocityPath:
    """Joint positions that follow a stream of joint velocities within limits.

    Args:
        q: where it begins, at rest, shape (7,) [rad].
        speed: of each joint at most, shape (7,) [rad/s].
        acceleration: of each joint at most, shape (7,) [rad/s²].
        q_min: lowest positions, shape (7,) [rad].
        q_max: highest positions, shape (7,) [rad].
        reaction: how long the arm goes on with its last velocity when no more targets come [s].

    Attributes:
        q: commanded positions, shape (7,) [rad].
        dq: commanded velocities, shape (7,) [rad/s].
    """

    def __init__(
        self,
        q: Array,
        *,
        speed: Array,
        acceleration: Array,
        q_min: Array,
        q_max: Array,
        reaction: float = 0.0,
    ) -> None:
        self.q, self.dq = q.copy(), np.zeros(7)
        self._speed, self._acceleration = speed, acceleration
        self._low, self._high = q_min, q_max
        self._carried = acceleration * reaction

    def stopping_factor(self, dq: Array, left: Array, rate: Array) -> Array:
        """Factors on joint velocities with which all joints, braking in step, come to rest within distances.

        Args:
            dq: joint velocities, shape (7,) [rad/s].
            left: distances, shape (n,).
            rate: velocity at which each shrinks with `dq`, shape (n,) [1/s].

        Returns:
            Shape (n,), up to infinity.
        """
        # braking in step takes t = f max(|dq| / a) and covers f rate t / 2: f² = 2 left / (rate max(|dq| / a))
        longest = float(np.max(np.abs(dq) / (_PLANNED * self._acceleration)))
        nearing = rate > _TINY
        result = np.full(len(left), np.inf)
        result[nearing] = np.sqrt(
            2.0 * np.maximum(left[nearing], 0.0) / (rate[nearing] * max(longest, _TINY))
        )
        return result

    def eased(self, dq: Array, null: Array, wanted: float) -> float:
        """Velocity along a motion that is free, with which the joints slow joint velocities down least.

        Args:
            dq: joint velocities, shape (7,) [rad/s].
            null: joint motion that may be added, of length 1, shape (7,).
            wanted: velocity along it that is taken if no joint slows down [rad/s].

        Returns:
            The nearest one to that wanted [rad/s].
        """
        free = np.abs(null) > _STUCK
        along, dq = null[free], dq[free]
        # all joints brake in step: see stopping_factor
        longest = float(np.max(np.abs(dq + wanted * along) / (_PLANNED * self._acceleration[free])))
        below, above = (
            np.minimum(
                np.minimum(self._speed, self._fastest(left)),
                2.0 * np.maximum(left, 0.0) / max(longest, _TINY),
            )[free]
            for left in (self.q - self._low, self._high - self.q)
        )
        # a fraction s of dq leaves each joint the velocities from first + s slope to last + s slope
        first, last = np.sort(np.stack([-below / along, above / along]), axis=0)
        slope = -dq / along
        low, high = float((first + slope).max()), float((last + slope).min())
        if low <= high:
            return float(np.clip(wanted, low, high))
        nearing = slope[:, None] - slope
        with np.errstate(divide="ignore", invalid="ignore"):
            fractions = np.where(nearing > _TINY, (last - first[:, None]) / nearing, np.inf)
        index = np.unravel_index(int(fractions.argmin()), fractions.shape)
        fraction = float(fractions[index])
        return 0.0 if fraction < _BLOCKED else float(first[index[0]] / fraction + slope[index[0]])

    def _fastest(self, left: Array) -> Array:
        """Speeds at distances to a limit with which the joints come to rest before it, even without more targets."""
        free = np.maximum(left, 0.0)
        return np.sqrt(self._carried**2 + 2.0 * self._acceleration * free) - self._carried

    def slowdowns(self, dq: Array) -> list[Slowdown]:
        """What slows joint velocities down here: the joints' speeds and their limits."""
        moving = np.abs(dq)
        fast = np.where(moving > _TINY, self._speed / np.maximum(moving, _TINY), np.inf)
        left = np.where(dq > 0.0, self._high - self.q, self.q - self._low)
        near = self.stopping_factor(dq, left, moving)
        near = np.minimum(near, self._fastest(left) / np.maximum(moving, _TINY))
        found = []
        for factors, reason in ((fast, "speed of A{}"), (near, "limit of A{}")):
            index = int(factors.argmin())
            if factors[index] < 1.0:
                found.append(Slowdown(reason.format(index + 1), float(factors[index])))
        return found

    def advance(self, dq: Array, dt: float, held: Sequence[Slowdown] = ()) -> Slowdown:
        """Move on for a time.

        Args:
            dq: commanded velocities, shape (7,) [rad/s].
            dt: the time [s].
            held: what else slows them down.

        Returns:
            What slows them down most.
        """
        least = min((FREE, *held, *self.slowdowns(dq)), key=lambda slowdown: slowdown.factor)
        change = least.factor * dq - self.dq
        excess = float(np.max(np.abs(change) / (self._acceleration * max(dt, _TINY))))
        new = self.dq + change / max(excess, 1.0)
        # the ramp may lag behind the slowdown; no joint is ever too fast to brake before its limit
        new = np.clip(new, -self._fastest(self.q - self._low), self._fastest(self._high - self.q))
        q = np.clip(self.q + new * dt, np.minimum(self._low, self.q), np.maximum(self._high, self.q))
        self.dq = (q - self.q) / dt if dt > 0.0 else new
        self.q = q
        return least

    def stay_at(self, q: Array) -> None:
        """Rest at joint positions, shape (7,) [rad]: the velocities become zero at once."""
        self.q, self.dq = q, np.zeros(7)

    def target(self, ahead: float) -> tuple[Array, Array]:
        """Positions a time ahead [s] and the velocities to pass them with, shape (7,) each [rad, rad/s]."""
        q = self.q + self.dq * ahead
        return np.clip(q, np.minimum(self._low, self.q), np.maximum(self._high, self.q)), self.dq
