"""Demonstrations of a task for policies without pictures, recorded as fast as the processor allows.

`python -m lerobot_env_heptarm.demonstrate me/pick --episodes 40` makes a LeRobot data set: a script does the task on
the engine `stepped` of the environment. The place of the body is also `observation.environment_state`. Only successes
are kept.
"""

from __future__ import annotations

import argparse
import logging
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_STATE
from lerobot_robot_heptarm import HeptarmRobot
from lerobot_robot_heptarm.scenes import FINE, TASKS

from lerobot_env_heptarm.environment import PLACE, HeptarmEnv, HeptarmEnvConfig


class Trial(NamedTuple):
    """What a script did.

    Attributes:
        seen: numbers at each step, shape (n, m).
        done: action of each step, shape (n, k).
        success: whether the task was done.
    """

    seen: np.ndarray
    done: np.ndarray
    success: bool


def demonstrate(seed: int, *, config: HeptarmEnvConfig, noise: float) -> Trial:
    """Do the task once.

    Args:
        seed: of the places and of the noise.
        config: of the environment.
        noise: standard deviation of the targets [rad].
    """
    env = HeptarmEnv(config)
    observation, _ = env.reset(seed=seed)
    way, random = list(env.way()), np.random.default_rng(seed)
    seen, done, success, ends = [], [], False, False
    while not ends:
        q, opens = way[min(round(len(seen) * FINE / config.fps), len(way) - 1)]
        action = np.append(q + noise * random.standard_normal(7), float(opens)).astype(np.float32)
        seen.append(observation["agent_pos"].astype(np.float32))
        done.append(action)
        observation, _, terminated, truncated, info = env.step(action)
        success, ends = info["is_success"], terminated or truncated
    env.close()
    return Trial(np.array(seen), np.array(done), success)


def record(
    name: str, *, config: HeptarmEnvConfig, episodes: int, seed: int, noise: float, jobs: int
) -> LeRobotDataset:
    """Make a data set of so many successes.

    Args:
        name: of the data set, "me/pick".
        config: of the environment.
        episodes: to record.
        seed: of the first one; others follow.
        noise: standard deviation of the targets [rad].
        jobs: processes.
    """
    robot = HeptarmRobot(config.robot)
    names = [key for key, kind in robot.observation_features.items() if kind is float]
    actions = list(robot.action_features)
    features = {
        key: {"dtype": "float32", "shape": (len(parts),), "names": parts}
        for key, parts in ((OBS_STATE, names), (OBS_ENV_STATE, names[-PLACE:]), (ACTION, actions))
    }
    data = LeRobotDataset.create(
        repo_id=name, fps=config.fps, features=features, robot_type=robot.name, use_videos=False
    )
    words, tries = TASKS[str(config.task)].words, 0
    with ExitStack() as end, ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        end.callback(data.finalize)  # what is complete stays
        while data.num_episodes < episodes:
            seeds = range(seed + tries, seed + tries + episodes - data.num_episodes)
            tries += len(seeds)
            for trial in pool.map(partial(demonstrate, config=config, noise=noise), seeds):
                if trial.success:
                    for seen, done in zip(trial.seen, trial.done, strict=True):
                        state = {OBS_STATE: seen, OBS_ENV_STATE: seen[-PLACE:]}
                        data.add_frame({**state, ACTION: done, "task": words})
                    data.save_episode()
    logging.info("%d of %d tries were successes; %s", data.num_episodes, tries, data.root)
    return data


def main() -> None:
    """Record what the command line asks for."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="of the data set, such as me/pick")
    parser.add_argument("--task", default="pick-place", choices=list(TASKS))
    parser.add_argument("--episodes", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--noise", type=float, default=0.003, help="standard deviation of the targets [rad]")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    given = parser.parse_args()
    record(
        given.name,
        config=HeptarmEnvConfig(task=given.task, size=0, engine="stepped"),
        episodes=given.episodes,
        seed=given.seed,
        noise=given.noise,
        jobs=given.jobs,
    )


if __name__ == "__main__":
    main()
