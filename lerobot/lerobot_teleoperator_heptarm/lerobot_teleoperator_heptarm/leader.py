"""Another arm, guided by a hand, leads."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from lerobot.teleoperators import TeleoperatorConfig
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot_robot_heptarm.robot import JOINTS

import heptarm as ha
from lerobot_teleoperator_heptarm.teleoperator import JointTeleoperator


@TeleoperatorConfig.register_subclass("heptarm_leader")
@dataclass(kw_only=True)
class HeptarmLeaderConfig(TeleoperatorConfig):
    """What `--teleop...` sets.

    Attributes:
        target: of the arm that leads, as in `heptarm.connect`.
        gripper: signal of the leader that opens the follower's gripper while it is on; "": there is none.
        compliant: make the leader compliant, so that a hand can guide it; otherwise a program moves it.
    """

    target: str
    gripper: str = ""
    compliant: bool = True


class HeptarmLeader(JointTeleoperator):
    """An iiwa, real or virtual, whose joints are the actions."""

    config_class = HeptarmLeaderConfig
    name = "heptarm_leader"

    def __init__(self, config: HeptarmLeaderConfig) -> None:
        super().__init__(config)
        self.config = config
        self._arm: ha.Arm | None = None
        self._block = ExitStack()

    @property
    def is_connected(self) -> bool:
        """Whether it is connected."""
        return self._arm is not None

    def connect(self, calibrate: bool = True) -> None:
        """Connect to the leader; a compliant one gives way to a hand from now on."""
        if self.is_connected:
            raise DeviceAlreadyConnectedError("the leader is already connected")
        block = ExitStack()
        with block:
            arm = block.enter_context(
                ha.connect(self.config.target, control=self.config.compliant, watchdog=5.0)
            )
            if self.config.compliant:
                handle = arm.start(ha.hold(), mode=ha.compliance("xyzabc"))
                block.callback(handle.cancel)
            self._arm, self._block = arm, block.pop_all()

    def get_action(self) -> dict[str, Any]:
        """Where the leader's joints are."""
        if self._arm is None:
            raise DeviceNotConnectedError("the leader is not connected")
        action = {
            f"{joint}.pos": float(value) for joint, value in zip(JOINTS, self._arm.state.q, strict=True)
        }
        if self.config.gripper:
            action["gripper.pos"] = float(self._arm.io[self.config.gripper])
        return action

    def disconnect(self) -> None:
        """Let the leader rest, and end the connection."""
        if self._arm is None:
            raise DeviceNotConnectedError("the leader is not connected")
        self._arm = None
        self._block.close()
