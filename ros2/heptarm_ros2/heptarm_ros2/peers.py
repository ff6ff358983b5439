"""States under the names of other drivers; see `heptarm.bridge.names`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import Pose, Wrench
from sensor_msgs.msg import JointState

from heptarm.bridge.names import PRESETS, Entry, Meaning
from heptarm.bridge.outputs import theirs
from heptarm.values.state import State

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode


def entries(node: HeptarmNode, *meanings: Meaning) -> tuple[Entry, ...]:
    """What the parameter `names` asks for, of these meanings."""
    return tuple(entry for entry in PRESETS[node.value("names")].entries if entry.meaning in meanings)


class Peers:
    """Publishes states as the parameter `names` asks for."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        kinds = {Meaning.JOINT_STATES: JointState, Meaning.POSE: Pose, Meaning.WRENCH: Wrench}
        self._publishers = [
            (entry, node.create_publisher(kinds[entry.meaning], entry.name, 10))
            for entry in entries(node, *kinds)
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, one in self._publishers:
            message = theirs(self._node.ros, entry, state, self._node.configuration.joints)
            if message is not None:
                one.publish(message)

    def destroy(self) -> None:
        """End them."""
        for _, one in self._publishers:
            self._node.destroy_publisher(one)
