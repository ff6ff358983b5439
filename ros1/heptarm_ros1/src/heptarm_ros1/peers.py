"""States under the names of other drivers; see `heptarm.bridge.names`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Pose, Wrench
from sensor_msgs.msg import JointState

from heptarm.bridge.names import PRESETS, Meaning
from heptarm.bridge.outputs import theirs
from heptarm.values.state import State
from heptarm_ros1.convert import ROS
from heptarm_ros1.publishers import publisher

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode


def actions() -> tuple[str, ...]:
    """Names of the trajectory action by the parameter `names`."""
    preset = PRESETS.get(str(rospy.get_param("~names", "heptarm")))
    entries = () if preset is None else preset.entries
    return tuple(entry.name for entry in entries if entry.meaning is Meaning.FOLLOW)


class Peers:
    """Publishes states as the parameter `names` asks for."""

    def __init__(self, node: HeptarmNode) -> None:
        self._joints = node.configuration.joints
        entries = PRESETS[node.configuration.values["names"]].entries
        kinds = {Meaning.JOINT_STATES: JointState, Meaning.POSE: Pose, Meaning.WRENCH: Wrench}
        self._publishers = [
            (entry, publisher(kinds[entry.meaning], entry.name)) for entry in entries if entry.is_published
        ]

    def state(self, state: State) -> None:
        """Publish a state."""
        for entry, one in self._publishers:
            message = theirs(ROS, entry, state, self._joints)
            if message is not None:
                one.publish(message)

    def destroy(self) -> None:
        """End them."""
        for _, one in self._publishers:
            one.unregister()
