"""Joint velocities of a stream of velocities: twists to joints, and every limit on the way to positions.

Twists become joint velocities by damped least squares. `VelocityPath` integrates velocities to positions, so that no
joint is too fast, accelerates too hard, or cannot brake before its limit; where it has to be slower than commanded, the
direction stays and a `Slowdown` has the reason. Without arm, loop or clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heptarm.model.kinematics import jacobian
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

#: Smallest singular value of the Jacobian below which the damping sets in, and its largest value.
_SINGULAR, _DAMPING = 0.08, 0.1
#: Distance that is left to a joint limit [rad].
MARGIN = 0.01
#: Fraction of the acceleration with which braking before a limit is planned; the rest is for following that plan.
_PLANNED = 0.5
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


def joint_velocity(robot: RobotModel, q: Array, twist: Array, point: Array | None = None) -> Array:
    """Joint velocities for a twist: damped least squares (Nakamura and Hanafusa 1986).

    The damping sets in near a singularity, by the smallest singular value (Chiaverini 1997): there the arm moves slower
    than requested, instead of faster than its joints can.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        twist: velocity of a point of the flange and angular velocity, base axes, shape (6,) [m/s, rad/s].
        point: which, in the base frame, shape (3,) [m]; None: the origin of the flange.

    Returns:
        Shape (7,) [rad/s], of the smallest norm.
    """
    return _damped(jacobian(robot, q, point), twist)


def _damped(j: Array, twist: Array) -> Array:
    u, s, vt = np.linalg.svd(j, full_matrices=False)
    near = max(0.0, 1.0 - (float(s[-1]) / _SINGULAR) ** 2)
    return np.asarray(vt.T @ ((s / (s**2 + near * _DAMPING**2)) * (u.T @ twist)))


def resolved_twist(
    robot: RobotModel, q: Array, twist: Array, point: Array | None = None
) -> tuple[Array, Slowdown]:
    """Joint velocities for a twist, and how much of the twist they achieve; arguments as `joint_velocity`.

    Returns:
        Shape (7,) [rad/s], and the slowdown of a singularity, which is already part of them.
    """
    j = jacobian(robot, q, point)
    dq = _damped(j, twist)
    square = float(twist @ twist)
    if square < _TINY**2:
        return dq, FREE
    achieved = float(np.clip((j @ dq) @ twist / square, 0.0, 1.0))
    return dq, FREE if achieved > 0.995 else Slowdown("singularity", achieved)


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

    Attributes:
        q: commanded positions, shape (7,) [rad].
        dq: commanded velocities, shape (7,) [rad/s].
    """

    def __init__(self, q: Array, *, speed: Array, acceleration: Array, q_min: Array, q_max: Array) -> None:
        self.q, self.dq = q.copy(), np.zeros(7)
        self._speed, self._acceleration = speed, acceleration
        self._low, self._high = q_min, q_max

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

    def slowdowns(self, dq: Array) -> list[Slowdown]:
        """What slows joint velocities down here: the joints' speeds and their limits."""
        moving = np.abs(dq)
        fast = np.where(moving > _TINY, self._speed / np.maximum(moving, _TINY), np.inf)
        left = np.where(dq > 0.0, self._high - self.q, self.q - self._low)
        near = self.stopping_factor(dq, left, moving)
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
        least = min((FREE, *held, *self.slowdowns(dq)), key=lambda one: one.factor)
        change = least.factor * dq - self.dq
        excess = float(np.max(np.abs(change) / (self._acceleration * max(dt, _TINY))))
        new = self.dq + change / max(excess, 1.0)
        # the ramp may lag behind the slowdown; no joint is ever too fast to brake before its limit
        below, above = (
            np.sqrt(2.0 * self._acceleration * np.maximum(left, 0.0))
            for left in (self.q - self._low, self._high - self.q)
        )
        new = np.clip(new, -below, above)
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
