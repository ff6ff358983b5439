"""From messages to values: states, results, signals, the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from itertools import accumulate, pairwise
from math import isnan
from operator import attrgetter
from struct import Struct
from typing import Any

import numpy as np

from heptarm.arm.translate.fields import value_of
from heptarm.arm.translate.modes import read_mode
from heptarm.errors import ConnectFailed, RemoteProtocolError
from heptarm.values import state as values
from heptarm.values.checks import Array
from heptarm.values.io import Signal, SignalValues
from heptarm.values.pose import NOT_GIVEN, Pose, Redundancy
from heptarm.values.result import Cause, Result
from heptarm.values.robot import ROBOTS, Flange, RobotModel
from heptarm.wire import messages as wire
from heptarm.wire.clock_sync import ClockOffset
from heptarm.wire.state_groups import StateGroups

#: The bits of the safety state in the order of the fields of `values.Safety` behind its stamp and mode.
_SAFETY = tuple(int(wire.SafetyBits[field.name.upper()]) for field in fields(values.Safety)[2:])
_MODES = {mode: values.OperationMode(mode.name.lower()) for mode in wire.OperationMode}


class _Received:
    """A received state: each group is decoded and made when it is asked for.

    Args:
        groups: its bytes.
        signals: of the cabinet, in the order of their indices.
    """

    __slots__ = ("_groups", "_signals")

    def __init__(self, groups: StateGroups, signals: Sequence[Signal]) -> None:
        self._groups, self._signals = groups, signals

    @property
    def stamp(self) -> int:
        """Cabinet time of the newest group [ns]; 0 without any."""
        return self._groups.stamp

    def make(self, name: str) -> Any:
        """The group of a name; None: the state has none.

        Raises:
            RemoteProtocolError: the cabinet sent bytes or numbers that no such group can have.
        """
        groups = self._groups
        vectors = _VECTORS.get(name)
        if vectors is not None:
            place = groups.place(name)
            return None if place is None else vectors.read(groups.body, place)
        try:
            message = groups.get(name)
            if message is None:
                return None
            return _signals(message, self._signals) if name == "io" else _READERS[name](message)
        except ValueError as error:
            raise _undecodable(error) from error


class _Fired:
    """The state in an event: each group is made when it is asked for, so that a group that cannot be read ends no link.

    Args:
        message: the event.
    """

    __slots__ = ("_message", "stamp")

    def __init__(self, message: wire.ConditionFired | wire.TriggerFired) -> None:
        groups = (getattr(message, name, None) for name in values.GROUP_NAMES)
        self._message = message
        self.stamp: int = max((group.stamp for group in groups if group is not None), default=0)

    def make(self, name: str) -> Any:
        """The group of a name; None: the event has none. Raises as `_Received.make` does."""
        group = getattr(self._message, name, None)
        try:
            return None if group is None else _READERS[name](group)
        except ValueError as error:
            raise _undecodable(error) from error


def _undecodable(error: Exception) -> RemoteProtocolError:
    return RemoteProtocolError(f"the cabinet sent a state that cannot be decoded: {error}")


def read_state(
    body: bytes,
    offset: ClockOffset,
    clock: Callable[[], int],
    *,
    received: int,
    signals: Sequence[Signal] = (),
) -> values.State:
    """The state in the body of a frame.

    Args:
        body: the bytes.
        offset: estimate of the cabinet's clock; after slow pings it may be off by half of their round trip.
        clock: ours [ns].
        received: our clock when it arrived [ns]; it was not sampled later than that.
        signals: the cabinet's.

    Raises:
        RemoteProtocolError: the bytes are no state.
    """
    try:
        groups = StateGroups(body)
    except ValueError as error:
        raise _undecodable(error) from error
    source = _Received(groups, signals)
    return values.State(values.Groups.of(source), min(offset.to_ours(groups.stamp), received), clock)


def read_signals(infos: Sequence[wire.SignalInfo]) -> tuple[Signal, ...]:
    """The cabinet's signals."""
    return tuple(
        Signal(
            info.name, info.direction is wire.IoDirection.OUTPUT, info.type.name.lower(), info.low, info.high
        )
        for info in infos
    )


def _signals(message: wire.IoState, signals: Sequence[Signal]) -> SignalValues:
    known = {value.index: value.value for value in message.values}
    named = {
        signal.name: signal.value(known[place]) for place, signal in enumerate(signals) if place in known
    }
    return SignalValues(message.stamp, named)


