"""What the node publishes beside the arm's state: signals, keys, programs, collisions, the FRI session, transforms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import TransformStamped
from heptarm_msgs.msg import Collision, FriStatus, KeyEvent, MotionEvent, Signals
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from heptarm.bridge.events import collision_message, event_message
from heptarm.bridge.frames import Frames
from heptarm.values import collision, event
from heptarm.values.state import State

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode


class Events:
    """Publishes signals and keys as they change, transforms if wanted, and the FRI session when asked."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._signals = node.create_publisher(Signals, "~/signals", latched)
        self._keys = node.create_publisher(KeyEvent, "~/keys", 10)
        self._fri = node.create_publisher(FriStatus, "~/fri/status", latched)
        self._motions = node.create_publisher(MotionEvent, "~/events", 100)
        self._collisions = node.create_publisher(Collision, "~/collisions", 10)
        self._tf = node.create_publisher(TFMessage, "/tf", 100) if node.value("publish_tf") else None
        self._frames: Frames | None = None
        self._last: dict[str, float] = {}
        self._told: Mapping[str, Any] = {"text": ""}

    def state(self, state: State) -> None:
        """Publish transforms, and the signals of a state if one has changed."""
        driver = self._node.driver
        if self._tf is not None and driver is not None:
            if self._frames is None:
                types = (TFMessage, TransformStamped)
                self._frames = Frames(self._node.ros, self._node.configuration, driver.arm.robot, types)
            self._tf.publish(self._frames.of(state))
        if state.signals is None:
            return
        values = {name: float(value) for name, value in state.signals.items()}
        if values != self._last:
            self._last = values
            message = Signals(names=list(values), values=list(values.values()))
            self._send(self._signals, message)

    def key(self, slot: int, down: bool) -> None:
        """Publish that a key was pressed or released."""
        self._send(self._keys, KeyEvent(slot=slot, down=down))

    def motion(self, number: int, news: event.MotionEvent) -> None:
        """Publish what has become of a program."""
        self._motions.publish(event_message(self._node.ros, number, news))

    def collision(self, found: collision.Collision) -> None:
        """Publish what the collision guard has met."""
        joints = self._node.configuration.joints
        self._collisions.publish(collision_message(self._node.ros, found, joints))

    def fri(self, status: Mapping[str, Any]) -> None:
        """Publish how the FRI session is, if there is one or it has just ended."""
        if status != self._told:
            self._told = status
            self._send(self._fri, FriStatus(**status))

    def _send(self, publisher: Any, message: Any) -> None:
        message.header.stamp = self._node.get_clock().now().to_msg()
        publisher.publish(message)

    def destroy(self) -> None:
        """End them."""
        for publisher in (self._signals, self._keys, self._motions, self._collisions, self._fri, self._tf):
            if publisher is not None:
                self._node.destroy_publisher(publisher)
