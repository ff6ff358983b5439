"""Control modes, as in `from heptarm.modes import JointImpedance`."""

from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position, SineImpedance
from heptarm.values.yielding import yielding

__all__ = ["CartesianImpedance", "JointImpedance", "Mode", "Position", "SineImpedance", "yielding"]