def read_firing(
    message: wire.ConditionFired | wire.TriggerFired, offset: ClockOffset, clock: Callable[[], int]
) -> values.State | None:
    """The state of the robot when a condition or a trigger fired, as far as the cabinet reported it."""
    if message.joints is None:
        return None
    source = _Fired(message)
    return values.State(values.Groups.of(source), offset.to_ours(source.stamp), clock)


def read_result(message: wire.MotionFinished, state: values.State | None) -> Result:
    """How a motion ended; what stopped it comes from an earlier message."""
    return value_of(
        Result, message, cause=Cause(message.cause.name.lower()), state=state, stopped_by=None, fired_at=None
    )


def read_robot(message: wire.RobotInfo, flange: Flange) -> RobotModel:
    """The connected robot with its flange, which no cabinet reports, and with the limits that the cabinet reports.

    Raises:
        ConnectFailed: a robot that this version does not know.
    """
    known = ROBOTS.get(message.model)
    if known is None:
        raise ConnectFailed(
            f"robot must be one of {', '.join(ROBOTS)}, got {message.model!r} ({message.title}) from the cabinet",
            parameter="robot.model",
            value=message.model,
            allowed=", ".join(ROBOTS),
            hint="pip install --upgrade heptarm",
        )
    return replace(
        known.with_flange(flange),
        title=message.title or known.title,
        q_min=_array(message.q_min),
        q_max=_array(message.q_max),
        dq_max=_array(message.dq_max),
        tau_max=_array(message.tau_max),
    )


def _array(numbers: tuple[float, ...]) -> Array:
    result = np.array(numbers)
    result.flags.writeable = False
    return result


def _cartesian(message: wire.PoseState) -> values.Cartesian:
    return values.Cartesian(
        message.stamp,
        Pose.of(message.xyz, message.quat),
        None if isnan(message.xyz_cmd[0]) else Pose.of(message.xyz_cmd, message.quat_cmd),
        _redundancy(message.redundancy),
    )


def _redundancy(message: wire.Redundancy) -> Redundancy:
    """The redundancy of a state; a cabinet reports NaN where it knows no E1."""
    return Redundancy(NOT_GIVEN if isnan(message.e1) else message.e1, message.status, message.turn)


class _Vectors:
    """A group of which all fields behind the stamp are vectors, in the order of the value's: read as one array.

    Args:
        kind: class of the value.
        fields: of the message; see `STATE_LAYOUT`.
    """

    __slots__ = ("_count", "_kind", "_rows")

    def __init__(self, kind: Callable[..., Any], fields: Sequence[tuple[str, str, int]]) -> None:
        ends = list(accumulate(size for _, _, size in fields[1:]))
        self._kind, self._count = kind, ends[-1]
        self._rows = [slice(begin, end) for begin, end in pairwise((0, *ends))]

    def read(self, body: bytes, place: int) -> Any:
        """The value at a place in a state's body."""
        (stamp,) = _STAMP.unpack_from(body, place)
        numbers = np.frombuffer(body, ">f8", self._count, place + _STAMP.size).astype(np.float64)
        return self._kind(stamp, *[numbers[row] for row in self._rows])


_STAMP = Struct(">q")
_VECTORS = {
    name: _Vectors(kind, fields)
    for kind, name in ((values.Joints, "joints"), (values.Torques, "torques"), (values.Wrench, "wrench"))
    for group, _, fields in wire.STATE_LAYOUT
    if group == name
}


def _motion(message: wire.MotionState) -> values.MotionStatus:
    return values.MotionStatus(*_MOTION(message))


_MOTION = attrgetter("stamp", "motion", "item", "queued", "progress", "remaining", "override")


def _safety(message: wire.SafetyState) -> values.Safety:
    return values.Safety(message.stamp, _MODES[message.mode], *_safety_bits(int(message.bits)))


@lru_cache(maxsize=256)
def _safety_bits(bits: int) -> tuple[Any, ...]:
    is_known = not bits & wire.SafetyBits.UNKNOWN
    return tuple(bool(bits & bit) if is_known or bit == wire.SafetyBits.MOVING else None for bit in _SAFETY)


#: The groups of a state, each with the function that makes a value of its message.
_READERS: Mapping[str, Callable[[Any], Any]] = {
    "joints": lambda message: value_of(values.Joints, message),
    "torques": lambda message: value_of(values.Torques, message),
    "pose": _cartesian,
    "wrench": lambda message: value_of(values.Wrench, message),
    "motion": _motion,
    "safety": _safety,
    "mode": lambda message: value_of(values.Control, message, mode=read_mode(message.mode)),
}
