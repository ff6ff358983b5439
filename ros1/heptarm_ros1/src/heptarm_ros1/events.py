"""What the node publishes beside the arm's state: signals, keys, programs, collisions, the FRI session, transforms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import rospy
from geometry_msgs.msg import TransformStamped
from heptarm_msgs.msg import Collision, FriStatus, KeyEvent, MotionEvent, Signals
from tf2_msgs.msg import TFMessage

from heptarm.bridge.events import collision_message, event_message
from heptarm.bridge.frames import Frames
from heptarm.values import collision, event
from heptarm.values.state import State
from heptarm_ros1.convert import ROS
from heptarm_ros1.publishers import publisher

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode


class Events:
    """Publishes signals and keys as they change, transforms if wanted, and the FRI session when asked."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        self._signals = publisher(Signals, "~signals", latch=True)
        self._keys = publisher(KeyEvent, "~keys")
        self._fri = publisher(FriStatus, "~fri/status", latch=True)
        self._motions = publisher(MotionEvent, "~events")
        self._collisions = publisher(Collision, "~collisions")
        wanted = node.configuration.values["publish_tf"]
        self._tf = publisher(TFMessage, "/tf") if wanted else None
        self._frames: Frames | None = None
        self._last: dict[str, float] = {}
        self._told: Mapping[str, Any] = {"text": ""}

    def state(self, state: State) -> None:
        """Publish transforms, and the signals of a state if one has changed."""
        driver = self._node.driver
        if self._tf is not None and driver is not None:
            if self._frames is None:
                types = (TFMessage, TransformStamped)
                self._frames = Frames(ROS, self._node.configuration, driver.arm.robot, types)
            self._tf.publish(self._frames.of(state))
        if state.signals is None:
            return
        values = {name: float(value) for name, value in state.signals.items()}
        if values != self._last:
            self._last = values
            _send(self._signals, Signals(names=list(values), values=list(values.values())))

    def key(self, slot: int, down: bool) -> None:
        """Publish that a key was pressed or released."""
        _send(self._keys, KeyEvent(slot=slot, down=down))

    def motion(self, number: int, news: event.MotionEvent) -> None:
        """Publish what has become of a program."""
        self._motions.publish(event_message(ROS, number, news))

    def collision(self, found: collision.Collision) -> None:
        """Publish what the collision guard has met."""
        self._collisions.publish(collision_message(ROS, found, self._node.configuration.joints))

    def fri(self, status: Mapping[str, Any]) -> None:
        """Publish how the FRI session is, if there is one or it has just ended."""
        if status != self._told:
            self._told = status
            _send(self._fri, FriStatus(**status))

    def destroy(self) -> None:
        """End them."""
        for one in (self._signals, self._keys, self._motions, self._collisions, self._fri, self._tf):
            if one is not None:
                one.unregister()


def _send(topic: rospy.Publisher, message: Any) -> None:
    message.header.stamp = rospy.Time.now()
    topic.publish(message)
