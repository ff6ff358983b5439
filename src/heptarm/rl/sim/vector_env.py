"""The batched simulator as a Stable-Baselines3 `VecEnv`, so that its algorithms train on the same task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, require
from heptarm.rl.env import action_space, observation_space
from heptarm.rl.sim.episodes import TaskBatch

require("stable_baselines3", extra="rl")

from stable_baselines3.common.vec_env import VecEnv  # noqa: E402  after the check that it is there


class VectorArms(VecEnv):  # type: ignore[misc]  # stable_baselines3 is not looked into
    """Many simulated robots in a task.

    Args:
        arms: the simulation.

    Raises:
        MissingExtra: Stable-Baselines3 is not installed.
    """

    def __init__(self, arms: TaskBatch) -> None:
        self.arms = arms
        self._action: Any = None
        self.render_mode = None
        super().__init__(arms.envs, observation_space(arms.task), action_space(arms.task))

    def reset(self) -> Any:
        """Start episodes of all arms; return the observations, shape (envs, n)."""
        seed = self._seeds[0]  # of `seed()`; one stream serves all arms
        self._reset_seeds()
        return self.arms.reset(seed=seed).astype(np.float32)

    def step_async(self, actions: Any) -> None:
        """Take actions, shape (envs, actions)."""
        self._action = actions

    def step_wait(self) -> Any:
        """Observations, rewards, ended episodes, and further information."""
        step = self.arms.step(self._action)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        last = step.final.astype(np.float32)
        for row, index in enumerate(np.flatnonzero(step.done).tolist()):
            distance = float(step.distance[index])
            infos[index] = {
                "terminal_observation": last[row],
                "TimeLimit.truncated": True,
                "distance": distance,
                "is_success": distance <= self.arms.task.radius,
            }
        return step.observation.astype(np.float32), step.reward.astype(np.float32), step.done, infos

    def close(self) -> None:
        """No resources to release."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute, the same for all arms."""
        return [getattr(self, attr_name)] * len(self._which(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: arms cannot differ.

        Raises:
            CommandRejected: always.
        """
        raise CommandRejected(f"{attr_name} of single arms cannot be set", parameter=attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Refused: there is one simulation, no environments that could be called.

        Raises:
            CommandRejected: always.
        """
        raise CommandRejected(f"{method_name} of single arms cannot be called", parameter=method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Nothing is wrapped."""
        return [False] * len(self._which(indices))

    def _which(self, indices: Any) -> Sequence[int]:
        return list(self._get_indices(indices))
