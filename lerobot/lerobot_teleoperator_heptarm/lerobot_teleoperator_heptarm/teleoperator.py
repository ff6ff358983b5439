"""What the teleoperators of heptarm share: actions of the robot heptarm, nothing to calibrate, no feedback."""

from __future__ import annotations

from typing import Any

from lerobot.teleoperators import Teleoperator
from lerobot_robot_heptarm.robot import JOINTS


class JointTeleoperator(Teleoperator):
    """Commands joint positions, and a gripper if `config.gripper` is set."""

    @property
    def action_features(self) -> dict[str, Any]:
        """Joint positions [rad], and the gripper: 0 closed, 1 open."""
        names = [f"{joint}.pos" for joint in JOINTS]
        return dict.fromkeys([*names, "gripper.pos"] if self.config.gripper else names, float)

    @property
    def feedback_features(self) -> dict[str, Any]:
        """None."""
        return {}

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing: it has no motors for feedback."""

    @property
    def is_calibrated(self) -> bool:
        """Always: it has nothing to calibrate."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""
