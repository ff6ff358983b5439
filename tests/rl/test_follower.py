"""The policy behind messages: joint states in any order, targets, silence."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.errors import LimitError, ShapeError
from heptarm.rl.follower import Follower
from heptarm.rl.pilot import PolicyGuard
from heptarm.rl.policy import shipped

JOINTS = [f"left_A{i}" for i in range(1, 8)]
ZERO = [0.0] * 7


@pytest.fixture
def follower() -> Follower:
    return Follower(shipped(feature=True), JOINTS)


def test_it_reaches_an_arm_that_does_what_it_is_reported(follower: Follower) -> None:
    q = np.array(follower.task.home)
    follower.on_target((0.55, 0.1, 0.4))
    for step in range(100):
        now = step / follower.task.rate
        follower.on_joints(JOINTS, q.tolist(), ZERO, now)
        command = follower.command(now)
        assert command is not None
        assert np.abs(command - q).max() <= follower.task.joint_step + 1e-12
        q = command
    assert follower.distance < 0.01
    assert follower.counts["box"] == 0


def test_names_in_any_order_among_others(follower: Follower) -> None:
    home = list(follower.task.home)
    follower.on_target((0.6, 0.0, 0.4))
    follower.on_joints(JOINTS, home, ZERO, 0.0)
    straight = follower.command(0.0)
    other = Follower(shipped(feature=True), JOINTS)
    other.on_target((0.6, 0.0, 0.4))
    other.on_joints(["gripper", *JOINTS[::-1]], [9.9, *home[::-1]], [9.9, *ZERO], 0.0)
    assert other.command(0.0) == pytest.approx(straight)


@pytest.mark.parametrize("names", [JOINTS[:6], [f"right_A{i}" for i in range(1, 8)], []])
def test_another_robots_joints_are_passed_over(follower: Follower, names: list[str]) -> None:
    follower.on_target((0.6, 0.0, 0.4))
    follower.on_joints(names, [0.0] * len(names), [0.0] * len(names), 0.0)
    assert follower.command(0.0) is None


def test_without_a_target_or_fresh_joints_it_is_silent_and_begins_again(follower: Follower) -> None:
    home = np.array(follower.task.home)
    follower.on_joints(JOINTS, home.tolist(), ZERO, 0.0)
    assert follower.command(0.0) is None
    assert np.isnan(follower.distance)
    follower.on_target((0.6, 0.0, 0.4))
    assert follower.command(0.25) is not None
    assert follower.command(0.26) is None  # older than the guard allows
    pushed = home + 0.4
    follower.on_joints(JOINTS, pushed.tolist(), ZERO, 0.3)
    command = follower.command(0.3)
    assert command is not None
    assert np.abs(command - pushed).max() <= follower.task.joint_step + 1e-12
    follower.on_target(None)
    assert follower.command(0.3) is None


def test_bad_targets_are_refused_and_the_last_one_stays(follower: Follower) -> None:
    follower.on_joints(JOINTS, list(follower.task.home), ZERO, 0.0)
    follower.on_target((0.6, 0.0, 0.4))
    for bad in ((2.0, 0.0, 0.4), (0.6, 0.0, float("nan"))):
        with pytest.raises((LimitError, ShapeError), match="target"):
            follower.on_target(bad)
    assert follower.command(0.0) is not None
    with pytest.raises(ShapeError, match="seven"):
        Follower(shipped(), JOINTS[:6], guard=PolicyGuard())
