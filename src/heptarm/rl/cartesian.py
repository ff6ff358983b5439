"""Cartesian actions: a damped step of many arms towards a pose of their flange."""

from __future__ import annotations

import numpy as np

from heptarm.model.batch import forward_batch, jacobian_batch
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Damping of the inverse [m, rad]; libiiwa's value.
DAMPING = 0.05


def step_towards(robot: RobotModel, q: Array, shift: Array, held: Array) -> Array:
    """Joint positions whose flange is shifted and turned back to a held rotation; one damped Newton step.

    At the boundary of the workspace the rotation deviates before joints move far.

    Args:
        robot: the robot.
        q: joint positions, shape (n, 7) [rad].
        shift: requested displacement of the flange, base axes, shape (n, 3) [m].
        held: wanted rotation of the flange, shape (n, 3, 3).

    Returns:
        Shape (n, 7) [rad].
    """
    away = held @ np.swapaxes(forward_batch(robot, q)[:, :3, :3], -1, -2)
    turn = 0.5 * np.stack(
        [
            away[:, 2, 1] - away[:, 1, 2],
            away[:, 0, 2] - away[:, 2, 0],
            away[:, 1, 0] - away[:, 0, 1],
        ],
        axis=-1,
    )
    j = jacobian_batch(robot, q)
    transposed = np.swapaxes(j, -1, -2)
    square = j @ transposed + DAMPING**2 * np.eye(6)
    wanted = np.concatenate([shift, turn], axis=-1)
    moved: Array = q + (transposed @ np.linalg.solve(square, wanted[..., None]))[..., 0]
    return moved
