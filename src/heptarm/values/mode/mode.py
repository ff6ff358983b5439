"""Control modes: how the arm follows its set-points; frozen values, to be reused and composed.

::

    arm.move(ptp(q), mode=JointImpedance(stiffness=300.0))

In position control it is as stiff as it can be; in an impedance mode it is compliant, like a spring with a damper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, get_args

from heptarm.errors import ShapeError
from heptarm.values.checks import Value, shown
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance

__all__ = ["CartesianImpedance", "HandGuiding", "JointImpedance", "Mode", "Position", "SineImpedance"]


@dataclass(frozen=True, slots=True, eq=False)
class Position(Value):
    """Stiff position control, the default."""

    def __str__(self) -> str:
        """One line."""
        return "position control"


@dataclass(frozen=True, slots=True, eq=False)
class HandGuiding(Value):
    """Guided by hand: what `state.mode` is while a `hand_guide` motion runs; no motion can be given it."""

    def __str__(self) -> str:
        """One line."""
        return "hand guiding"


Mode: TypeAlias = Position | JointImpedance | CartesianImpedance | SineImpedance
#: The same as classes, for isinstance.
MODES: tuple[type, ...] = get_args(Mode)


def check_mode(mode: Mode | None) -> None:
    """Refuse what is neither a control mode nor None.

    Raises:
        ShapeError: it is something else.
    """
    if mode is not None and not isinstance(mode, MODES):
        raise ShapeError(
            f"mode must be a control mode, got {shown(mode)}",
            parameter="mode",
            value=mode,
            hint="make one with heptarm.modes, for example JointImpedance(300.0)",
        )
