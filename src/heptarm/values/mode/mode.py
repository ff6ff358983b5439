"""Control modes: how the arm holds on to its set-points; frozen values, to be reused and composed.

::

    arm.move(ptp(q), mode=JointImpedance(stiffness=300.0))

In position control it does so as stiffly as it can; in an impedance mode like a spring with a damper, so that it
yields to whoever pushes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from heptarm.values.arrays import Value
from heptarm.values.impedance import CartesianImpedance, JointImpedance
from heptarm.values.sine import SineImpedance

__all__ = ["CartesianImpedance", "JointImpedance", "Mode", "Position", "SineImpedance"]


@dataclass(frozen=True, slots=True, eq=False)
class Position(Value):
    """Stiff position control, the default."""


Mode: TypeAlias = Position | JointImpedance | CartesianImpedance | SineImpedance
