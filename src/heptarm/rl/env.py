"""A task as a Gymnasium environment with one arm, and the reach task as one: `gymnasium.make("heptarm/Reach-v0")`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, NotReady, require
from heptarm.rl.sim.batch import BatchReach, Engine
from heptarm.rl.sim.episodes import TaskBatch
from heptarm.rl.sim.plant_engine import PlantEngine
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.task import COARSE, ReachTask
from heptarm.rl.tasks import Task
from heptarm.values.checks import array, instance, word

require("gymnasium", extra="rl")

import gymnasium  # noqa: E402  after the check that it is there
from gymnasium import spaces  # noqa: E402

ENGINES = {"plant": PlantEngine, "training": Engine}
Observation = npt.NDArray[np.float32]
#: Largest distance of a target from the base [m].
FARTHEST = 2.0


def observation_space(task: ReachTask) -> spaces.Box:
    """Space of the observations of the reach task, for all targets of a robot."""
    high = np.ones(task.observation_size, dtype=np.float32)
    high[:7] = 1.5
    high[14:17] = FARTHEST
    high[17:20] = 2 * FARTHEST / COARSE
    return spaces.Box(-high, high, dtype=np.float32)


def action_space(task: Task) -> spaces.Box:
    """Space of the actions: fractions of the largest step."""
    return spaces.Box(-1.0, 1.0, (task.action_size,), dtype=np.float32)


class TaskEnv(gymnasium.Env[Any, Any]):  # type: ignore[misc]  # gymnasium is not looked into
    """One simulated arm in a task.

    Episodes are truncated after `task.steps` decisions and never terminate. `info` holds "distance" [m],
    "is_success" (within the radius now), "target" as the task draws it, "tip", shape (3,) [m], and "force" [N].

    Args:
        arms: the simulation, of one arm.
        space: of its observations.
        render_mode: None; there are no pictures.

    Raises:
        CommandRejected: a render mode.
    """

    metadata = {"render_modes": [], "render_fps": 30}  # noqa: RUF012  Gymnasium's own name

    def __init__(self, arms: TaskBatch, space: spaces.Box, *, render_mode: str | None) -> None:
        if render_mode is not None:
            raise CommandRejected(f"render_mode must be None, got {render_mode!r}", parameter="render_mode")
        self.render_mode = None
        self.observation_space = self._space = space
        self.action_space = action_space(arms.task)
        self._arms = arms
        self._open = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of what is drawn from now on.
            options: {"target": numbers} instead of a drawn one, as the task draws it: of the reach task x, y, z [m].

        Raises:
            ShapeError: the target does not have so many numbers.
            CommandRejected: an unknown option.
        """
        super().reset(seed=seed)
        wanted = dict(options or {})
        target = wanted.pop("target", None)
        if wanted:
            raise CommandRejected(f"unknown options: {', '.join(wanted)}", hint="the only option is 'target'")
        size = self._arms.target.shape[1]
        goals = None if target is None else array(target, size, "target")[None]
        own = None if seed is None else int(self.np_random.integers(2**63))
        seen = self._arms.reset(goals, seed=own)
        self._open = True
        tip, left = self._arms.outcome()
        return self._seen(seen), self._info(tip[0], float(left[0]), self._arms.target[0].copy(), 0.0)

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One decision.

        Args:
            action: shape (n,), clipped to +-1.

        Raises:
            ShapeError: another shape, or not finite.
            NotReady: the episode has ended, or has not started.
        """
        if not self._open:
            raise NotReady("no episode is running", hint="call reset()")
        target = self._arms.target[0].copy()
        step = self._arms.step(np.asarray(action)[None])
        ended = bool(step.done[0])
        self._open = not ended
        seen = step.final if ended else step.observation
        info = self._info(step.tip[0], float(step.distance[0]), target, float(step.force[0]))
        return self._seen(seen), float(step.reward[0]), False, ended, info

    def _seen(self, observation: npt.NDArray[np.float64]) -> Observation:
        space = self._space
        seen: Observation = np.clip(observation[0].astype(np.float32), space.low, space.high)
        return seen

    def _info(self, tip: Any, distance: float, target: Any, force: float) -> dict[str, Any]:
        return {
            "distance": distance,
            "is_success": distance <= self._arms.task.radius,
            "target": target,
            "tip": np.array(tip),
            "force": force,
        }


class ReachEnv(TaskEnv):
    """One simulated robot in the reach task.

    Args:
        task: the task; None: made of the next three.
        robot: "iiwa14" or "iiwa7".
        action: "joint" or "cartesian".
        feature: "" or "kinematic".
        engine: "plant": the virtual cabinet's plant with its servo at 1 kHz; "training": what policies are
            trained on, some ten times as fast.
        randomisation: what differs from episode to episode.
        render_mode: None; there are no pictures.

    Raises:
        CommandRejected: unknown robot, or a render mode.
        ShapeError: unknown engine, action or feature.
        MissingExtra: Gymnasium is not installed.
    """

    def __init__(
        self,
        task: ReachTask | None = None,
        *,
        robot: str = "iiwa14",
        action: str = "joint",
        feature: str = "",
        engine: str = "plant",
        randomisation: Randomisation = NONE,
        render_mode: str | None = None,
    ) -> None:
        word(engine, "engine", tuple(ENGINES))
        instance(randomisation, Randomisation, "randomisation")
        if task is not None:
            instance(task, ReachTask, "task")
        self.task = task or ReachTask(robot, action=action, feature=feature)
        arms = BatchReach(
            self.task,
            envs=1,
            randomisation=randomisation,
            threads=1,
            starts="together",
            engine=ENGINES[engine],
        )
        super().__init__(arms, observation_space(self.task), render_mode=render_mode)
