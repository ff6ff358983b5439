"""Names of frames that every robot has, and the check of a name that a user gives."""

from __future__ import annotations

from heptarm.errors import ShapeError
from heptarm.values.checks import shown
from heptarm.values.text import printable

#: The tool frame: the attached tool's default frame (its TCP); without a tool the flange.
TOOL = "tool"
#: The frame of the flange, whatever tool is attached to it.
FLANGE = "flange"
#: The base frame of the robot.
BASE = "base"
#: Separates the name of a tool or workpiece from that of its frame, as in "gripper/tip".
SEPARATOR = "/"

_LONGEST_NAME = 128


def check_name(
    value: str, parameter: str, *, longest: int = _LONGEST_NAME, hint: str = 'for example "tool" or "base"'
) -> str:
    """Refuse what cannot be the name of a frame, a signal or another thing; returns the name.

    Args:
        value: the name.
        parameter: its name, for the error.
        longest: most bytes.
        hint: what to do otherwise.

    Raises:
        ShapeError: it is not a text of 1 to `longest` bytes, or has characters that cannot be printed.
    """
    if not isinstance(value, str) or not 1 <= len(value.encode(errors="replace")) <= longest:
        raise ShapeError(
            f"{parameter} must be a name of 1 to {longest} bytes, got {shown(value)}",
            code=3,
            parameter=parameter,
            value=value,
            hint=hint,
        )
    return check_printable(value, parameter)


def check_printable(value: str, parameter: str, *, lines: bool = False) -> str:
    """Refuse a text that could control a terminal, or that no file or message can carry; returns the text.

    Args:
        value: the text.
        parameter: its name, for the error.
        lines: it may have line breaks.

    Raises:
        ShapeError: it has control characters, NUL among them, invisible ones or half of a surrogate pair.
    """
    if value != printable(value, lines=lines):
        raise ShapeError(
            f"{parameter} must have printable characters only, got {value[:100]!a}",
            code=3,
            parameter=parameter,
            value=value,
        )
    return value
