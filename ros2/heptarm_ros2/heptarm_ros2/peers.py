"""Topics under the names of other drivers; see `heptarm.bridge.names`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import Pose, Wrench
from sensor_msgs.msg import JointState

from heptarm.bridge import names
from heptarm.bridge.driver import Driver
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


def joint(driver: Driver, message: JointState) -> None:
    """A command for joints as libiiwa takes it."""
    driver.move(names.joint_target(driver, message.name, message.position))


def cartesian(driver: Driver, message: Pose) -> None:
    """A command for a pose as libiiwa takes it."""
    place, turn = message.position, message.orientation
    driver.move(names.pose_target(driver, (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)))
