"""Conditions as messages: nodes in postfix order, signals by their full names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from heptarm.arm.translate.fields import NAMES, message_of
from heptarm.values.condition.condition import AllOf, AnyOf, Condition, check_condition, condition_nodes
from heptarm.values.condition.reaction import Reaction, Retreat, check_reaction
from heptarm.values.frames import BASE
from heptarm.values.io import Signal, find_signal
from heptarm.values.pose import Pose
from heptarm.wire import messages as wire


def condition_message(
    condition: Condition | None, signals: Sequence[Signal]
) -> tuple[wire.Condition, tuple[Condition, ...]]:
    """The message of a condition, and the part of the condition that each of its nodes stands for.

    Args:
        condition: None: the message of no condition.
        signals: those that the cabinet has.

    Raises:
        ShapeError: it is no condition.
        CommandRejected: a signal that the cabinet does not have.
    """
    if condition is None:
        return wire.Condition(), ()
    pairs = list(condition_nodes(check_condition(condition)))
    return wire.Condition(nodes=tuple(_node(node, signals) for node, _ in pairs)), tuple(p for _, p in pairs)


def reaction_message(reaction: Reaction) -> wire.Reaction | None:
    """The message of a reaction to a break condition; None: stay.

    Raises:
        ShapeError: it is no reaction.
    """
    if isinstance(check_reaction(reaction), Retreat):
        return message_of(wire.Retreat, reaction)
    return wire.Relax() if reaction == "relax" else None


def _node(node: Condition, signals: Sequence[Signal]) -> Any:
    """The message of one node: of the same name, with the same fields, besides those given here."""
    given: dict[str, object] = {}
    if isinstance(node, AllOf | AnyOf):
        given["n"] = len(node.parts)
    if isinstance(frame := getattr(node, "frame", None), Pose):
        given |= {"frame": BASE, "axes": message_of(wire.Pose, frame)}
    if hasattr(node, "signal"):
        given["signal"] = find_signal(node.signal, signals).name
    return message_of(NAMES[type(node).__name__], node, **given)
