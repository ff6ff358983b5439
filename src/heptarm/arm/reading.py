"""From the wire's messages to values: states, results, the robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from heptarm.arm.modes import read_mode
from heptarm.errors import ConnectFailed, RemoteProtocolError
from heptarm.values import state as values
from heptarm.values.arrays import Array
from heptarm.values.io import Signal, SignalValues
from heptarm.values.pose import Pose
from heptarm.values.redundancy import Redundancy
from heptarm.values.result import Cause, Result
from heptarm.values.robot import ROBOTS, RobotModel
from heptarm.wire import messages as wire
from heptarm.wire.clock_offset import ClockOffset
from heptarm.wire.codec import DecodeError

_SAFETY = tuple(
    (bit, bit.name.lower()) for bit in wire.SafetyBits if bit.name is not None and bit.name != "NONE"
)


def read_state(
    body: bytes, offset: ClockOffset, clock: Callable[[], int], signals: Sequence[Signal] = ()
) -> values.State:
    """The state that a frame's octets say.

    Raises:
        RemoteProtocolError: they say none.
    """
    try:
        told = wire.State.decode(body)
        stamp = max(
            (
                group.stamp
                for group in (
                    told.joints,
                    told.torques,
                    told.pose,
                    told.wrench,
                    told.motion,
                    told.safety,
                    told.mode,
                    told.io,
                )
                if group is not None
            ),
            default=0,
        )
        return values.State(
            joints=None if told.joints is None else _joints(told.joints),
            torques=None if told.torques is None else _torques(told.torques),
            cartesian=None if told.pose is None else _cartesian(told.pose),
            external=None if told.wrench is None else _wrench(told.wrench),
            motion=None if told.motion is None else _motion(told.motion),
            status=None if told.safety is None else _safety(told.safety),
            control=None if told.mode is None else _control(told.mode),
            signals=None if told.io is None else _signals(told.io, signals),
            sampled=offset.to_ours(stamp),
            clock=clock,
        )
    except (DecodeError, ValueError) as error:
        raise RemoteProtocolError(f"the cabinet pushed a state that is none: {error}") from error


def read_signals(told: Sequence[wire.SignalInfo]) -> tuple[Signal, ...]:
    """The cabinet's signals."""
    return tuple(
        Signal(one.name, one.direction is wire.IoDirection.OUTPUT, one.type.name.lower(), one.low, one.high)
        for one in told
    )


def _signals(told: wire.IoState, signals: Sequence[Signal]) -> SignalValues:
    known = {one.index: one.value for one in told.values}
    named = {one.name: one.value(known[place]) for place, one in enumerate(signals) if place in known}
    return SignalValues(told.stamp, named)


def read_firing(
    told: wire.ConditionFired | wire.TriggerFired, offset: ClockOffset, clock: Callable[[], int]
) -> values.State | None:
    """The state of the robot when a condition or a trigger fired, as far as it was told."""
    if told.joints is None:
        return None
    state = values.State(
        joints=_joints(told.joints), sampled=offset.to_ours(told.joints.stamp), clock=clock
    )
    if isinstance(told, wire.TriggerFired):
        return state
    return replace(
        state, torques=_torques(told.torques), cartesian=_cartesian(told.pose), external=_wrench(told.wrench)
    )


def read_result(message: wire.MotionFinished, state: values.State | None) -> Result:
    """How a motion ended."""
    return Result(
        cause=Cause(message.cause.name.lower()),
        state=state,
        residual=message.residual,
        duration=message.duration,
        item=message.item,
        code=message.code,
        text=message.text,
    )


def read_robot(told: wire.RobotInfo) -> RobotModel:
    """The connected robot, with the limits that the cabinet names.

    Raises:
        ConnectFailed: a robot that this version does not know.
    """
    known = ROBOTS.get(told.model)
    if known is None:
        raise ConnectFailed(
            f"the cabinet drives a {told.model!r} ({told.title}); this version knows {', '.join(ROBOTS)}",
            hint="pip install --upgrade heptarm",
        )
    return replace(
        known,
        title=told.title or known.title,
        q_min=_array(told.q_min),
        q_max=_array(told.q_max),
        dq_max=_array(told.dq_max),
        tau_max=_array(told.tau_max),
    )


def _array(numbers: tuple[float, ...]) -> Array:
    result = np.array(numbers)
    result.flags.writeable = False
    return result


def _joints(told: wire.JointState) -> values.Joints:
    return values.Joints(told.stamp, _array(told.q), _array(told.q_cmd), _array(told.dq))


def _torques(told: wire.TorqueState) -> values.Torques:
    return values.Torques(told.stamp, _array(told.tau), _array(told.tau_ext), _array(told.tau_cmd))


def _cartesian(told: wire.PoseState) -> values.Cartesian:
    return values.Cartesian(
        told.stamp,
        Pose(_array(told.xyz), _array(told.quat)),
        Pose(_array(told.xyz_cmd), _array(told.quat_cmd)),
        Redundancy(told.redundancy.e1, told.redundancy.status, told.redundancy.turn),
    )


def _wrench(told: wire.WrenchState) -> values.Wrench:
    return values.Wrench(
        told.stamp,
        _array(told.force),
        _array(told.torque),
        _array(told.force_inaccuracy),
        _array(told.torque_inaccuracy),
    )


def _control(told: wire.ModeState) -> values.Control:
    return values.Control(told.stamp, read_mode(told.mode), told.tool, told.workpiece, told.frame)


def _motion(told: wire.MotionState) -> values.Motion:
    return values.Motion(
        told.stamp, told.motion, told.item, told.queued, told.progress, told.remaining, told.override
    )


def _safety(told: wire.SafetyState) -> values.Safety:
    bits = {name: bool(told.bits & bit) for bit, name in _SAFETY}
    return values.Safety(told.stamp, values.OperationMode(told.mode.name.lower()), **bits)
