"""States under the names of other drivers; see `heptarm.ros.interface.names`."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions

from heptarm.fri import State as FriState
from heptarm.ros.interface.messages import RosAdapter, class_of
from heptarm.ros.interface.names import PRESETS, NameRole, PresetName
from heptarm.ros.interface.state_messages import preset_event, preset_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import State


class PresetPublisher:
    """Publishes states and events under the names that the parameter `names` adds.

    Args:
        node: publishes.
        ros: types and time.
        configuration: of the node.
        fri: the newest message of the open FRI session; None: none is open.
    """

    def __init__(
        self,
        node: Node,
        ros: RosAdapter,
        configuration: NodeConfiguration,
        *,
        fri: Callable[[], FriState | None],
    ) -> None:
        self._node, self._ros, self._names, self._fri = node, ros, configuration, fri
        preset = PRESETS[configuration.values["names"]]
        self._publishers = [(entry, self._publisher(entry)) for entry in preset.published()]
        self._events = [(entry, self._publisher(entry)) for entry in preset.events()]

    def _publisher(self, entry: PresetName) -> Publisher:
        return self._node.create_publisher(
            class_of(entry.type, "msg"),
            entry.name,
            10,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, publisher in self._publishers:
            if publisher.get_subscription_count() == 0:
                continue
            message = preset_message(self._ros, entry, publisher.msg_type, state, self._names, self._fri())
            if message is not None:
                publisher.publish(message)

    def event(self, role: NameRole, value: str = "") -> None:
        """Publish that something has happened, on the topics of its role."""
        for entry, publisher in self._events:
            if entry.role is role:
                publisher.publish(preset_event(self._ros, publisher.msg_type, value))

    def destroy(self) -> None:
        """Destroy the publishers."""
        for _, publisher in self._publishers + self._events:
            self._node.destroy_publisher(publisher)
