"""Conditions: `from heptarm.when import force, torque, io, path`."""

from heptarm.values.condition.condition import Condition
from heptarm.values.condition.signals import force, io, path, torque

__all__ = ["Condition", "force", "io", "path", "torque"]
