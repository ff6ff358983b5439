"""A task on a virtual arm as an environment of LeRobot: the whole cabinet, in real time, as a policy meets it.

Observations and actions are those of the robot heptarm, so that a policy that was trained on its recordings is judged
as it is. Without pictures the place of the body is there once more, as the state of the environment, which ACT needs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE
from lerobot_camera_heptarm import HeptarmCameraConfig
from lerobot_robot_heptarm import HeptarmRobot, HeptarmRobotConfig
from lerobot_robot_heptarm.scenes import HOME, TASKS, Leg, way
from lerobot_robot_heptarm.stepped import SteppedArm

import heptarm as ha

#: The camera of an environment.
CAMERA = "front"
#: Numbers at the end of a state that are the place of the task's body, x y z [m].
PLACE = 3


@EnvConfig.register_subclass("heptarm")
@dataclass
class HeptarmEnvConfig(EnvConfig):
    """What `--env...` sets.

    Attributes:
        task: "pick-place" or "peg".
        fps: steps per second, as in the recordings.
        size: width and height of the pictures [pixels]; 0: observations have no pictures, and the place of the
            body is also `observation.environment_state`.
        engine: "cabinet": a whole virtual arm, in real time; "stepped": its simulated robot alone, as fast as the
            processor allows, without pictures.
        speed: as of the robot.
        options: more for the virtual arm, such as "sensors=noisy".
    """

    task: str | None = "pick-place"
    fps: int = 15
    size: int = 96
    engine: str = "cabinet"
    speed: float = 0.5
    options: str = ""

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise ValueError(f"task must be one of {', '.join(TASKS)}, got {self.task}")
        if self.engine not in ("cabinet", "stepped"):
            raise ValueError(f"engine must be cabinet or stepped, got {self.engine}")
        if self.engine == "stepped" and (self.size or self.options):
            raise ValueError("the engine stepped has neither pictures nor options: use --env.size=0")
        robot = HeptarmRobot(self.robot)
        numbers = [kind for kind in robot.observation_features.values() if kind is float]
        self.features = {
            ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(len(robot.action_features),)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(len(numbers),)),
        }
        self.features_map = {ACTION: ACTION, "agent_pos": OBS_STATE}
        if not self.size:
            self.features["environment_state"] = PolicyFeature(type=FeatureType.ENV, shape=(PLACE,))
            self.features_map["environment_state"] = OBS_ENV_STATE
        if self.size:
            name = f"pixels/{CAMERA}"
            self.features[name] = PolicyFeature(type=FeatureType.VISUAL, shape=(self.size, self.size, 3))
            self.features_map[name] = f"{OBS_IMAGES}.{CAMERA}"

    @property
    def robot(self) -> HeptarmRobotConfig:
        """The robot of the recordings."""
        task = TASKS[str(self.task)]
        options = f"&{self.options}" if self.options else ""
        cameras = {CAMERA: HeptarmCameraConfig(width=self.size, height=self.size, fps=self.fps)}
        return HeptarmRobotConfig(
            id=f"env-{self.task}",
            target=f"sim://iiwa14?scene={task.scene}{options}",
            gripper="scene",
            speed=self.speed,
            bodies=[task.body],
            cameras=cameras if self.size else {},
        )

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """What `HeptarmEnv` takes."""
        return {"config": self}

    def create_envs(
        self, n_envs: int, use_async_envs: bool = False
    ) -> dict[str, dict[int, gym.vector.VectorEnv]]:
        """Virtual arms, one for each environment, stepped one after the other in real time."""
        if n_envs != 1:
            raise ValueError(f"a virtual arm runs in real time: use --eval.batch_size=1, got {n_envs}")
        make: Callable[[], gym.Env] = lambda: HeptarmEnv(self)  # noqa: E731
        envs = gym.vector.SyncVectorEnv([make], autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
        return {self.type: {0: envs}}


class HeptarmEnv(gym.Env):
    """A virtual arm, its scene, and a task."""

    def __init__(self, config: HeptarmEnvConfig) -> None:
        self.config = config
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": config.fps}
        self.render_mode = "rgb_array"
        self._task = TASKS[str(config.task)]
        self.task_description = self._task.words
        self._max_episode_steps = round(self._task.duration * config.fps)
        self._robot = HeptarmRobot(config.robot)
        count = len(self._robot.action_features)
        self._names = [name for name, kind in self._robot.observation_features.items() if kind is float]
        self.action_space = gym.spaces.Box(-np.pi, np.pi, (count,), np.float32)
        spaces: dict[str, gym.Space] = {
            "agent_pos": gym.spaces.Box(-np.inf, np.inf, (len(self._names),), np.float64)
        }
        if not config.size:
            spaces["environment_state"] = gym.spaces.Box(-np.inf, np.inf, (PLACE,), np.float64)
        if config.size:
            picture = gym.spaces.Box(0, 255, (config.size, config.size, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict({CAMERA: picture})
        self.observation_space = gym.spaces.Dict(spaces)
        self._steps, self._due = 0, 0.0
        self.legs: list[Leg] = []
        self._picture = np.zeros((max(config.size, 16), max(config.size, 16), 3), np.uint8)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Bring the arm home, and the bodies to new places."""
        super().reset(seed=seed)
        if self.config.engine == "stepped":
            self._robot.attach(SteppedArm(self._task.scene))
        else:
            if not self._robot.is_connected:
                self._robot.connect()
            self._robot.rest()
            self._robot.arm.move(ha.ptp(HOME), speed=0.5)
            self._robot.arm.operator.reset()
        self.legs = self._task.prepare(self._robot.arm, self.np_random)
        self._steps, self._due = 0, time.monotonic()
        return self._observation(), {"is_success": False}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Send an action, and wait until the step is over.

        An action that is not finite ends the episode: the arm rests.
        """
        self._steps += 1
        failed = not np.isfinite(action).all()
        if failed:
            self._robot.rest()
        else:
            self._robot.send_action(dict(zip(self._robot.action_features, map(float, action), strict=True)))
            self._pass(1.0 / self.config.fps)
        is_last = self._steps >= self._max_episode_steps
        done = (is_last or self._home) and self._task.is_done(self._robot.arm)
        info = {"is_success": done}
        return self._observation(), float(done), done or failed, is_last, info

    def _pass(self, period: float) -> None:
        """Wait until the time of a step is over [s]."""
        if self.config.engine == "stepped":
            self._robot.arm.step(period)
            return
        self._due = max(self._due + period, time.monotonic() - period)
        time.sleep(max(self._due - time.monotonic(), 0.0))

    def way(self) -> Iterator[tuple[np.ndarray, bool]]:
        """How to do the task from here: joint positions and the gripper, `FINE` in a second."""
        return way(self._robot.arm, self.legs)

    @property
    def _home(self) -> bool:
        """Whether the arm is back, and has let go."""
        q = self._robot.arm.state.q
        return self._steps > 1 and bool(np.abs(q - HOME).max() < 0.1)

    def _observation(self) -> dict[str, Any]:
        seen = self._robot.get_observation()
        numbers = np.array([seen[name] for name in self._names])
        observation: dict[str, Any] = {"agent_pos": numbers}
        if not self.config.size:
            observation["environment_state"] = numbers[-PLACE:]
        if self.config.size:
            self._picture = seen[CAMERA]
            observation["pixels"] = {CAMERA: self._picture}
        return observation

    def render(self) -> np.ndarray:
        """The newest picture."""
        return self._picture

    def close(self) -> None:
        """Let the arm rest, and end its cabinet."""
        if self._robot.is_connected:
            self._robot.disconnect()
