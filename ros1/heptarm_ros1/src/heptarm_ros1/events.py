"""Publishers besides the robot state: signals, keys, motion events, collisions, the FRI session."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import rospy
from heptarm_msgs.msg import Collision, FriStatus, KeyEvent, MotionEvent, Signals

from heptarm.ros.interface.events import collision_message, event_message
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values import result
from heptarm.values.condition import collision
from heptarm.values.io import SignalValue
from heptarm.values.state import State
from heptarm_ros1.convert import ROS
from heptarm_ros1.publishers import publisher


class EventPublisher:
    """Publishes signals and keys when they change, events as they occur, and the FRI session periodically."""

    def __init__(self, configuration: NodeConfiguration) -> None:
        self._joints = configuration.joints
        self._signals = publisher(Signals, "~signals", latch=True)
        self._keys = publisher(KeyEvent, "~keys")
        self._fri = publisher(FriStatus, "~fri/status", latch=True)
        self._motions = publisher(MotionEvent, "~events")
        self._collisions = publisher(Collision, "~collisions")
        self._last_signals: dict[str, SignalValue] = {}
        self._last_fri: Mapping[str, Any] = {"text": ""}

    def state(self, state: State) -> None:
        """Publish the signals of a state if one has changed."""
        if state.groups.io is None:
            return
        values = dict(state.groups.io.items())
        if values != self._last_signals:
            self._last_signals = values
            _publish(self._signals, Signals(names=list(values), values=list(map(float, values.values()))))

    def key(self, slot: int, down: bool) -> None:
        """Publish that a key was pressed or released."""
        _publish(self._keys, KeyEvent(slot=slot, down=down))

    def motion(self, number: int, event: result.MotionEvent) -> None:
        """Publish an event of a program."""
        self._motions.publish(event_message(ROS, number, event))

    def collision(self, found: collision.Collision) -> None:
        """Publish a collision."""
        self._collisions.publish(collision_message(ROS, found, self._joints))

    def fri(self, status: Mapping[str, Any]) -> None:
        """Publish the status of the FRI session if it has changed."""
        if status != self._last_fri:
            self._last_fri = status
            _publish(self._fri, FriStatus(**status))

    def destroy(self) -> None:
        """Destroy the publishers."""
        for one in (self._signals, self._keys, self._motions, self._collisions, self._fri):
            one.unregister()


def _publish(topic: rospy.Publisher, message: Any) -> None:
    message.header.stamp = rospy.Time.now()
    topic.publish(message)
