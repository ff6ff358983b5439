"""Control modes, as in `from heptarm.modes import JointImpedance`."""

from heptarm.values.mode.compliance import compliance, pressing
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import HandGuiding, Mode, Position
from heptarm.values.mode.sine import SineImpedance

__all__ = [
    "CartesianImpedance",
    "HandGuiding",
    "JointImpedance",
    "Mode",
    "Position",
    "SineImpedance",
    "compliance",
    "pressing",
]
