"""Control modes: how the arm follows its set-points; frozen values, to be reused and composed.

::

    arm.move(ptp(q), mode=JointImpedance(stiffness=300.0))

In position control it is as stiff as it can be; in an impedance mode it is compliant, like a spring with a damper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, get_args

from heptarm.values.arrays import Value
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance

__all__ = ["CartesianImpedance", "JointImpedance", "Mode", "Position", "SineImpedance"]


@dataclass(frozen=True, slots=True, eq=False)
class Position(Value):
    """Stiff position control, the default."""


Mode: TypeAlias = Position | JointImpedance | CartesianImpedance | SineImpedance
#: The same as classes, for isinstance.
MODES: tuple[type, ...] = get_args(Mode)
