"""Triggers and collisions as messages: what the cabinet is to do on the way, and what becomes of a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from heptarm.bridge.conditions import condition_of
from heptarm.bridge.messages import Ros, class_of, put
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.collision import Collision
from heptarm.values.event import MotionEvent
from heptarm.values.motion import Motion
from heptarm.values.trigger import Notify, SetOutput, Triggered


def with_triggers(motion: Motion, messages: Sequence[Any]) -> Motion:
    """A motion with the triggers of several heptarm_msgs/Trigger.

    Raises:
        CommandRejected: one is none, or this motion has none.
    """
    if not len(messages):
        return motion
    if not isinstance(motion, Triggered):
        raise CommandRejected("hand guiding has no triggers", parameter="triggers")
    for index, one in enumerate(messages):
        name = f"triggers[{index}].condition"
        condition = condition_of(one.condition, name)
        if condition is None:
            raise CommandRejected(
                f"{name} is empty", parameter=name, hint='give one, such as "path.before_end(0.02)"'
            )
        action = SetOutput(one.signal, float(one.value)) if one.signal else Notify(one.label)
        motion = motion.trigger(condition, action)
    return motion


def event_message(ros: Ros, number: int, event: MotionEvent) -> Any:
    """What has become of a program, as heptarm_msgs/MotionEvent.

    Args:
        ros: of which ROS.
        number: the cabinet's, of the program.
        event: what has happened.
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


def collision_message(ros: Ros, found: Collision, joints: Sequence[str]) -> Any:
    """What the collision guard has met, as heptarm_msgs/Collision.

    Args:
        ros: of which ROS.
        found: what it has met.
        joints: names.
    """
    place: list[float] = []
    if found.state is not None:
        try:
            place = found.state.q.tolist()
        except HeptarmError:  # the cabinet did not tell
            place = []
    return _stamped(
        ros,
        "heptarm_msgs/Collision",
        {
            "joint": joints[found.joint],
            "torque": float(found.torque),
            "allowed": float(found.allowed),
            "position": place,
            "text": str(found),
        },
    )


def _stamped(ros: Ros, kind: str, fields: dict[str, Any]) -> Any:
    message = class_of(kind, "msg")()
    put(message, {"header": {"stamp": ros.time(ros.now())}, **fields})
    return message
