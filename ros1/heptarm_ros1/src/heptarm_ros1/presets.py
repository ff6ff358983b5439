"""States under the names of other drivers; see `heptarm.ros.interface.names`."""

from __future__ import annotations

from geometry_msgs.msg import Pose, Wrench
from sensor_msgs.msg import JointState

from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.state_messages import preset_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import State
from heptarm_ros1.convert import ROS
from heptarm_ros1.publishers import publisher


class PresetPublisher:
    """Publishes states under the names that the parameter `names` adds."""

    def __init__(self, configuration: NodeConfiguration) -> None:
        self._joints = configuration.joints
        kinds = {NameRole.JOINT_STATES: JointState, NameRole.POSE: Pose, NameRole.WRENCH: Wrench}
        self._publishers = [
            (entry, publisher(kinds[entry.role], entry.name))
            for entry in PRESETS[configuration.values["names"]].published()
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, one in self._publishers:
            message = preset_message(ROS, entry, state, self._joints)
            if message is not None:
                one.publish(message)

    def destroy(self) -> None:
        """Destroy the publishers."""
        for _, one in self._publishers:
            one.unregister()
