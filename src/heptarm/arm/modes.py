"""Control modes of the API as those of the protocol."""

from __future__ import annotations

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position, SineImpedance
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code


def mode_message(mode: Mode | None) -> wire.Mode | None:
    """The message of a mode; None stays None, position control.

    Raises:
        ShapeError: it is no mode.
        CommandRejected: this version cannot send it yet.
    """
    if mode is None:
        return None
    if isinstance(mode, Position):
        return wire.PositionMode()
    if isinstance(mode, JointImpedance):
        return wire.JointImpedance(
            stiffness=tuple(mode.stiffness.tolist()), damping=tuple(mode.damping.tolist())
        )
    if isinstance(mode, CartesianImpedance | SineImpedance):
        raise CommandRejected(
            f"{type(mode).__name__} cannot be commanded by this version",
            code=int(Code.UNSUPPORTED),
            parameter="mode",
            hint="Position and JointImpedance can",
        )
    raise ShapeError(
        f"mode is {mode!r}, which is no control mode",
        parameter="mode",
        value=mode,
        hint="make one with heptarm.modes.JointImpedance(...)",
    )
