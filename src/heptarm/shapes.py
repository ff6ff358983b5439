"""Shapes of tools and workpieces, as in `from heptarm import shapes; shapes.box(0.1, 0.1, 0.2)`."""

from heptarm.values.shape import Shape, box, capsule, cylinder, sphere

__all__ = ["Shape", "box", "capsule", "cylinder", "sphere"]
