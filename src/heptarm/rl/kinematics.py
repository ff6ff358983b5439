"""Batched kinematics: position and rotation of the flange, and a damped step towards a pose.

The chain is `heptarm.model.kinematics`'s, written over a leading batch axis. The end effector of the task is
the flange, 35 mm past the origin of the seventh link, which libiiwa's environments (`iiwa_link_7`) measure.
"""

from __future__ import annotations

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

#: Damping of the inverse [m, rad]; libiiwa's value.
DAMPING = 0.05


def tip(robot: RobotModel, q: Array) -> Array:
    """Positions of the flange in the base frame.

    The flange is transformed backwards through the chain: to the wrist, the elbow, the base.

    Args:
        robot: the robot.
        q: joint positions, shape (..., 7) [rad].

    Returns:
        Shape (..., 3) [m].
    """
    c, s = np.cos(q), np.sin(q)
    # A7 turns about the flange's own axis
    x, z = robot.d_wf * s[..., 5], robot.d_wf * c[..., 5]
    x, y, z = c[..., 4] * x, s[..., 4] * x, z + robot.d_ew
    x, z = c[..., 3] * x - s[..., 3] * z, s[..., 3] * x + c[..., 3] * z  # Ry(-A4)
    x, y, z = c[..., 2] * x - s[..., 2] * y, s[..., 2] * x + c[..., 2] * y, z + robot.d_se
    x, z = c[..., 1] * x + s[..., 1] * z, c[..., 1] * z - s[..., 1] * x
    x, y = c[..., 0] * x - s[..., 0] * y, s[..., 0] * x + c[..., 0] * y
    result = np.empty((*np.shape(q)[:-1], 3))
    result[..., 0], result[..., 1], result[..., 2] = x, y, z + robot.d_bs
    return result


def _z(angle: Array) -> Array:
    result = np.zeros((*angle.shape, 3, 3))
    result[..., 0, 0] = result[..., 1, 1] = np.cos(angle)
    result[..., 1, 0] = np.sin(angle)
    result[..., 0, 1] = -result[..., 1, 0]
    result[..., 2, 2] = 1.0
    return result


def _y(angle: Array) -> Array:
    result = np.zeros((*angle.shape, 3, 3))
    result[..., 0, 0] = result[..., 2, 2] = np.cos(angle)
    result[..., 0, 2] = np.sin(angle)
    result[..., 2, 0] = -result[..., 0, 2]
    result[..., 1, 1] = 1.0
    return result


def rotation(robot: RobotModel, q: Array) -> Array:
    """Rotations of the flange in the base frame, shape (..., 7) [rad] to (..., 3, 3)."""
    return jacobian(robot, q)[1]


def jacobian(robot: RobotModel, q: Array) -> tuple[Array, Array, Array]:
    """Geometric Jacobian of the flange, its rotation and its position, base axes.

    Args:
        robot: the robot.
        q: joint positions, shape (..., 7) [rad].

    Returns:
        Shapes (..., 6, 7): rows vx vy vz [m/rad], wx wy wz; (..., 3, 3); (..., 3) [m].
    """
    q = np.asarray(q, dtype=np.float64)
    frame = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    point = np.zeros((*q.shape[:-1], 3))
    point[..., 2] = robot.d_bs
    axes, points = [], []
    ahead = {1: robot.d_se, 3: robot.d_ew, 5: robot.d_wf}
    for joint in range(7):
        upright = joint % 2 == 0
        sign = -1.0 if joint == 3 else 1.0
        axes.append(sign * frame[..., :, 2 if upright else 1])
        points.append(point)
        frame = frame @ (_z if upright else _y)(sign * q[..., joint])
        if joint in ahead:
            point = point + ahead[joint] * frame[..., :, 2]
    axis, lever = np.stack(axes, axis=-2), point[..., None, :] - np.stack(points, axis=-2)
    rows = np.concatenate([np.cross(axis, lever), axis], axis=-1)
    return np.swapaxes(rows, -1, -2), frame, point


def step_towards(robot: RobotModel, q: Array, shift: Array, held: Array) -> Array:
    """Joint positions whose flange is shifted and turned back to a held rotation; one damped Newton step.

    At the boundary of the workspace the rotation deviates before joints move far.

    Args:
        robot: the robot.
        q: joint positions, shape (..., 7) [rad].
        shift: requested displacement of the flange, base axes, shape (..., 3) [m].
        held: wanted rotation of the flange, shape (..., 3, 3).

    Returns:
        Shape (..., 7) [rad].
    """
    j, r, _ = jacobian(robot, q)
    away = held @ np.swapaxes(r, -1, -2)
    turn = 0.5 * np.stack(
        [
            away[..., 2, 1] - away[..., 1, 2],
            away[..., 0, 2] - away[..., 2, 0],
            away[..., 1, 0] - away[..., 0, 1],
        ],
        axis=-1,
    )
    wanted = np.concatenate([shift, turn], axis=-1)
    transposed = np.swapaxes(j, -1, -2)
    square = j @ transposed + DAMPING**2 * np.eye(6)
    moved: Array = q + (transposed @ np.linalg.solve(square, wanted[..., None]))[..., 0]
    return moved
