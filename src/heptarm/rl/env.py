"""Tasks as Gymnasium environments: one arm by `make("heptarm/Push-v0")`, many at once in one process by `make_vec`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, NotReady, require
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.sim.batch import Engine
from heptarm.rl.sim.episodes import BatchSettings, TaskBatch
from heptarm.rl.sim.plant_engine import PlantEngine
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.sim.simulate import simulate
from heptarm.rl.task import COARSE, ReachTask
from heptarm.rl.tasks import Task, environment, task_named
from heptarm.values.camera import Camera
from heptarm.values.checks import array, instance, word

require("gymnasium", extra="rl")

import gymnasium  # noqa: E402  after the check that it is there
from gymnasium import spaces  # noqa: E402
from gymnasium.vector import AutoresetMode, VectorEnv  # noqa: E402
from gymnasium.vector.utils import batch_space  # noqa: E402

ENGINES = {"plant": PlantEngine, "training": Engine}
Observation = npt.NDArray[np.float32]
#: Largest distance of a target from the base [m].
FARTHEST = 2.0
#: Largest number of an observation of a task with contacts; what is above is clipped.
LARGEST = 10.0
#: What `render` shows.
_VIEW = Camera(place=(1.5, -0.9, 0.9), target=(0.45, 0.0, 0.35))


def observation_space(task: Task) -> spaces.Box:
    """Space of the observations of a task; of the reach task for all targets of a robot."""
    if not isinstance(task, ReachTask):
        return spaces.Box(-LARGEST, LARGEST, (task.observation_size,), dtype=np.float32)
    high = np.ones(task.observation_size, dtype=np.float32)
    high[:7] = 1.5
    high[14:17] = FARTHEST
    high[17:20] = 2 * FARTHEST / COARSE
    return spaces.Box(-high, high, dtype=np.float32)


def _seen(observation: npt.NDArray[np.float64], space: spaces.Box) -> Observation:
    """An observation as its space has it; what is beyond is clipped."""
    return np.clip(observation, space.low, space.high).astype(np.float32)


def _arms(
    task: Task, randomisation: Randomisation, *, envs: int = 1, threads: int = 1, engine: str = "training"
) -> TaskBatch:
    settings = BatchSettings(envs=envs, randomisation=randomisation, threads=threads, starts="together")
    return simulate(task, settings, engine=ENGINES[engine])


def action_space(task: Task) -> spaces.Box:
    """Space of the actions: fractions of the largest step."""
    return spaces.Box(-1.0, 1.0, (task.action_size,), dtype=np.float32)


class TaskEnv(gymnasium.Env[Any, Any]):  # type: ignore[misc]  # gymnasium is not looked into
    """One simulated arm in a task.

    Episodes are truncated after `task.steps` decisions and never terminate. `info` holds "distance" [m],
    "is_success" (within the radius now), "target" as the task draws it, "tip", shape (3,) [m], and "force" [N].

    Args:
        arms: the simulation, of one arm.
        steps: decisions of an episode.
        render_mode: "rgb_array": `render` draws the arm; None: it does not.

    Raises:
        CommandRejected: another render mode.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 30}  # noqa: RUF012  Gymnasium's own name

    def __init__(self, arms: TaskBatch, *, steps: int, render_mode: str | None) -> None:
        if render_mode is not None:
            word(render_mode, "render_mode", ("rgb_array",))
        self.render_mode = render_mode
        self._view: Any = None
        self.observation_space = self._space = observation_space(arms.task)
        self.action_space = action_space(arms.task)
        self._arms, self._steps = arms, steps
        self._open = False

    def render(self) -> Any:
        """A picture of the arm: red, green, blue, shape (height, width, 3); None without a render mode.

        Raises:
            CommandRejected: this machine cannot draw.
        """
        if self.render_mode is None:
            return None
        if self._view is None:
            from heptarm.rl.sim.pictures import TaskPictures  # needs what draws

            self._view = TaskPictures(self._arms.task, {"view": _VIEW})
        return self._view.draw(self._arms)["view"]

    def _seen(self, observation: Observation) -> Any:
        """What is observed, for numbers of the task."""
        return observation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
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
        info = self._info(tip[0], float(left[0]), self._arms.target[0].copy(), 0.0)
        return self._seen(_seen(seen[0], self._space)), info

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """One decision.

        Args:
            action: shape (n,), clipped to +-1.

        Raises:
            ShapeError: another shape.
            LimitError: not finite.
            NotReady: the episode has ended, or has not started.
        """
        if not self._open:
            raise NotReady("no episode is running", hint="call reset()")
        target = self._arms.target[0].copy()
        step = self._arms.step(np.asarray(action)[None])
        is_begun = bool(step.done[0])
        ended = is_begun or int(self._arms.age[0]) >= self._steps
        self._open = not ended
        seen = step.final if is_begun else step.observation
        info = self._info(step.tip[0], float(step.distance[0]), target, float(step.force[0]))
        return self._seen(_seen(seen[0], self._space)), float(step.reward[0]), False, ended, info

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
        render_mode: "rgb_array": `render` draws the arm; None: it does not.

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
        arms = _arms(self.task, randomisation, engine=engine)
        super().__init__(arms, steps=self.task.steps, render_mode=render_mode)


