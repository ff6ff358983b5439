"""States under the names of other drivers; see `heptarm.ros.interface.names`."""

from __future__ import annotations

from geometry_msgs.msg import Pose, Wrench
from rclpy.node import Node
from sensor_msgs.msg import JointState

from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.state_messages import preset_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import State


class PresetPublisher:
    """Publishes states under the names that the parameter `names` adds."""

    def __init__(self, node: Node, ros: RosAdapter, configuration: NodeConfiguration) -> None:
        self._node, self._ros, self._joints = node, ros, configuration.joints
        kinds = {NameRole.JOINT_STATES: JointState, NameRole.POSE: Pose, NameRole.WRENCH: Wrench}
        self._publishers = [
            (entry, node.create_publisher(kinds[entry.role], entry.name, 10))
            for entry in PRESETS[configuration.values["names"]].published()
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, publisher in self._publishers:
            message = preset_message(self._ros, entry, state, self._joints)
            if message is not None:
                publisher.publish(message)

    def destroy(self) -> None:
        """Destroy the publishers."""
        for _, publisher in self._publishers:
            self._node.destroy_publisher(publisher)
