"""Control modes as messages, and back."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, cast

from heptarm.arm.translate.fields import NAMES, message_of, value_of
from heptarm.values.frames import TOOL
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.mode import MODES, HandGuiding, Mode, Position, check_mode
from heptarm.values.mode.sine import SineImpedance
from heptarm.wire import messages as wire

_BY_NAME = {kind.__name__: kind for kind in MODES}


def mode_message(mode: Mode | None) -> wire.Mode | None:
    """The message of a mode; None, position control, stays None.

    Raises:
        ShapeError: it is no mode.
    """
    check_mode(mode)
    if mode is None:
        return None
    if isinstance(mode, Position):
        return wire.PositionMode()
    return cast("wire.Mode", message_of(NAMES[type(mode).__name__], mode))


@lru_cache(maxsize=64)  # every state has one
def read_mode(message: wire.Mode) -> Mode | HandGuiding:
    """The mode of a message."""
    if isinstance(message, wire.HandGuidingMode):
        return HandGuiding()
    if isinstance(message, wire.SpiralPattern):
        return SineImpedance.spiral(
            message.plane.name.lower(),
            frequency=message.frequency,
            amplitude=message.amplitude,
            stiffness=message.stiffness,
            total_time=message.total_time,
        )
    given: dict[str, Any] = {}
    if isinstance(message, wire.CartesianImpedance):
        given["frame"] = message.frame or TOOL
    if isinstance(message, wire.SineImpedance):
        given["base"] = cast("CartesianImpedance", read_mode(message.base))
    kind = _BY_NAME.get(type(message).__name__, Position)
    return cast("Mode", value_of(kind, message, **given))
