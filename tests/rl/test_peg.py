"""The peg-in-hole task: the physics can be solved and refuses to be fooled, seeds reproduce, Gymnasium accepts it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed")

import gymnasium

import heptarm.rl
from heptarm.errors import CommandRejected, NotReady, ShapeError
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.plug_insert import PlugInsert
from heptarm.rl.contact.polish import Polish
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask, Moment
from heptarm.rl.evaluate import evaluate
from heptarm.rl.film import film
from heptarm.rl.policy import SHIPPED, policy_named, shipped_contact
from heptarm.rl.report import EpisodeReport
from heptarm.rl.sim.contact_batch import BatchContact
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.plant_engine import PlantEngine
from heptarm.rl.sim.randomisation import MILD, Randomisation
from heptarm.rl.tasks import TASKS, task_from_dict

heptarm.rl.register()


@pytest.mark.parametrize("clearance", [1e-3, 0.2e-3])
def test_who_knows_the_hole_inserts_gently(clearance: float) -> None:
    task = PegInHole(clearance=clearance, steps=100)
    arms = BatchContact(task, BatchSettings(envs=4, starts="together", seed=3))
    force = np.zeros(4)
    for _ in range(task.steps):
        step = arms.step(arms.teach())
        force = np.maximum(force, step.force)
    assert step.distance.max() <= task.radius
    assert step.reward.min() > 0.3
    assert force.max() < 30.0


def test_who_pushes_straight_down_stays_on_the_rim_and_feels_it() -> None:
    task = PegInHole(tilt=1e-3, height=1e-6)
    arms = BatchContact(task, BatchSettings(envs=4, starts="together", seed=4))
    sides = 2.5e-3 * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    arms.reset(np.hstack([sides, np.zeros((4, 4))]))
    down = np.tile([0.0, 0.0, 0.5, 0.0, 0.0], (4, 1))
    for _ in range(60):
        step = arms.step(down)
    assert step.distance.min() > 0.9 * task.depth
    # leash times stiffness, pressed onto the rim
    assert step.force == pytest.approx(task.leash * task.stiffness, rel=0.15)
    # supported on the side away from the hole: the moment shows where it is
    moment = arms.true_wrench[:, 3:5]
    felt = np.array([[0.0, -1.0], [0.0, 1.0], [1.0, 0.0], [-1.0, 0.0]])
    assert (moment * felt).sum(axis=1).min() > 0.03


def test_the_same_seed_gives_the_same_run_with_any_threads_and_after_a_load() -> None:
    task = PegInHole(steps=12)
    random = Randomisation(latency=(0, 1), bandwidth=(15.0, 40.0))
    one, other = (
        BatchContact(task, BatchSettings(envs=5, randomisation=random, seed=2, threads=n)) for n in (1, 2)
    )
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 5, 5))
    for action in actions[:10]:
        assert (one.step(action).observation == other.step(action).observation).all()
    third = BatchContact(task, BatchSettings(envs=5, randomisation=random, seed=9))
    third.load(one.save())
    for action in actions[10:]:
        assert (third.step(action).observation == one.step(action).observation).all()


def test_the_set_point_stays_on_its_leash_and_in_its_box() -> None:
    task = PegInHole()
    pose = np.zeros((1, 6))
    command = pose
    for _ in range(50):
        command = task.advance(command, pose, np.ones((1, 5)))
    assert command[0, :3] == pytest.approx([task.leash] * 3)
    assert command[0, 3:5] == pytest.approx([task.turn_leash] * 2)
    far = np.full((1, 6), 0.1)
    assert task.advance(far, far, np.ones((1, 5)))[0, :2].max() <= 2 * task.place + task.leash


def test_beside_the_hole_is_not_in_it() -> None:
    task = PegInHole()
    hole = np.zeros(6)
    inside, beside = np.array([0, 0, 0.03, 0, 0, 0.0]), np.array([0.004, 0, 0.03, 0, 0, 0.0])
    there, aside = (Moment(pose, pose, np.zeros(6), hole) for pose in (inside, beside))
    assert task.missing(there) == 0.0
    assert task.missing(aside) == pytest.approx(task.depth)
    assert task.reward(there) > task.reward(aside)


def test_a_task_goes_through_a_file() -> None:
    task = PegInHole(clearance=0.2e-3, history=(0, 4))
    assert task_from_dict(task.as_dict()) == task
    for kind in TASKS.values():
        assert task_from_dict(kind().as_dict()) == kind()
    with pytest.raises(CommandRejected, match="task must be one of reach, peg-in-hole, .*got 'juggle'"):
        task_from_dict({"name": "juggle"})
    with pytest.raises(CommandRejected, match="unknown entries of the task: colour"):
        task_from_dict({"name": "peg-in-hole", "colour": 1})


def test_gymnasium_finds_nothing_to_complain_of() -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("heptarm/PegInHole-v0", task=PegInHole(steps=10))
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=1, options={"target": [1e-3, 0, 0, 0, 0, 0]})
    with pytest.raises(ShapeError, match="target"):
        env.reset(options={"target": [1.0]})
    with pytest.raises(CommandRejected, match="unknown options: hole"):
        env.reset(options={"hole": [1.0]})
    with pytest.raises(CommandRejected, match="only latency and bandwidth"):
        gymnasium.make("heptarm/PegInHole-v0", randomisation=MILD)


def test_many_arms_at_once_are_the_same_arms() -> None:
    task = PegInHole(steps=6)
    many = gymnasium.make_vec("heptarm/PegInHole-v0", num_envs=3, task=task)
    arms = BatchContact(task, BatchSettings(envs=3, starts="together"))
    seen, _ = many.reset(seed=5)
    assert (seen == arms.reset(seed=5).astype(np.float32)).all()
    for index in range(6):
        seen, reward, terminated, truncated, info = many.step(np.full((3, 5), 0.3, dtype=np.float32))
        assert many.observation_space.contains(seen)
        assert reward.shape == info["is_success"].shape == info["distance"].shape == (3,)
        assert not terminated.any()
        assert truncated.all() == (index == 5)
    assert info["_final_obs"].all()
    assert info["final_obs"][0].shape == (task.observation_size,)


def test_the_included_policy_inserts_where_it_has_never_been(tmp_path: Path) -> None:
    policy = shipped_contact(PegInHole)
    assert (SHIPPED / "peg-in-hole-iiwa14.npz").stat().st_size <= 200_000
    report = evaluate(policy, 8, randomisation=Randomisation(latency=(0, 1), bandwidth=(15.0, 40.0)))
    assert report.success_rate >= 0.75
    assert 2.0 < np.median(report.peak_force) < 30.0
    assert np.abs(report.targets[:, :2]).max() > 1e-3  # the holes were not where they were presumed
    assert "% within 1.5 mm at the end" in report.summary() and "peak force" in report.summary()
    again = EpisodeReport.load(report.save(tmp_path / "peg.npz"))
    assert again.task == report.task and (again.forces == report.forces).all()
    with pytest.raises(CommandRejected, match="only latency and bandwidth"):
        evaluate(policy, 1, randomisation=MILD)
    with pytest.raises(CommandRejected, match="on the processor alone"):
        evaluate(policy, 1, engine=PlantEngine)
    with pytest.raises(CommandRejected, match="film is drawn of the reach task"):
        film(report, tmp_path / "peg.gif")


@pytest.mark.parametrize("kind", [PlugInsert, Push])
def test_the_included_policies_of_other_tasks_succeed(kind: type[ContactTask]) -> None:
    policy = policy_named(kind.name)
    assert policy.task == kind() and (SHIPPED / f"{kind.name}-iiwa14.npz").stat().st_size <= 200_000
    report = evaluate(policy, 8, randomisation=Randomisation(latency=(0, 1), bandwidth=(15.0, 40.0)))
    assert report.success_rate >= 0.75


def test_a_task_whose_policy_is_not_included_names_those_that_are() -> None:
    with pytest.raises(
        CommandRejected, match=r"peg-in-hole, .*plug-insert, got polish \(heptarm rl train polish"
    ):
        shipped_contact(Polish)


def test_one_who_does_nothing_inserts_nothing() -> None:
    task = PegInHole(steps=20)
    report = evaluate(lambda seen: np.zeros((len(seen), 5)), 3, task=task)
    assert report.success_rate == 0.0 and report.final == pytest.approx(task.depth, abs=0.02)
    assert not report.peak_force.any() and "peak force" not in report.summary()


def test_an_episode_that_ended_takes_no_step() -> None:
    env = gymnasium.make("heptarm/PegInHole-v0", task=replace(PegInHole(), steps=2)).unwrapped
    with pytest.raises(NotReady):
        env.step(np.zeros(5))
