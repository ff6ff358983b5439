"""The task for other libraries: Gymnasium's environment, Stable-Baselines3's VecEnv, MuJoCo Warp."""

from __future__ import annotations

import importlib.util
import warnings
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed")

import gymnasium

import heptarm.rl
from heptarm.errors import CommandRejected, LimitError, NotReady, ShapeError
from heptarm.rl.evaluate import evaluate
from heptarm.rl.sim.batch import BatchReach
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.task import ReachTask

heptarm.rl.register()


@pytest.mark.parametrize("engine", ["plant", "training"])
@pytest.mark.parametrize("action", ["joint", "cartesian"])
@pytest.mark.parametrize("feature", ["", "kinematic"])
def test_gymnasium_finds_nothing_to_complain_of(engine: str, action: str, feature: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("heptarm/Reach-v0", engine=engine, action=action, feature=feature)
    check_env(env.unwrapped, skip_render_check=True)


def test_one_arm_and_a_batch_see_the_same() -> None:
    task = ReachTask(feature="kinematic")
    env = gymnasium.make("heptarm/Reach-v0", feature="kinematic", engine="training")
    seen, info = env.reset(seed=11)
    arms = BatchReach(task, BatchSettings(envs=3, starts="together"))
    arms.target[:] = info["target"]
    q = env.unwrapped._arms.q
    arms.engine.place(np.arange(3), np.tile(q, (3, 1)))
    arms.command[:], arms._late[:] = q, q
    random = np.random.default_rng(0)
    for index in range(100):
        action = random.uniform(-1, 1, 7)
        seen, reward, terminated, truncated, info = env.step(action)
        step = arms.step(np.tile(action, (3, 1)))
        many = step.final if truncated else step.observation
        assert (many.astype(np.float32) == seen).all()
        assert (step.reward == reward).all()
        assert not terminated
        assert truncated == (index == 99)
        assert info["distance"] == -reward
        assert info["is_success"] == (info["distance"] <= 0.035)


def test_a_target_may_be_given() -> None:
    env = gymnasium.make("heptarm/Reach-v0")
    seen, info = env.reset(options={"target": (0.5, 0.1, 0.3)})
    assert seen[14:17] == pytest.approx([0.5, 0.1, 0.3])
    assert info["distance"] == pytest.approx(np.linalg.norm(info["tip"] - [0.5, 0.1, 0.3]))
    assert (env.reset(seed=1)[0] == env.reset(seed=1)[0]).all()


def test_misuse_is_refused() -> None:
    env = gymnasium.make("heptarm/Reach-v0", engine="training", disable_env_checker=True).unwrapped
    with pytest.raises(NotReady, match="reset"):
        env.step(np.zeros(7))
    env.reset()
    with pytest.raises(ShapeError, match=r"action must have shape \(7,\), got \(3,\)"):
        env.step(np.zeros(3))
    with pytest.raises(LimitError, match=r"action\[2\] must be finite, got nan"):
        env.step(np.array([0.0, 0.0, np.nan, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(CommandRejected, match="goal"):
        env.reset(options={"goal": 1})
    with pytest.raises(LimitError, match="target"):
        env.reset(options={"target": (np.inf, 0, 0)})
    for wrong in ({"engine": "isaac"}, {"render_mode": "human"}, {"action": "torque"}):
        with pytest.raises(CommandRejected, match=next(iter(wrong.values()))):
            type(env)(**wrong)


# ---------------------------------------------------------------------------------- Stable-Baselines3


def vector(envs: int, task: ReachTask) -> Any:
    pytest.importorskip("stable_baselines3", reason="stable_baselines3 is not installed")
    from heptarm.rl.sim.vector_env import VectorArms

    return VectorArms(BatchReach(task, BatchSettings(envs=envs)))


def test_stable_baselines_gets_the_last_observation_of_an_episode() -> None:
    task = ReachTask(steps=12)
    vec = vector(20, task)
    vec.seed(5)
    first = vec.reset()
    assert first.shape == (20, 17)
    ended = 0
    for _ in range(24):
        seen, reward, done, infos = vec.step(np.zeros((20, 7)))
        assert (reward < 0).all()
        for index in np.flatnonzero(done):
            ended += 1
            assert infos[index]["TimeLimit.truncated"]
            assert not (infos[index]["terminal_observation"] == seen[index]).all()
        assert sum(bool(info) for info in infos) == done.sum()
    assert ended == 40
    vec.seed(5)
    assert (vec.reset() == first).all()
    assert vec.get_attr("render_mode") == [None] * 20
    with pytest.raises(CommandRejected, match="single arms"):
        vec.set_attr("task", None)
    vec.close()


@pytest.mark.slow
@pytest.mark.long
def test_its_ppo_learns_on_the_same_simulator() -> None:
    task = ReachTask(feature="kinematic")
    vec = vector(256, task)
    from stable_baselines3 import PPO

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about its own defaults
        student = PPO(
            "MlpPolicy",
            vec,
            n_steps=16,
            batch_size=1024,
            n_epochs=5,
            gamma=0.95,
            learning_rate=1e-3,
            policy_kwargs={"log_std_init": -0.5},
            device="cpu",
            seed=0,
        )

        def policy(observation: np.ndarray) -> np.ndarray:
            return np.asarray(student.predict(observation.astype(np.float32), deterministic=True)[0])

        before = evaluate(policy, 50, task=task).mean
        student.learn(150_000)
    assert evaluate(policy, 50, task=task).mean < 0.5 * before


# ---------------------------------------------------------------------------------- RSL-RL


def test_rsl_rl_gets_tensors_of_all_arms() -> None:
    torch = pytest.importorskip("torch", reason="torch is not installed")
    pytest.importorskip("tensordict", reason="tensordict is not installed")
    from heptarm.rl.sim.rsl_env import RslArms

    env = RslArms(BatchReach(ReachTask(steps=3), BatchSettings(envs=4, starts="together")))
    assert env.get_observations()["policy"].shape == (4, 17)
    for index in range(3):
        seen, reward, done, extras = env.step(torch.zeros(4, env.num_actions))
        assert seen["policy"].shape == (4, 17) and reward.shape == done.shape == (4,)
        assert bool(done.all()) == bool(extras["time_outs"].all()) == (index == 2)
    env.episode_length_buf = torch.full((4,), 2)
    assert env.step(torch.zeros(4, env.num_actions))[2].all()


# ---------------------------------------------------------------------------------- MuJoCo Warp


@pytest.mark.slow
@pytest.mark.timeout(900)  # its kernels are compiled once
@pytest.mark.skipif(importlib.util.find_spec("mujoco_warp") is None, reason="mujoco_warp is not installed")
def test_warp_moves_the_arms_alike() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Warp's own, as about a GPU that is not there
        from heptarm.rl.sim.warp_engine import WarpEngine

        task = ReachTask(steps=30)
        hard = Randomisation(
            latency=(0, 2), bandwidth=(5.0, 40.0), payload=(0.0, 2.0), stiffness=(300.0, 3000.0)
        )
        engines: tuple[dict[str, Any], ...] = ({"engine": WarpEngine}, {})
        for draw in (NONE, hard):
            warp, batch = (
                BatchReach(task, BatchSettings(envs=8, randomisation=draw), **engine) for engine in engines
            )
            random = np.random.default_rng(0)
            for index in range(40):
                action = random.uniform(-1, 1, (8, 7))
                one, other = warp.step(action), batch.step(action)
                assert one.observation == pytest.approx(other.observation, abs=1e-4), index
            saved = warp.save()
            action = np.ones((8, 7))
            went_on = warp.step(action).observation
            warp.load(saved)
            assert warp.step(action).observation == pytest.approx(went_on, abs=1e-6)
