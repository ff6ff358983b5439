"""The batched simulator as RSL-RL takes it, so that its runners train on the same tasks: `pip install rsl-rl-lib`."""

from __future__ import annotations

from typing import Any

import numpy as np

from heptarm.errors import require
from heptarm.rl.sim.episodes import TaskBatch
from heptarm.values.checks import Array


class RslArms:
    """Many simulated robots in a task, with the methods of RSL-RL's `VecEnv`; the observation group is "policy".

    Args:
        arms: the simulation.
        device: where the tensors are; the simulation stays on the processor.

    Raises:
        MissingExtra: torch, or tensordict, which comes with RSL-RL, is not installed.
    """

    def __init__(self, arms: TaskBatch, *, device: str = "cpu") -> None:
        self._torch, self._group_of = (
            require("torch", extra="rl"),
            require("tensordict", extra="rl").TensorDict,
        )
        self.arms, self.device = arms, device
        self.num_envs, self.num_actions = arms.envs, arms.task.action_size
        self.max_episode_length = arms.task.steps
        self.cfg = arms.task.as_dict()

    @property
    def episode_length_buf(self) -> Any:
        """Decisions since each episode began, shape (envs,)."""
        return self._torch.as_tensor(self.arms.age.copy(), device=self.device)

    @episode_length_buf.setter
    def episode_length_buf(self, ages: Any) -> None:
        self.arms.age[:] = ages.cpu().numpy()

    def get_observations(self) -> Any:
        """The current observations."""
        return self._group(self.arms.observe())

    def step(self, actions: Any) -> tuple[Any, Any, Any, dict[str, Any]]:
        """One decision of every arm: observations, rewards, ended episodes, and further information."""
        step = self.arms.step(actions.detach().cpu().numpy())
        done = self._tensor(step.done)
        close = step.distance <= self.arms.task.radius
        log = {"distance": float(step.distance.mean()), "success": float(close.mean())}
        return self._group(step.observation), self._tensor(step.reward), done, {"time_outs": done, "log": log}

    def _group(self, seen: Array) -> Any:
        return self._group_of({"policy": self._tensor(seen)}, batch_size=[self.num_envs])

    def _tensor(self, values: Any) -> Any:
        return self._torch.as_tensor(np.asarray(values, dtype=np.float32), device=self.device)
