"""Publishers besides the robot state: signals, keys, motion events, collisions, the FRI session."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from heptarm_msgs.msg import Collision, FriStatus, KeyEvent, MotionEvent, Signals
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from heptarm.ros.interface.events import collision_message, event_message
from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values import result
from heptarm.values.condition import collision
from heptarm.values.io import SignalValue
from heptarm.values.state import State


class EventPublisher:
    """Publishes signals and keys when they change, events as they occur, and the FRI session periodically."""

    def __init__(self, node: Node, ros: RosAdapter, configuration: NodeConfiguration) -> None:
        self._node, self._ros, self._joints = node, ros, configuration.joints
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._signals = node.create_publisher(Signals, "~/signals", latched)
        self._keys = node.create_publisher(KeyEvent, "~/keys", 10)
        self._fri = node.create_publisher(FriStatus, "~/fri/status", latched)
        self._motions = node.create_publisher(MotionEvent, "~/events", 100)
        self._collisions = node.create_publisher(Collision, "~/collisions", 10)
        self._last_signals: dict[str, SignalValue] = {}
        self._last_fri: Mapping[str, Any] = {"text": ""}

    def state(self, state: State) -> None:
        """Publish the signals of a state if one has changed."""
        if state.groups.io is None:
            return
        values = dict(state.groups.io.items())
        if values != self._last_signals:
            self._last_signals = values
            self._publish(
                self._signals, Signals(names=list(values), values=list(map(float, values.values())))
            )

    def key(self, slot: int, down: bool) -> None:
        """Publish that a key was pressed or released."""
        self._publish(self._keys, KeyEvent(slot=slot, down=down))

    def motion(self, number: int, event: result.MotionEvent) -> None:
        """Publish an event of a program."""
        self._motions.publish(event_message(self._ros, number, event))

    def collision(self, found: collision.Collision) -> None:
        """Publish a collision."""
        self._collisions.publish(collision_message(self._ros, found, self._joints))

    def fri(self, status: Mapping[str, Any]) -> None:
        """Publish the status of the FRI session if it has changed."""
        if status != self._last_fri:
            self._last_fri = status
            self._publish(self._fri, FriStatus(**status))

    def _publish(self, publisher: Any, message: Any) -> None:
        message.header.stamp = self._node.get_clock().now().to_msg()
        publisher.publish(message)

    def destroy(self) -> None:
        """Destroy the publishers."""
        for publisher in (self._signals, self._keys, self._motions, self._collisions, self._fri):
            self._node.destroy_publisher(publisher)
