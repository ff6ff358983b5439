"""The peg-in-hole task at Gymnasium: `make("heptarm/PegInHole-v0")`, and many arms at once by `make_vec`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, NotReady, require
from heptarm.rl.peg import PegInHole
from heptarm.rl.sim.batch import Step
from heptarm.rl.sim.peg_batch import BatchPeg
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.values.checks import array, instance

require("gymnasium", extra="rl")

import gymnasium  # noqa: E402  after the check that it is there
from gymnasium import spaces  # noqa: E402
from gymnasium.vector import AutoresetMode, VectorEnv  # noqa: E402
from gymnasium.vector.utils import batch_space  # noqa: E402

Numbers = npt.NDArray[np.float32]
#: Largest number of an observation; what is above is clipped.
LARGEST = 10.0


def observation_space(task: PegInHole) -> spaces.Box:
    """Space of the observations of a task."""
    return spaces.Box(-LARGEST, LARGEST, (task.observation_size,), dtype=np.float32)


def action_space(task: PegInHole) -> spaces.Box:
    """Space of the actions: fractions of the largest step."""
    return spaces.Box(-1.0, 1.0, (task.action_size,), dtype=np.float32)


def _seen(observation: npt.NDArray[np.float64]) -> Numbers:
    return np.clip(observation, -LARGEST, LARGEST).astype(np.float32)


class PegInHoleEnv(gymnasium.Env[Any, Any]):  # type: ignore[misc]  # gymnasium is not looked into
    """One simulated arm that inserts a peg.

    Episodes are truncated after `task.steps` decisions and never terminate. `info` holds "missing" (depth) [m],
    "is_success", "hole" (true pose in the frame of the presumed one, shape (6,) [m, rad]) and "force" [N].

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
        if render_mode is not None:
            raise CommandRejected(f"render_mode must be None, got {render_mode!r}", parameter="render_mode")
        self.render_mode = None
        self.task = task or PegInHole()
        self.observation_space, self.action_space = observation_space(self.task), action_space(self.task)
        self._arms = BatchPeg(self.task, envs=1, randomisation=randomisation, threads=1, starts="together")
        self._open = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of what is drawn from now on.
            options: {"hole": six numbers} instead of a drawn one, see `PegInHole.holes`.

        Raises:
            ShapeError: the hole does not have six numbers.
            CommandRejected: an unknown option.
        """
        super().reset(seed=seed)
        wanted = dict(options or {})
        hole = wanted.pop("hole", None)
        if wanted:
            raise CommandRejected(f"unknown options: {', '.join(wanted)}", hint="the only option is 'hole'")
        holes = None if hole is None else array(hole, 6, "hole")[None]
        own = None if seed is None else int(self.np_random.integers(2**63))
        seen = self._arms.reset(holes, seed=own)
        self._open = True
        missing = float(self.task.missing(self._arms.pose, self._arms.hole)[0])
        return _seen(seen[0]), self._info(missing, self._arms.hole[0].copy(), 0.0)

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """One decision; `action` of shape (5,), clipped to +-1.

        Raises:
            ShapeError: another shape, or not finite.
            NotReady: the episode has ended, or has not started.
        """
        if not self._open:
            raise NotReady("no episode is running", hint="call reset()")
        hole = self._arms.hole[0].copy()
        step = self._arms.step(np.asarray(action)[None])
        ended = bool(step.done[0])
        self._open = not ended
        seen = step.final if ended else step.observation
        info = self._info(float(step.distance[0]), hole, float(step.force[0]))
        return _seen(seen[0]), float(step.reward[0]), False, ended, info

    def _info(self, missing: float, hole: Any, force: float) -> dict[str, Any]:
        return {"missing": missing, "is_success": missing <= self.task.radius, "hole": hole, "force": force}


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
        info: dict[str, Any] = {"missing": step.distance, "is_success": success, "force": step.force}
        if step.done.any():
            last = np.empty(self.num_envs, dtype=object)
            for index, seen in zip(np.flatnonzero(step.done).tolist(), _seen(step.final), strict=True):
                last[index] = seen
            info |= {"final_obs": last, "_final_obs": step.done}
        return _seen(step.observation), step.reward, np.zeros(self.num_envs, dtype=np.bool_), step.done, info
