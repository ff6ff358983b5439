"""States under the names of other drivers; see `heptarm.ros.interface.names`."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from heptarm.ros.interface.messages import RosAdapter, class_of
from heptarm.ros.interface.names import PRESETS
from heptarm.ros.interface.state_messages import preset_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import State


class PresetPublisher:
    """Publishes states under the names that the parameter `names` adds."""

    def __init__(self, node: Node, ros: RosAdapter, configuration: NodeConfiguration) -> None:
        self._node, self._ros, self._names = node, ros, configuration
        self._publishers = [
            (
                entry,
                node.create_publisher(
                    class_of(entry.type, "msg"),
                    entry.name,
                    10,
                    qos_overriding_options=QoSOverridingOptions.with_default_policies(),
                ),
            )
            for entry in PRESETS[configuration.values["names"]].published()
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, publisher in self._publishers:
            message = preset_message(self._ros, entry, publisher.msg_type, state, self._names)
            if message is not None:
                publisher.publish(message)

    def destroy(self) -> None:
        """Destroy the publishers."""
        for _, publisher in self._publishers:
            self._node.destroy_publisher(publisher)
