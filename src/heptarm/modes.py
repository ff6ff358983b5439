"""Control modes, as in `from heptarm.modes import JointImpedance`."""

from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position, SineImpedance

__all__ = ["CartesianImpedance", "JointImpedance", "Mode", "Position", "SineImpedance"]
