"""Helpers of the model's tests: random arms, and an independent forward kinematics."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from heptarm.values.robot import ROBOTS, RobotModel

MODELS = [ROBOTS["iiwa7"], ROBOTS["iiwa14"]]

#: Twists of the standard Denavit-Hartenberg parameters; all link lengths are 0.
_TWISTS = (-pi / 2, pi / 2, pi / 2, -pi / 2, -pi / 2, pi / 2, 0.0)


def denavit_hartenberg(robot: RobotModel, q: np.ndarray) -> np.ndarray:
    """Flange pose by Denavit-Hartenberg parameters, shape (4, 4)."""
    t = np.eye(4)
    offsets = (robot.d_bs, 0.0, robot.d_se, 0.0, robot.d_ew, 0.0, robot.d_wf)
    for angle, d, twist in zip(q, offsets, _TWISTS, strict=True):
        c, s, ca, sa = cos(angle), sin(angle), cos(twist), sin(twist)
        t = t @ np.array([[c, -s * ca, s * sa, 0], [s, c * ca, -c * sa, 0], [0, sa, ca, d], [0, 0, 0, 1.0]])
    return t


def random_q(robot: RobotModel, rng: np.random.Generator, part: float = 1.0) -> np.ndarray:
    """Joint positions within this fraction of the limits, shape (7,) [rad]."""
    return rng.uniform(part * robot.q_min, part * robot.q_max)
