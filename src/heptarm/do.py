"""Actions of triggers: `from heptarm.do import notify, set_output`."""

from heptarm.values.condition.trigger import Action, Notify, SetOutput, Trigger
from heptarm.values.io import SignalValue

__all__ = ["Action", "Notify", "SetOutput", "Trigger", "notify", "set_output"]


def set_output(signal: str, value: SignalValue = True) -> SetOutput:
    """Write an output on the cabinet.

    Args:
        signal: its name, or a part of it, as for `arm.io`.
        value: True or False, or a number.

    Raises:
        ShapeError: no name, or another kind of value.
    """
    return SetOutput(signal, value)


def notify(label: str = "") -> Notify:
    """Send an event, which the motion's handle receives.

    Args:
        label: name of the event, up to 128 bytes.

    Raises:
        ShapeError: no text, or a longer one.
    """
    return Notify(label)
