"""Triggers: actions of the cabinet during a motion, without stopping it, when a condition becomes true."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from heptarm.errors import ShapeError
from heptarm.values.checks import Value, finite, shown
from heptarm.values.condition.condition import Condition, check_condition
from heptarm.values.frames import check_name, check_printable
from heptarm.values.io import SignalValue

_LONGEST_LABEL = 128


@dataclass(frozen=True, slots=True, eq=False)
class SetOutput(Value):
    """The cabinet writes an output.

    Attributes:
        signal: its name, as `arm.io` lists it.
        value: True or False, or a number.
    """

    signal: str
    value: SignalValue

    def __post_init__(self) -> None:
        check_name(self.signal, "signal")
        if not isinstance(self.value, bool):
            finite(self.value, "value")

    def __str__(self) -> str:
        """In words."""
        value = ("on" if self.value else "off") if isinstance(self.value, bool) else f"{self.value:g}"
        return f"set {self.signal} to {value}"


@dataclass(frozen=True, slots=True, eq=False)
class Notify(Value):
    """The cabinet sends an event.

    Attributes:
        label: name of the event, up to 128 bytes.
    """

    label: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.label, str) or len(self.label.encode(errors="replace")) > _LONGEST_LABEL:
            raise ShapeError(
                f"label must be a text of at most {_LONGEST_LABEL} bytes, got {shown(self.label)}",
                code=3,
                parameter="label",
                value=self.label,
            )
        check_printable(self.label, "label")

    def __str__(self) -> str:
        """In words."""
        return f"notify {self.label!r}"


Action: TypeAlias = SetOutput | Notify


@dataclass(frozen=True, slots=True, eq=False)
class Trigger(Value):
    """An action, done when the condition first holds while its motion runs.

    Attributes:
        condition: see heptarm.when.
        action: see heptarm.do.

    Raises:
        ShapeError: it is no condition, or no action.
    """

    condition: Condition
    action: Action

    def __post_init__(self) -> None:
        check_condition(self.condition, "condition")
        if not isinstance(self.action, SetOutput | Notify):
            raise ShapeError(
                f"action must be an action of heptarm.do, got {shown(self.action)}",
                parameter="action",
                value=self.action,
                hint="make one with heptarm.do, for example notify('half way') or set_output('LEDBlue', True)",
            )

    def __str__(self) -> str:
        """In words."""
        return f"{self.action} when {self.condition}"
