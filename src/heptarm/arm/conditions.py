"""Conditions of the API as those of the protocol; signals by the names that people use."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan, nan

from heptarm.values import condition as values
from heptarm.values import force_condition as forces
from heptarm.values.arguments import TOOL
from heptarm.values.condition import Condition, check_condition, condition_nodes
from heptarm.values.io import find_name
from heptarm.wire import messages as wire

_Leaf = (
    wire.ForceAbove
    | wire.NormalForceAbove
    | wire.ShearForceAbove
    | wire.ForceOutside
    | wire.TorqueOutside
    | wire.JointTorqueOutside
    | wire.SignalIs
    | wire.SignalOutside
    | wire.PathReached
)


def find_signal(name: str, signals: Sequence[wire.SignalInfo]) -> wire.SignalInfo:
    """A signal by its full name, or by any part of it behind a point; case and underscores do not matter.

    Raises:
        CommandRejected: there is none of that name, or more than one.
    """
    return signals[find_name(name, tuple(one.name for one in signals))]


def condition_message(
    condition: Condition | None, signals: Sequence[wire.SignalInfo]
) -> tuple[wire.Condition, tuple[Condition, ...]]:
    """The message of a condition, and which part of the condition each of its nodes is.

    Raises:
        ShapeError: it is no condition.
        CommandRejected: a signal that the cabinet does not have.
    """
    if condition is None:
        return wire.Condition(), ()
    pairs = list(condition_nodes(check_condition(condition)))
    nodes = tuple(_node(node, signals) for node, _ in pairs)
    return wire.Condition(nodes=nodes), tuple(part for _, part in pairs)


def _node(node: Condition, signals: Sequence[wire.SignalInfo]) -> wire.ConditionNode:
    if isinstance(node, values.AllOf):
        return wire.AllOf(n=len(node.parts))
    if isinstance(node, values.AnyOf):
        return wire.AnyOf(n=len(node.parts))
    if isinstance(node, values.Inverted):
        return wire.Inverted()
    return _leaf(node, signals)


def _leaf(node: Condition, signals: Sequence[wire.SignalInfo]) -> _Leaf:
    if isinstance(node, forces.ForceAbove):
        return wire.ForceAbove(
            frame=_frame(node.frame), threshold=float(node.threshold), tolerance=_tolerance(node.tolerance)
        )
    if isinstance(node, forces.NormalForceAbove | forces.ShearForceAbove):
        made = wire.NormalForceAbove if isinstance(node, forces.NormalForceAbove) else wire.ShearForceAbove
        return made(
            frame=_frame(node.frame),
            axis=wire.Axis[node.axis.upper()],
            threshold=float(node.threshold),
            tolerance=_tolerance(node.tolerance),
        )
    if isinstance(node, forces.ForceOutside | forces.TorqueOutside):
        outside = wire.ForceOutside if isinstance(node, forces.ForceOutside) else wire.TorqueOutside
        return outside(
            frame=_frame(node.frame),
            axis=wire.Axis[node.axis.upper()],
            low=float(node.low),
            high=float(node.high),
            tolerance=_tolerance(node.tolerance),
        )
    if isinstance(node, forces.JointTorqueOutside):
        return wire.JointTorqueOutside(joint=node.joint, low=float(node.low), high=float(node.high))
    if isinstance(node, values.SignalIs):
        return wire.SignalIs(signal=find_signal(node.signal, signals).name, value=node.value)
    if isinstance(node, values.SignalOutside):
        name = find_signal(node.signal, signals).name
        return wire.SignalOutside(signal=name, low=float(node.low), high=float(node.high))
    assert isinstance(node, values.PathReached)
    reference = wire.PathReference.START if node.from_start else wire.PathReference.DESTINATION
    return wire.PathReached(reference=reference, distance=float(node.distance), delay=float(node.delay))


def _frame(name: str) -> str:
    return "" if name == TOOL else name


def _tolerance(value: float) -> float:
    return nan if isnan(value) else float(value)
