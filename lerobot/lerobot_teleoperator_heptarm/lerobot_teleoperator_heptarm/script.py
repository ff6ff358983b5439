"""A script leads a virtual arm through a task of its scene: demonstrations without a hand.

It knows from the simulator where the bodies are. Before each episode it puts them to places drawn at random; then it
does the task, and the arm rests at the place where it began.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from lerobot.teleoperators import TeleoperatorConfig
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot_robot_heptarm import HeptarmRobot
from lerobot_robot_heptarm.robot import JOINTS, before_episode
from lerobot_robot_heptarm.scenes import FINE, TASKS, way

from lerobot_teleoperator_heptarm.teleoperator import JointTeleoperator


@TeleoperatorConfig.register_subclass("heptarm_script")
@dataclass(kw_only=True)
class HeptarmScriptConfig(TeleoperatorConfig):
    """What `--teleop...` sets.

    Attributes:
        task: "pick-place" of the scene `bins`, or "peg" of `peg-in-hole`.
        seed: of the places.
        noise: standard deviation of the targets [rad], so that demonstrations show how to come back.
        gripper: part of the actions; the tasks need one.
    """

    task: str = "pick-place"
    seed: int = 0
    noise: float = 0.0
    gripper: bool = True

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise ValueError(f"task must be one of {', '.join(TASKS)}, got {self.task}")


class HeptarmScript(JointTeleoperator):
    """Leads the connected virtual arm."""

    config_class = HeptarmScriptConfig
    name = "heptarm_script"

    def __init__(self, config: HeptarmScriptConfig) -> None:
        super().__init__(config)
        self.config = config
        self._leads = False
        self._random = np.random.default_rng(config.seed)
        self._way: list[tuple[np.ndarray, bool]] = []
        self._began: float | None = None

    @property
    def is_connected(self) -> bool:
        """Whether it leads an arm."""
        return self._leads

    def connect(self, calibrate: bool = True) -> None:
        """Lead the robot that is connected in this process, before or after this."""
        if self._leads:
            raise DeviceAlreadyConnectedError("the script already leads an arm")
        self._leads = True
        before_episode.append(self._begin)

    def disconnect(self) -> None:
        """Lead it no more."""
        if not self._leads:
            raise DeviceNotConnectedError("the script leads no arm")
        self._leads = False
        before_episode.remove(self._begin)

    def get_action(self) -> dict[str, Any]:
        """The place on its way for this moment."""
        if not self._leads:
            raise DeviceNotConnectedError("the script leads no arm")
        if not self._way:
            raise DeviceNotConnectedError(
                "the script leads a robot heptarm, and asks for its observation first"
            )
        if self._began is None:
            self._began = time.monotonic()
        index = min(int((time.monotonic() - self._began) * FINE), len(self._way) - 1)
        q, opens = self._way[index]
        noisy = q + self.config.noise * self._random.standard_normal(7)
        action = {f"{joint}.pos": float(value) for joint, value in zip(JOINTS, noisy, strict=True)}
        return {**action, "gripper.pos": float(opens)}

    def _begin(self, robot: HeptarmRobot) -> None:
        """Put the bodies to new places, and plan the way from where the arm is."""
        robot.rest()
        robot.arm.operator.reset()
        legs = TASKS[self.config.task].prepare(robot.arm, self._random)
        self._way, self._began = list(way(robot.arm, legs)), None
