"""Triggers of the API as those of the protocol, checked as the cabinet checks them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from heptarm.arm.conditions import condition_message
from heptarm.arm.io import output
from heptarm.arm.tooling import Tooling
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.condition import Condition, PathReached, SignalOutside
from heptarm.values.io import Signal
from heptarm.values.motion import Hold, Motion
from heptarm.values.trigger import SetOutput, Trigger, triggers_of
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code


def with_triggers(
    items: Sequence[wire.Item],
    motions: Sequence[Motion],
    signals: Sequence[Signal],
    told: Sequence[wire.SignalInfo],
    tooling: Tooling,
) -> tuple[wire.Item, ...]:
    """The items of motions with their triggers.

    Args:
        items: without them.
        motions: what they are of.
        signals: what the cabinet has.
        told: the same as it was told.
        tooling: knows the frames.

    Raises:
        CommandRejected: a signal that there is not, an input, a frame that is not known, a point on the path of a
            hold, or a number signal in a condition.
        LimitError: a value that the output cannot have.
    """
    result = []
    for index, (item, motion) in enumerate(zip(items, motions, strict=True)):
        made = []
        for place, one in enumerate(triggers_of(motion)):
            try:
                condition, parts = condition_message(one.condition, told)
                _check(motion, parts)
                tooling.check_until(parts)
                made.append(wire.Trigger(condition=condition, action=_action(one, signals)))
            except HeptarmError as error:
                error.parameter = f"motions[{index}].triggers[{place}].{error.parameter}"
                raise
        result.append(replace(item, triggers=tuple(made)))
    return tuple(result)


def _check(motion: Motion, parts: Sequence[Condition]) -> None:
    if isinstance(motion, Hold) and any(isinstance(part, PathReached) for part in parts):
        raise CommandRejected("a hold has no path", code=Code.BAD_CONDITION, parameter="condition")
    if any(isinstance(part, SignalOutside) for part in parts):
        raise CommandRejected(
            "the robot does not watch number signals for triggers",
            code=Code.UNSUPPORTED,
            parameter="condition",
            hint="look at the signal with arm.wait_until, or use it as `until`",
        )


def _action(one: Trigger, signals: Sequence[Signal]) -> wire.Action:
    action = one.action
    if isinstance(action, SetOutput):
        return output(action.signal, action.value, signals)
    return wire.Notify(label=action.label)
