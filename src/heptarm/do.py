"""What triggers of motions do: `from heptarm.do import notify, set_output`."""

from heptarm.values.io import SignalValue
from heptarm.values.trigger import Action, Notify, SetOutput, Trigger

__all__ = ["Action", "Notify", "SetOutput", "Trigger", "notify", "set_output"]


def set_output(signal: str, value: SignalValue = True) -> SetOutput:
    """The cabinet writes an output.

    Args:
        signal: its name, or a part of it, as for `arm.io`.
        value: True or False, or a number.

    Raises:
        ShapeError: no name, or neither of these.
    """
    return SetOutput(signal, value)


def notify(label: str = "") -> Notify:
    """The cabinet tells of it; the motion's handle hears of the event.

    Args:
        label: what it is called, up to 128 octets.

    Raises:
        ShapeError: a label that is longer, or no text.
    """
    return Notify(label)
