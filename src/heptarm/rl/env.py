"""The task as a Gymnasium environment with one robot: `gymnasium.make("heptarm/Reach-v0")`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, NotReady, require
from heptarm.rl.sim.batch import BatchReach, Engine
from heptarm.rl.sim.plant_engine import PlantEngine
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.task import COARSE, ReachTask
from heptarm.values.checks import array, instance, word

require("gymnasium", extra="rl")

import gymnasium  # noqa: E402  after the check that it is there
from gymnasium import spaces  # noqa: E402

ENGINES = {"plant": PlantEngine, "training": Engine}
Observation = npt.NDArray[np.float32]
#: Largest distance of a target from the base [m].
FARTHEST = 2.0


def observation_space(task: ReachTask) -> spaces.Box:
    """Space of the observations of a task, for all targets of a robot."""
    high = np.ones(task.observation_size, dtype=np.float32)
    high[:7] = 1.5
    high[14:17] = FARTHEST
    high[17:20] = 2 * FARTHEST / COARSE
    return spaces.Box(-high, high, dtype=np.float32)


def action_space(task: ReachTask) -> spaces.Box:
    """Space of the actions: fractions of the largest step."""
    return spaces.Box(-1.0, 1.0, (task.action_size,), dtype=np.float32)


class ReachEnv(gymnasium.Env[Any, Any]):  # type: ignore[misc]  # gymnasium is not looked into
    """One simulated robot in the reach task.

    Episodes are truncated after `task.steps` decisions and never terminate. `info` holds "distance" [m],
    "is_success" (within the radius now), "target" and "tip", both shape (3,) [m].

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

    metadata = {"render_modes": [], "render_fps": 30}  # noqa: RUF012  Gymnasium's own name

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
        if render_mode is not None:
            raise CommandRejected(f"render_mode must be None, got {render_mode!r}", parameter="render_mode")
        self.render_mode = None
        self.task = task or ReachTask(robot, action=action, feature=feature)
        self._space = observation_space(self.task)
        self.observation_space = self._space
        self.action_space = action_space(self.task)
        self._arms = BatchReach(
            self.task,
            envs=1,
            randomisation=randomisation,
            threads=1,
            starts="together",
            engine=ENGINES[engine],
        )
        self._open = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of what is drawn from now on.
            options: {"target": (x, y, z)} in the base frame [m] instead of a drawn one.

        Raises:
            ShapeError: the target does not have three numbers.
            CommandRejected: an unknown option.
        """
        super().reset(seed=seed)
        wanted = dict(options or {})
        target = wanted.pop("target", None)
        if wanted:
            raise CommandRejected(f"unknown options: {', '.join(wanted)}", hint="the only option is 'target'")
        goals = None if target is None else array(target, 3, "target")[None]
        own = None if seed is None else int(self.np_random.integers(2**63))
        seen = self._arms.reset(goals, seed=own)
        self._open = True
        tip = self.task.tip(self._arms.q)
        return self._seen(seen), self._info(tip[0], float(self.task.distance(tip, self._arms.target)[0]))

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One decision.

        Args:
            action: shape (7,) or (3,), clipped to +-1.

        Raises:
            ShapeError: another shape, or not finite.
            NotReady: the episode has ended, or has not started.
        """
        if not self._open:
            raise NotReady("no episode is running", hint="call reset()")
        target = self._arms.target.copy()
        step = self._arms.step(np.asarray(action)[None])
        ended = bool(step.done[0])
        self._open = not ended
        seen = step.final if ended else step.observation
        info = self._info(step.tip[0], float(step.distance[0]), target[0])
        return self._seen(seen), float(step.reward[0]), False, ended, info

    def _seen(self, observation: npt.NDArray[np.float64]) -> Observation:
        space = self._space
        seen: Observation = np.clip(observation[0].astype(np.float32), space.low, space.high)
        return seen

    def _info(self, tip: Any, distance: float, target: Any = None) -> dict[str, Any]:
        goal = self._arms.target[0].copy() if target is None else target
        return {
            "distance": distance,
            "is_success": distance <= self.task.radius,
            "target": goal,
            "tip": np.array(tip),
        }
