"""Cartesian poses in FRI's representation, and inverse kinematics at a given A3.

FRI's poses are x y z [mm] and a quaternion w x y z, of the flange in the robot's base; its redundancy value is the
angle of A3 [rad].
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np

from heptarm.fri.protocol import messages as m
from heptarm.model.inverse_kinematics import PathInverse
from heptarm.model.kinematics import flange
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, quaternion, rotation
from heptarm.values.robot import RobotModel

#: FRI's name of the flange.
NAME = "Flange"

#: Largest deviation of a quaternion's norm from 1.
NORM = 1e-3


def transformation(robot: RobotModel, q: tuple[float, ...]) -> m.Transformation:
    """The flange's pose at joint positions, shape (7,) [rad]."""
    columns, (px, py, pz) = flange(robot, q)
    x, y, z, w = quaternion(list(zip(*columns, strict=True))).tolist()
    return m.Transformation(NAME, (1e3 * px, 1e3 * py, 1e3 * pz, w, x, y, z))


def matrix(pose: m.Transformation) -> Array:
    """The pose as a homogeneous matrix, shape (4, 4) [m].

    Raises:
        ValueError: a number is not finite, or the norm of the quaternion is not 1.
    """
    values = np.array(pose.values)
    norm = sqrt(float(values[3:] @ values[3:])) if np.isfinite(values).all() else 0.0
    if abs(norm - 1.0) > NORM:
        raise ValueError(f"Cartesian pose must be finite with a unit quaternion, got {values.tolist()}")
    w, x, y, z = (values[3:] / norm).tolist()
    result = np.eye(4)
    result[:3, :3] = rotation(np.array((x, y, z, w)))
    result[:3, 3] = 1e-3 * values[:3]
    return result


def distance(first: Array, second: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses, shape (4, 4)."""
    error = _error(first, second)
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))


def _error(goal: Array, here: Array) -> Array:
    """Translation and rotation vector from `here` to `goal`, base axes, shape (6,); good to second order."""
    turn = goal[:3, :3] @ here[:3, :3].T
    axial = 0.5 * np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    sine, cosine = float(np.linalg.norm(axial)), 0.5 * (float(np.trace(turn)) - 1.0)
    scale = np.arctan2(sine, cosine) / sine if sine > 1e-12 else 1.0
    return np.concatenate([goal[:3, 3] - here[:3, 3], scale * axial])


def joints(robot: RobotModel, goal: Array, a3: float, near: Array) -> Array:
    """Joint positions next to `near` for a pose of the flange with A3 at an angle.

    Args:
        robot: the robot.
        goal: shape (4, 4) [m].
        a3: angle of A3 [rad].
        near: shape (7,) [rad]; successive poses of a session are close together.

    Returns:
        Shape (7,) [rad].

    Raises:
        Unreachable: no arm position reaches it with this A3.
    """
    return _inverse(robot).joints(goal[:3, 3].tolist(), quaternion(goal[:3, :3]).tolist(), near, a3=a3)


@lru_cache(maxsize=8)
def _inverse(robot: RobotModel) -> PathInverse:
    return PathInverse(robot, Pose.at())
