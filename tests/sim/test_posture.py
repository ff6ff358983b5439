"""The tick's arm angle and Status are the model's."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from heptarm.model import inverse_kinematics
from heptarm.sim.plant.plant import posture
from heptarm.values.robot import ROBOTS


def _difference(a: float, b: float) -> float:
    return abs((a - b + pi) % (2 * pi) - pi)


@pytest.mark.parametrize("name", ["iiwa7", "iiwa14"])
def test_arm_angle_and_status_are_those_of_the_model(name: str) -> None:
    robot = ROBOTS[name]
    for fractions in np.random.default_rng(0).uniform(-1, 1, (2000, 7)):
        q = (robot.q_max * fractions).tolist()
        e1, status = posture(robot, q)
        wanted = inverse_kinematics.redundancy(robot, q)
        assert status == wanted.status
        assert _difference(e1, wanted.e1) < 1e-7


@pytest.mark.parametrize(
    "q",
    [
        (0.0,) * 7,
        (0.3, 0.0, 0.2, -1.0, 0.0, 0.5, 0.0),
        (0.3, 0.4, 0.0, 0.0, 0.1, 0.0, 0.2),
        (0.0, 0.5, 0.0, 1e-4, 0.0, 0.5, 0.0),
        (1.0, -0.5, 0.0, -1.0, 0.0, -0.5, 0.0),
    ],
)
def test_so_they_are_where_the_arm_is_straight_or_upright(q: tuple[float, ...]) -> None:
    robot = ROBOTS["iiwa14"]
    e1, status = posture(robot, q)
    wanted = inverse_kinematics.redundancy(robot, q)
    assert status == wanted.status and _difference(e1, wanted.e1) < 1e-6
