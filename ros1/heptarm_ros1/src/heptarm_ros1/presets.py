"""States under the names of other drivers; see `heptarm.ros.interface.names`."""

from __future__ import annotations

from collections.abc import Callable

from heptarm.fri import State as FriState
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.state_messages import preset_event, preset_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.state import State
from heptarm_ros1.convert import ROS
from heptarm_ros1.publishers import publisher


class PresetPublisher:
    """Publishes states and events under the names that the parameter `names` adds.

    Args:
        configuration: of the node.
        fri: the newest message of the open FRI session; None: none is open.
    """

    def __init__(self, configuration: NodeConfiguration, *, fri: Callable[[], FriState | None]) -> None:
        self._names, self._fri = configuration, fri
        self._publishers = [
            (entry, publisher(class_of(entry.type, "msg"), entry.name))
            for entry in PRESETS[configuration.values["names"]].published()
        ]
        self._events = [
            (entry, publisher(class_of(entry.type, "msg"), entry.name))
            for entry in PRESETS[configuration.values["names"]].events()
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, one in self._publishers:
            if one.get_num_connections() == 0:
                continue
            message = preset_message(ROS, entry, one.data_class, state, self._names, self._fri())
            if message is not None:
                one.publish(message)

    def event(self, role: NameRole, value: str = "") -> None:
        """Publish that something has happened, on the topics of its role."""
        for entry, one in self._events:
            if entry.role is role:
                one.publish(preset_event(ROS, one.data_class, value))

    def destroy(self) -> None:
        """Destroy the publishers."""
        for _, one in self._publishers + self._events:
            one.unregister()
