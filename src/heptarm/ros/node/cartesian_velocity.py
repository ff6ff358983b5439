"""Joint velocities of a Cartesian velocity: damped least squares, with limits that keep the direction."""

from __future__ import annotations

import numpy as np

from heptarm.model.kinematics import jacobian
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

#: Smallest singular value of the Jacobian below which the damping sets in, and its largest value.
_SINGULAR, _DAMPING = 0.08, 0.1
#: Deceleration towards a joint limit [rad/s²], and the distance that is left to it [rad].
_DECELERATION, _MARGIN = 2.0, 0.01


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
    u, s, vt = np.linalg.svd(jacobian(robot, q, point), full_matrices=False)
    near = max(0.0, 1.0 - (float(s[-1]) / _SINGULAR) ** 2)
    return np.asarray(vt.T @ ((s / (s**2 + near * _DAMPING**2)) * (u.T @ twist)))


def limited_twist(twist: Array, speed: float, turn_speed: float) -> Array:
    """Scale a twist down to a speed [m/s] and an angular speed [rad/s]; its direction stays."""
    linear, angular = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    fraction = max(linear / speed, angular / turn_speed, 1.0)
    return np.asarray(twist / fraction)


def limited_velocity(robot: RobotModel, q: Array, dq: Array, speed: float) -> Array:
    """Scale joint velocities down so that no joint is too fast, or too fast to brake before its limit.

    Args:
        robot: its limits.
        q: joint positions, shape (7,) [rad].
        dq: velocities, shape (7,) [rad/s].
        speed: speed limit, a fraction of each axis' maximum.

    Returns:
        A multiple of `dq`, so that the direction stays: the arm halts where a joint would leave its range.
    """
    left = np.where(dq > 0.0, robot.q_max - q, q - robot.q_min) - _MARGIN
    allowed = np.minimum(speed * robot.dq_max, np.sqrt(2.0 * _DECELERATION * np.maximum(left, 0.0)))
    moving = np.abs(dq) > 1e-12
    return np.asarray(dq * min(1.0, float(np.min(allowed[moving] / np.abs(dq[moving]), initial=1.0))))
