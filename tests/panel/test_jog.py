"""How fast a jog goes to a pose."""

from __future__ import annotations

from collections import deque

import pytest

from heptarm.panel.jog import PoseJog, towards
from heptarm.values.pose import Pose

PERIOD = 0.02


@pytest.mark.parametrize("age", [0.0, 0.1, 0.3, 0.9])
def test_an_arm_whose_states_are_late_does_not_go_beyond_the_pose(age: float) -> None:
    goal, pose = Pose.at(0.5, 0.0, 0.4), Pose.at(0.4, 0.0, 0.4)
    known = deque([pose] * (round(age / PERIOD) + 1))
    farthest = 0.0
    for _ in range(round(30.0 / PERIOD)):
        velocity = towards(PoseJog(goal, 0.5), known.popleft(), age)[:3]
        pose = Pose(pose.xyz + velocity * PERIOD, pose.quat)
        known.append(pose)
        farthest = max(farthest, float(pose.xyz[0]))
    assert farthest < 0.501 and pose.distance_to(goal) < 1e-4
