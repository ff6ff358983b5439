"""Triggers and their actions as messages, checked as the cabinet checks them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from heptarm.arm.translate.conditions import condition_message
from heptarm.errors import CommandRejected, LimitError, inside
from heptarm.values.checks import scalar, shown, within
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.signals import PathReached, SignalOutside
from heptarm.values.condition.trigger import Action, SetOutput
from heptarm.values.io import Signal, SignalValue, find_signal
from heptarm.values.motion.motion import Hold, Motion, triggers_of
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code


def trigger_messages(motion: Motion, signals: Sequence[Signal]) -> tuple[wire.Trigger, ...]:
    """The messages of a motion's triggers.

    Args:
        motion: has them.
        signals: those that the cabinet has.

    Raises:
        CommandRejected: an unknown signal, an input, a point on the path of a hold, or a number signal in a condition.
        LimitError: a value that the output cannot have.
    """
    made = []
    for place, trigger in enumerate(triggers_of(motion)):
        with inside(f"triggers[{place}]"):
            condition, parts = condition_message(trigger.condition, signals)
            _check(motion, parts)
            made.append(wire.Trigger(condition=condition, action=_action(trigger.action, signals)))
    return tuple(made)


def _check(motion: Motion, parts: Sequence[Condition]) -> None:
    if isinstance(motion, Hold) and any(isinstance(part, PathReached) for part in parts):
        raise CommandRejected(
            "a hold has no path that a trigger could refer to",
            code=Code.BAD_CONDITION,
            parameter="condition",
            hint="use another condition, or give the trigger to a motion along a path",
        )
    if any(isinstance(part, SignalOutside) for part in parts):
        raise CommandRejected(
            "triggers cannot compare number signals",
            code=Code.UNSUPPORTED,
            parameter="condition",
            hint="watch the signal with arm.wait_until, or use it as `until`",
        )


def _action(action: Action, signals: Sequence[Signal]) -> wire.Action:
    if isinstance(action, SetOutput):
        return output_message(action.signal, action.value, signals)
    return wire.Notify(label=action.label)


def output_message(name: str, value: SignalValue, signals: Sequence[Signal]) -> wire.SetSignal:
    """The request to write an output.

    Raises:
        CommandRejected: no such output.
        LimitError: a value that it cannot have.
    """
    signal = find_signal(name, signals)
    if not signal.is_output:
        raise CommandRejected(
            f"{signal.name} is an input of the cabinet and cannot be written",
            code=Code.UNSUPPORTED,
            parameter="signal",
            value=name,
            hint="arm.io.signals lists the outputs",
        )
    number = float(value) if isinstance(value, bool) else scalar(value, signal.name)
    if not isfinite(number):
        within(number, signal.name, signal.low, signal.high)
    if isinstance(value, bool) != (signal.kind == "boolean") and number not in (0.0, 1.0):
        allowed = "True or False" if signal.kind == "boolean" else f"in [{signal.low:g}, {signal.high:g}]"
        raise LimitError(
            f"{signal.name} is {signal.kind} and must be {allowed}, got {shown(value)}",
            code=2,
            parameter=signal.name,
            value=value,
            allowed=allowed.removeprefix("in "),
        )
    within(number, signal.name, signal.low, signal.high)
    return wire.SetSignal(signal=signal.name, value=number)
