"""The peg-in-hole task at Gymnasium: `make("heptarm/PegInHole-v0")`, and many arms at once by `make_vec`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.rl.env import TaskEnv, action_space
from heptarm.rl.peg import PegInHole
from heptarm.rl.sim.episodes import Step
from heptarm.rl.sim.peg_batch import BatchPeg
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.values.checks import instance

require("gymnasium", extra="rl")

from gymnasium import spaces  # noqa: E402  after the check that it is there
from gymnasium.vector import AutoresetMode, VectorEnv  # noqa: E402
from gymnasium.vector.utils import batch_space  # noqa: E402

Numbers = npt.NDArray[np.float32]
#: Largest number of an observation; what is above is clipped.
LARGEST = 10.0


def observation_space(task: PegInHole) -> spaces.Box:
    """Space of the observations of a task."""
    return spaces.Box(-LARGEST, LARGEST, (task.observation_size,), dtype=np.float32)


def _seen(observation: npt.NDArray[np.float64]) -> Numbers:
    return np.clip(observation, -LARGEST, LARGEST).astype(np.float32)


class PegInHoleEnv(TaskEnv):
    """One simulated arm that inserts a peg; "distance" is the depth that is missing.

    Args:
        task: the task; None: its defaults.
        randomisation: latency and bandwidth that differ from episode to episode.
        render_mode: None; there are no pictures.

    Raises:
        CommandRejected: a render mode, or a randomisation that the task has not.
        MissingExtra: Gymnasium is not installed.
    """

    metadata = {"render_modes": [], "render_fps": 20}  # noqa: RUF012  Gymnasium's own name

    def __init__(
        self,
        task: PegInHole | None = None,
        *,
        randomisation: Randomisation = NONE,
        render_mode: str | None = None,
    ) -> None:
        if task is not None:
            instance(task, PegInHole, "task")
        instance(randomisation, Randomisation, "randomisation")
        self.task = task or PegInHole()
        arms = BatchPeg(self.task, envs=1, randomisation=randomisation, threads=1, starts="together")
        super().__init__(arms, observation_space(self.task), render_mode=render_mode)


class PegInHoleVectorEnv(VectorEnv):  # type: ignore[misc]  # gymnasium is not looked into
    """Many simulated arms that insert pegs, in one process; an episode that ends begins again within the same step.

    Args:
        num_envs: number of arms.
        task: the task; None: its defaults.
        randomisation: latency and bandwidth that differ from episode to episode.
        threads: of the simulation.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012  Gymnasium's own name

    def __init__(
        self,
        num_envs: int = 1,
        *,
        task: PegInHole | None = None,
        randomisation: Randomisation = NONE,
        threads: int = 2,
    ) -> None:
        self.num_envs, self.task, self.render_mode = num_envs, task or PegInHole(), None
        self.single_observation_space = observation_space(self.task)
        self.single_action_space = action_space(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._arms = BatchPeg(
            self.task, envs=num_envs, randomisation=randomisation, threads=threads, starts="together"
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Start an episode of every arm.

        Raises:
            CommandRejected: options, of which there are none.
        """
        super().reset(seed=seed)
        if options:
            raise CommandRejected(f"unknown options: {', '.join(options)}", hint="there are none")
        return _seen(self._arms.reset(seed=seed)), {}

    def step(self, actions: Numbers) -> tuple[Numbers, Any, Any, Any, dict[str, Any]]:
        """One decision of every arm; `actions` of shape (num_envs, 5), clipped to +-1.

        Raises:
            ShapeError: another shape, or not finite.
        """
        step: Step = self._arms.step(actions)
        success = step.distance <= self.task.radius
        info: dict[str, Any] = {"distance": step.distance, "is_success": success, "force": step.force}
        if step.done.any():
            last = np.empty(self.num_envs, dtype=object)
            for index, seen in zip(np.flatnonzero(step.done).tolist(), _seen(step.final), strict=True):
                last[index] = seen
            info |= {"final_obs": last, "_final_obs": step.done}
        return _seen(step.observation), step.reward, np.zeros(self.num_envs, dtype=np.bool_), step.done, info
