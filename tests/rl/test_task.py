"""The task: observations, actions and their limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.model.kinematics import forward
from heptarm.rl.sim.randomisation import LEVELS, Randomisation, level
from heptarm.rl.task import ReachTask
from heptarm.values.robot import ROBOTS


@pytest.mark.parametrize("name", ROBOTS)
def test_the_kinematics_of_many_arms_are_those_of_one(name: str) -> None:
    model = ROBOTS[name]
    task = ReachTask(name)
    q = np.random.default_rng(0).uniform(model.q_min, model.q_max, (4, 5, 7))
    for index in np.ndindex(4, 5):
        pose = forward(model, q[index])
        assert np.abs(task.tip(q)[index] - pose[:3, 3]).max() < 1e-12
        assert np.abs(task.hold(q)[index] - pose[:3, :3]).max() < 1e-12


def test_an_observation_number_by_number() -> None:
    task = ReachTask("iiwa7", feature="kinematic")
    q = task.model.q_max / 2
    dq = np.arange(7.0)
    target = task.tip(q) + [0.004, -0.1, 0.3]
    seen = task.observe(q, dq, target)
    assert seen.shape == (23,)
    assert seen[:7] == pytest.approx(0.5)
    assert seen[7:14] == pytest.approx(0.1 * dq)
    assert seen[14:17] == pytest.approx(target)
    assert seen[17:20] == pytest.approx([-0.02, 0.5, -1.5])
    assert seen[20:23] == pytest.approx([-0.2, 1.0, -1.0])


def test_batches_see_what_single_arms_see() -> None:
    task = ReachTask(feature="kinematic")
    random = np.random.default_rng(1)
    q, dq = task.starts(random, 6), random.normal(size=(6, 7))
    target = task.targets(random, 6)
    many = task.observe(q, dq, target)
    for index in range(6):
        assert (task.observe(q[index], dq[index], target[index]) == many[index]).all()


def test_the_paper_sees_joints_velocities_and_target_only() -> None:
    task = ReachTask()
    q = np.asarray(task.home)
    assert task.observe(q, np.zeros(7), np.zeros(3)).shape == (17,)


def test_actions_add_up_on_the_command_and_not_on_what_was_measured() -> None:
    task = ReachTask()
    home = np.asarray(task.home)
    command = home.copy()
    for _ in range(10):
        command = task.advance(command, home, np.full(7, 0.5))  # the arm has not moved yet
    assert command - home == pytest.approx(10 * 0.5 * 2.5 / 120)


def test_actions_are_clipped_to_one() -> None:
    task = ReachTask()
    home = np.asarray(task.home)
    assert task.advance(home, home, np.full(7, 40.0)) - home == pytest.approx(2.5 / 120)


def test_a_command_that_runs_away_is_kept_on_a_leash() -> None:
    task = ReachTask()
    home = np.asarray(task.home)
    command = home.copy()
    for _ in range(100):
        command = task.advance(command, home, np.ones(7))
    assert command - home == pytest.approx(task.leash)


def test_a_command_ends_at_the_joint_limits() -> None:
    task = ReachTask()
    near = task.model.q_max - 0.001
    assert (task.advance(near, near, np.ones(7)) == task.model.q_max).all()


def test_cartesian_steps_move_the_flange_straight_and_keep_its_rotation() -> None:
    task = ReachTask(action="cartesian")
    q = task.starts(np.random.default_rng(2), 8)
    held, begin = task.hold(q), task.tip(q)
    command = q
    for _ in range(10):
        command = task.advance(command, command, np.tile([-0.5, 1.0, -1.0], (8, 1)), held)
    moved = task.tip(command) - begin
    assert moved == pytest.approx(np.tile([-0.05, 0.1, -0.1], (8, 1)), abs=0.01)
    angle = np.arccos(
        np.clip((np.trace(np.swapaxes(held, 1, 2) @ task.hold(command), axis1=1, axis2=2) - 1) / 2, -1, 1)
    )
    assert angle.max() < 0.02


def test_at_the_edge_of_its_reach_a_cartesian_arm_does_not_run_off() -> None:
    task = ReachTask("iiwa7", action="cartesian")
    q = np.asarray(task.home)[None]
    held = task.hold(q)
    for _ in range(200):
        before = q
        q = task.advance(q, q, np.array([[1.0, 0.0, 0.0]]), held)
        assert np.abs(q - before).max() <= 2 * task.joint_step + 1e-12
    assert (np.abs(q) <= task.model.q_max).all()


def test_starts_and_targets_lie_where_the_task_reports() -> None:
    task = ReachTask()
    random = np.random.default_rng(3)
    assert np.abs(task.starts(random, 1000) - task.home).max() <= 0.125
    targets = task.targets(random, 1000)
    assert targets.min(axis=0) == pytest.approx([0.5, -0.2, 0.2], abs=0.01)
    assert targets.max(axis=0) == pytest.approx([0.7, 0.2, 0.6], abs=0.01)


def test_a_task_survives_its_file() -> None:
    task = ReachTask("med7", action="cartesian", feature="kinematic", radius=0.01)
    assert ReachTask.from_dict(task.as_dict()) == task
    with pytest.raises(CommandRejected, match="gripper"):
        ReachTask.from_dict({"gripper": 1})


@pytest.mark.parametrize(
    ("entries", "text"),
    [
        ({"robot": "iiwa9"}, "iiwa9"),
        ({"action": "torque"}, "torque"),
        ({"feature": "vision"}, "vision"),
        ({"rate": 0.0}, "rate"),
        ({"steps": -3}, "steps"),
        ({"radius": float("nan")}, "radius"),
        ({"home": (0.0,)}, "home"),
        ({"spread": -1.0}, "spread"),
    ],
)
def test_what_makes_no_task_is_refused_by_name(entries: dict[str, Any], text: str) -> None:
    with pytest.raises(CommandRejected, match=text):
        ReachTask(**entries)


def test_a_cartesian_action_needs_the_rotation_that_is_held() -> None:
    task = ReachTask(action="cartesian")
    home = np.asarray(task.home)
    with pytest.raises(ShapeError, match="held"):
        task.advance(home, home, np.zeros(3))


def test_levels_of_randomisation_grow() -> None:
    none, mild, strong = (LEVELS[name] for name in ("none", "mild", "strong"))
    assert none.latency[1] < mild.latency[1] < strong.latency[1] == 3
    assert none.velocity_noise < mild.velocity_noise < strong.velocity_noise
    draws = strong.draw_latency(np.random.default_rng(0), 1000)
    assert sorted(set(draws.tolist())) == [0, 1, 2, 3]
    with pytest.raises(CommandRejected, match="wild"):
        level("wild")


@pytest.mark.parametrize(
    "entries",
    [
        {"latency": (2, 1)},
        {"latency": (0, 99)},
        {"bandwidth": (0.0, 10.0)},
        {"payload": (-1.0, 1.0)},
        {"stiffness": (300.0, float("inf"))},
        {"velocity_noise": 1.0},
    ],
)
def test_ranges_that_are_none_are_refused(entries: dict[str, Any]) -> None:
    with pytest.raises(LimitError, match=next(iter(entries))):
        Randomisation(**entries)