class ContactEnv(TaskEnv):
    """One simulated arm in a task with contacts; "distance" is what is missing for success [m].

    Args:
        task: the task, or the name of one with its defaults.
        name: of the task that the environment is for; "": of any.
        randomisation: latency and bandwidth that differ from episode to episode.
        pictures: cameras by their names: an observation is a dictionary then, with the numbers as "state" and the
            pictures under these names. Set MUJOCO_GL to egl or osmesa where there is no display. None: numbers alone.
        render_mode: "rgb_array": `render` draws the arm; None: it does not.

    Raises:
        CommandRejected: no such task, one of another name, a render mode, a randomisation that the task has not, a
            picture that is named "state", or a machine that cannot draw.
        MissingExtra: Gymnasium is not installed.
    """

    def __init__(
        self,
        task: ContactTask | str = "peg-in-hole",
        *,
        name: str = "",
        randomisation: Randomisation = NONE,
        pictures: Mapping[str, Camera] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.task = _task(task, name)
        instance(self.task, ContactTask, "task")
        instance(randomisation, Randomisation, "randomisation")
        # one decision more than an episode, so that its last picture is not of the next one
        arms = _arms(replace(self.task, steps=self.task.steps + 1), randomisation)
        super().__init__(arms, steps=self.task.steps, render_mode=render_mode)
        self._pictures: Any = None
        if pictures is not None:
            from heptarm.rl.sim.pictures import TaskPictures  # needs what draws

            if "state" in instance(pictures, Mapping, "pictures"):
                raise CommandRejected(
                    'pictures must not be named "state", which the numbers are', parameter="pictures"
                )
            self._pictures = TaskPictures(self.task, pictures)
            views = {
                name: spaces.Box(0, 255, (height, width, 3), dtype=np.uint8)
                for name, (width, height) in self._pictures.sizes.items()
            }
            self.observation_space = spaces.Dict({"state": self._space, **views})

    def _seen(self, observation: Observation) -> Any:
        if self._pictures is None:
            return observation
        return {"state": observation, **self._pictures.draw(self._arms)}


class TaskVectorEnv(VectorEnv):  # type: ignore[misc]  # gymnasium is not looked into
    """Many simulated arms in a task, in one process; an episode that ends begins again within the same step.

    Args:
        num_envs: number of arms.
        task: the task, or the name of one with its defaults.
        name: of the task that the environment is for; "": of any.
        randomisation: what differs from episode to episode; of tasks with contacts: latency and bandwidth.
        threads: of the simulation.

    Raises:
        CommandRejected: no such task, one of another name, or a randomisation that the task has not.
        LimitError: no arms, or no threads.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012  Gymnasium's own name

    def __init__(
        self,
        num_envs: int = 1,
        *,
        task: Task | str = ReachTask.name,
        name: str = "",
        randomisation: Randomisation = NONE,
        threads: int = 2,
    ) -> None:
        self.task, self.render_mode = _task(task, name), None
        self._arms = _arms(self.task, randomisation, envs=num_envs, threads=threads)
        self.num_envs = num_envs
        self.single_observation_space = observation_space(self.task)
        self.single_action_space = action_space(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode of every arm.

        Raises:
            CommandRejected: options, of which there are none.
        """
        super().reset(seed=seed)
        if options:
            raise CommandRejected(f"unknown options: {', '.join(options)}", hint="there are none")
        return _seen(self._arms.reset(seed=seed), self.single_observation_space), {}

    def step(self, actions: Observation) -> tuple[Observation, Any, Any, Any, dict[str, Any]]:
        """One decision of every arm; `actions` of shape (num_envs, n), clipped to +-1.

        Raises:
            ShapeError: another shape.
            LimitError: not finite.
        """
        step, space = self._arms.step(actions), self.single_observation_space
        success = step.distance <= self.task.radius
        info: dict[str, Any] = {"distance": step.distance, "is_success": success, "force": step.force}
        if step.done.any():
            last = np.empty(self.num_envs, dtype=object)
            for index, seen in zip(np.flatnonzero(step.done).tolist(), _seen(step.final, space), strict=True):
                last[index] = seen
            info |= {"final_obs": last, "_final_obs": step.done}
        goes_on = np.zeros(self.num_envs, dtype=np.bool_)
        return _seen(step.observation, space), step.reward, goes_on, step.done, info


class ReachVectorEnv(TaskVectorEnv):
    """Many simulated robots in the reach task; arguments of `TaskVectorEnv`."""

    def __init__(self, num_envs: int = 1, **settings: Any) -> None:
        super().__init__(num_envs, name=ReachTask.name, **settings)


def _task(task: Task | str, name: str) -> Any:
    """A task for an environment of this name; "": for any."""
    found = task_named(task) if isinstance(task, str) else instance(task, (ReachTask, ContactTask), "task")
    if instance(name, str, "name") not in ("", found.name):
        raise CommandRejected(
            f"task must be {name} in the environment of this task, got {found.name}",
            parameter="task",
            value=found.name,
            hint=f'gymnasium.make("{environment(type(found))}", task=...)',
        )
    return found
