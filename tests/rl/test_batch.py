"""The batched simulator: reproducible, with latency and compliance as set, and in agreement with the plant."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.rl.sim import simulation
from heptarm.rl.sim.batch import BatchReach
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.plant_engine import PlantEngine
from heptarm.rl.sim.randomisation import STRONG, Randomisation
from heptarm.rl.task import ReachTask


def drive(arms: BatchReach, steps: int, seed: int = 0) -> list[np.ndarray]:
    random = np.random.default_rng(seed)
    shape = (arms.envs, arms.task.action_size)
    return [arms.step(random.uniform(-1, 1, shape)).observation for _ in range(steps)]


@pytest.mark.parametrize("action", ["joint", "cartesian"])
def test_the_same_seed_gives_the_same_run_with_any_threads(action: str) -> None:
    task = ReachTask(action=action)
    one, other = (
        drive(BatchReach(task, BatchSettings(envs=6, randomisation=STRONG, seed=5, threads=threads)), 120)
        for threads in (1, 2)
    )
    assert all((a == b).all() for a, b in zip(one, other, strict=True))
    third = drive(BatchReach(task, BatchSettings(envs=6, randomisation=STRONG, seed=6)), 1)
    assert not (third[0] == one[0]).all()


def test_episodes_end_by_their_length_and_begin_again() -> None:
    arms = BatchReach(ReachTask(steps=20), BatchSettings(envs=4, starts="together"))
    goals = arms.target.copy()
    for count in range(1, 21):
        step = arms.step(np.ones((4, 7)))
        assert step.done.all() == (count == 20)
        assert step.distance == pytest.approx(np.linalg.norm(step.tip - goals, axis=1))
        assert (step.reward == -step.distance).all()
    assert step.final.shape == (4, 17)
    assert not (step.final == step.observation).any(axis=1).all()
    assert np.abs(arms.q - arms.task.home).max() <= 0.125
    assert not (arms.target == goals).any()


def test_staggered_episodes_do_not_end_together() -> None:
    arms = BatchReach(ReachTask(), BatchSettings(envs=50))
    ended = [int(arms.step(np.zeros((50, 7))).done.sum()) for _ in range(100)]
    assert sum(ended) >= 50
    assert max(ended) < 10


def test_the_arm_comes_to_where_it_is_commanded() -> None:
    arms = BatchReach(ReachTask(), BatchSettings(envs=3, starts="together"))
    for _ in range(8):
        arms.step(np.ones((3, 7)))
    for _ in range(30):
        arms.step(np.zeros((3, 7)))
    assert np.abs(arms.q - arms.command).max() < 1e-3


def test_late_commands_come_late() -> None:
    task = ReachTask()
    moved = []
    for late in (0, 3):
        arms = BatchReach(
            task, BatchSettings(envs=1, randomisation=Randomisation(latency=(late, late)), starts="together")
        )
        begin = arms.q.copy()
        paths = []
        for _ in range(6):
            arms.step(np.ones((1, 7)))
            paths.append(float(np.abs(arms.q - begin).max()))
        moved.append(paths)
    assert moved[1][:3] == pytest.approx([0.0] * 3, abs=1e-9)
    assert moved[1][3:] == pytest.approx(moved[0][:3], rel=0.02)


def test_a_slow_servo_trails() -> None:
    trails = []
    for bandwidth in (5.0, 40.0):
        arms = BatchReach(
            ReachTask(), BatchSettings(envs=1, randomisation=Randomisation(bandwidth=(bandwidth,) * 2))
        )
        for _ in range(10):
            arms.step(np.ones((1, 7)))
        trails.append(float(np.abs(arms.command - arms.q).max()))
    assert trails[0] > 2 * trails[1]


def test_an_unknown_payload_bends_a_compliant_arm_more_than_a_stiff_one() -> None:
    sags = []
    for stiffness in (300.0, inf):
        draw = Randomisation(payload=(2.0, 2.0), stiffness=(stiffness, stiffness))
        arms = BatchReach(ReachTask(), BatchSettings(envs=1, randomisation=draw, starts="together"))
        for _ in range(60):
            arms.step(np.zeros((1, 7)))
        sags.append(float((arms.task.tip(arms.command) - arms.task.tip(arms.q))[0, 2]))
    # 2 kg at 0.4 m in front of A2, whose spring has 300 Nm/rad, and at A4 as well
    assert sags[0] == pytest.approx(2 * 9.81 * 0.4**2 / 300 * 2, rel=0.3)
    assert 0 < sags[1] < sags[0] / 20


def test_a_saved_simulation_goes_on_as_if_nothing_had_happened() -> None:
    task = ReachTask(steps=25, action="cartesian")
    arms = BatchReach(task, BatchSettings(envs=5, randomisation=STRONG, seed=9))
    drive(arms, 13)
    saved = arms.save()
    went_on = drive(arms, 30, seed=1)
    other = BatchReach(task, BatchSettings(envs=5, randomisation=STRONG, seed=9))
    other.load(saved)
    assert all((a == b).all() for a, b in zip(went_on, drive(other, 30, seed=1), strict=True))


def test_finer_steps_of_the_engine_would_move_the_arms_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = []
    for steps in (simulation.SUBSTEPS, 64):
        monkeypatch.setattr(simulation, "SUBSTEPS", steps)
        arms = BatchReach(ReachTask(), BatchSettings(envs=4, randomisation=STRONG, seed=3, starts="together"))
        drive(arms, 20)
        paths.append([arms.step(np.full((4, 7), 0.8)).tip for _ in range(20)])
    away = np.linalg.norm(np.diff(paths, axis=0)[0], axis=-1)
    assert away.max() < 0.002
    assert np.sqrt((away**2).mean()) < 0.0006


def test_the_plant_moves_alike() -> None:
    """The plant of the virtual cabinet, at 1 kHz with its own servo, agrees with the training simulator."""
    task = ReachTask()
    goals = task.targets(np.random.default_rng(4), 2)
    engines: tuple[dict[str, Any], ...] = ({}, {"engine": PlantEngine})
    trained, plant = (
        BatchReach(task, BatchSettings(envs=2, starts="together", seed=4), **engine) for engine in engines
    )
    assert (trained.reset(goals) == plant.reset(goals)).all()
    for index in range(45):
        action = np.full((2, 7), 0.8 if index < 20 else -0.3 if index < 30 else 0.0)
        one, other = trained.step(action), plant.step(action)
        # the lag may differ a little
        assert np.abs(one.tip - other.tip).max() < 0.05
    assert np.abs(one.tip - other.tip).max() < 0.002
    assert one.observation == pytest.approx(other.observation, abs=0.01)


def test_a_plant_with_joint_impedance_and_a_weight_complies() -> None:
    compliant = Randomisation(stiffness=(300.0, 300.0), payload=(1.0, 1.0))
    arms = BatchReach(
        ReachTask(), BatchSettings(envs=1, starts="together", randomisation=compliant), engine=PlantEngine
    )
    for _ in range(45):
        arms.step(np.zeros((1, 7)))
    assert 0.002 < float((arms.task.tip(arms.command) - arms.task.tip(arms.q))[0, 2]) < 0.05


@pytest.mark.parametrize("action", [np.zeros((2, 7)), np.zeros(7), np.diag([0.0] * 2 + [np.nan] * 5)[:3]])
def test_actions_that_are_none_are_refused(action: np.ndarray) -> None:
    arms = BatchReach(ReachTask(), BatchSettings(envs=3))
    before = arms.q.copy()
    with pytest.raises(
        (ShapeError, LimitError), match=r"action must have shape \(3, 7\)|action\[2, 2\] must be finite"
    ):
        arms.step(action)
    assert (arms.q == before).all()


def test_bad_arguments_are_refused_by_name() -> None:
    task = ReachTask()
    with pytest.raises(LimitError, match="envs"):
        BatchReach(task, BatchSettings(envs=0))
    with pytest.raises(LimitError, match="threads"):
        BatchReach(task, BatchSettings(envs=1, threads=0))
    with pytest.raises(CommandRejected, match="starts"):
        BatchReach(task, BatchSettings(envs=1, starts="never"))
    with pytest.raises(ShapeError, match="targets"):
        BatchReach(task, BatchSettings(envs=2)).reset(np.zeros((1, 3)))
    with pytest.raises(ShapeError, match="2 arms"):
        BatchReach(task, BatchSettings(envs=3)).load(BatchReach(task, BatchSettings(envs=2)).save())
