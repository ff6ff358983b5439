"""Shapes of tools, workpieces and bodies of a world, as in `from heptarm import shapes; shapes.box(0.1, 0.1, 0.2)`."""

from heptarm.values.mesh import Mesh, height_map, mesh
from heptarm.values.shape import Shape, box, capsule, cylinder, sphere

__all__ = ["Mesh", "Shape", "box", "capsule", "cylinder", "height_map", "mesh", "sphere"]
