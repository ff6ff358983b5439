"""Skills: touching, teaching, replaying and collision guarding, as functions that take an arm.

They use only the public methods of `Arm`, so each is an example of how to build one; `Arm` offers them as methods.
"""
