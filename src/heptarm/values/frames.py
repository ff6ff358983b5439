"""Names of frames that every robot has, and the check of a name that a user gives."""

from __future__ import annotations

from heptarm.errors import ShapeError
from heptarm.values.checks import shown

#: The tool frame: the attached tool's default frame (its TCP); without a tool the flange.
TOOL = "tool"
#: The frame of the flange, whatever tool is attached to it.
FLANGE = "flange"
#: The base frame of the robot.
BASE = "base"
#: Separates the name of a tool or workpiece from that of its frame, as in "gripper/tip".
SEPARATOR = "/"

_LONGEST_NAME = 128


def check_name(value: str, parameter: str) -> str:
    """Refuse what cannot be the name of a frame or signal; returns the name.

    Raises:
        ShapeError: it is not a text of 1 to 128 bytes.
    """
    if not isinstance(value, str) or not 1 <= len(value.encode()) <= _LONGEST_NAME:
        raise ShapeError(
            f"{parameter} must be a name of 1 to {_LONGEST_NAME} bytes, got {shown(value)}",
            code=3,
            parameter=parameter,
            value=value,
            hint='for example "tool" or "base"',
        )
    return value
