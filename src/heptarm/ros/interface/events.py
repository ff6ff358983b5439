"""Converts triggers from messages, and motion events and collisions to messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from heptarm.errors import CommandRejected, HeptarmError
from heptarm.ros.interface.conditions import condition_of
from heptarm.ros.interface.messages import RosAdapter, class_of, put
from heptarm.values.condition.collision import Collision
from heptarm.values.condition.trigger import Notify, SetOutput
from heptarm.values.motion.motion import Motion, Triggered
from heptarm.values.result import MotionEvent


def with_triggers(motion: Motion, messages: Sequence[Any]) -> Motion:
    """Add several heptarm_msgs/Trigger to a motion.

    Raises:
        CommandRejected: one is invalid, or this motion cannot have triggers.
    """
    if not len(messages):
        return motion
    if not isinstance(motion, Triggered):
        raise CommandRejected("hand guiding cannot have triggers", parameter="triggers")
    for index, message in enumerate(messages):
        name = f"triggers[{index}].condition"
        condition = condition_of(message.condition, name)
        if condition is None:
            raise CommandRejected(
                f"{name} must be a condition, got an empty text",
                parameter=name,
                hint='such as "path.before_end(0.02)"',
            )
        action = SetOutput(message.signal, float(message.value)) if message.signal else Notify(message.label)
        motion = motion.trigger(condition, action)
    return motion


def event_message(ros: RosAdapter, number: int, event: MotionEvent) -> Any:
    """Make a heptarm_msgs/MotionEvent.

    Args:
        ros: types and time of the ROS.
        number: of the program, as the cabinet counts.
        event: of the program.
    """
    action = None if event.trigger is None else event.trigger.action
    return _stamped(
        ros,
        "heptarm_msgs/MotionEvent",
        {
            "motion": number,
            "kind": event.kind,
            "item": event.item,
            "segment": event.segment,
            "label": event.label,
            "signal": action.signal if isinstance(action, SetOutput) else "",
            "time": float(event.time),
            "position": [] if event.state is None else event.state.q.tolist(),
            "code": event.code,
            "text": event.text,
        },
    )


def collision_message(ros: RosAdapter, found: Collision, joints: Sequence[str]) -> Any:
    """Make a heptarm_msgs/Collision.

    Args:
        ros: types and time of the ROS.
        found: the collision.
        joints: names.
    """
    position: list[float] = []
    if found.state is not None:
        try:
            position = found.state.q.tolist()
        except HeptarmError:  # the state has no joint positions
            position = []
    return _stamped(
        ros,
        "heptarm_msgs/Collision",
        {
            "joint": joints[found.joint],
            "torque": float(found.torque),
            "allowed": float(found.allowed),
            "position": position,
            "text": str(found),
        },
    )


def _stamped(ros: RosAdapter, kind: str, fields: dict[str, Any]) -> Any:
    message = class_of(kind, "msg")()
    put(message, {"header": {"stamp": ros.time(ros.now())}, **fields})
    return message
