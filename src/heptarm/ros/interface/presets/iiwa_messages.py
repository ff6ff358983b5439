"""States as messages of iiwa_msgs, the package of iiwa_stack."""

from __future__ import annotations

from typing import Any

import numpy as np

from heptarm.ros.interface.messages import RosAdapter, pose_message
from heptarm.values.checks import Array
from heptarm.values.state import State


def iiwa_state(
    ros: RosAdapter, message: Any, state: State, stamp: Any, base: str, *, external: bool
) -> Any | None:
    """Fill a message of iiwa_msgs by the fields that it has; None: the state lacks what it needs.

    Args:
        ros: types and time of the ROS.
        message: CartesianPose, CartesianWrench, or one of the joints.
        state: the state.
        stamp: time of the measurement.
        base: name of the base frame.
        external: of torques, the external ones.
    """
    if hasattr(message, "poseStamped"):
        if state.groups.pose is None:
            return None
        message.poseStamped.header.stamp, message.poseStamped.header.frame_id = stamp, base
        message.poseStamped.pose = pose_message(ros, state.pose)
        redundancy = state.redundancy
        message.redundancy.e1 = redundancy.e1
        message.redundancy.status, message.redundancy.turn = redundancy.status, redundancy.turn
        return message
    message.header.stamp = stamp
    if hasattr(message, "wrench"):
        return _wrench(message, state)
    if hasattr(message, "torque") and state.torques is None:
        return None
    for name in ("position", "velocity", "torque"):
        if hasattr(message, name):
            _put(getattr(message, name), _joints(name, state, external))
    return message


def _joints(name: str, state: State, external: bool) -> Array:
    if name == "torque":
        return state.tau_ext if external else state.tau
    return state.q if name == "position" else np.nan_to_num(state.dq)


def _put(quantity: Any, values: Array) -> None:
    for number, value in enumerate(values.tolist(), start=1):
        setattr(quantity, f"a{number}", value)


def _wrench(message: Any, state: State) -> Any | None:
    """In the axes of the motion frame, as iiwa_stack has it; the frame of the header is that of the tool there."""
    if state.groups.wrench is None or state.groups.pose is None:
        return None
    wrench = state.wrench.seen(np.zeros(3), state.pose.rotation)
    message.header.frame_id = "tool"
    for target, vector in (
        (message.wrench.force, wrench.force),
        (message.wrench.torque, wrench.torque),
        (message.inaccuracy.force, wrench.force_inaccuracy),
        (message.inaccuracy.torque, wrench.torque_inaccuracy),
    ):
        target.x, target.y, target.z = vector.tolist()
    return message
