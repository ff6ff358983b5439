"""Conditions: `from heptarm.when import force, torque, io, path`."""

from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import force, torque
from heptarm.values.condition.signals import io, path

__all__ = ["Condition", "force", "io", "path", "torque"]
