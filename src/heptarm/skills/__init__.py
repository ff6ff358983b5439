"""Skills: touching, inserting, grasping, teaching, replaying and collision guarding, as functions that take an arm.

They use only the public methods of `Arm`, so each is an example of how to build one; `Arm` offers some as methods.
"""

from heptarm.skills.gripper import Gripper, TwoSignalGripper
from heptarm.skills.insertion import Insertion, insert

__all__ = ["Gripper", "Insertion", "TwoSignalGripper", "insert"]
