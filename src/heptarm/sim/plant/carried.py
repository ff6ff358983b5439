"""Shapes of tools and workpieces in MuJoCo's models: bodies on the flange that collide and have no mass.

Their mass comes with the load data; see `heptarm.sim.plant.payload`.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from heptarm.sim.plant.scene import PREFIX
from heptarm.values.arrays import Array, Value
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape, ShapeKind

#: Put before the names of bodies of tools and of workpieces, so that they differ from those of arm and scene.
TOOL_PREFIX, WORKPIECE_PREFIX = "tool/", "workpiece/"
_COLOUR = (0.45, 0.47, 0.5, 1.0)
_GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


@dataclass(frozen=True, slots=True)
class CarriedShapes(Value):
    """Shapes of a tool or a workpiece on the flange.

    Attributes:
        name: of the tool or workpiece.
        shapes: in its frame.
        pose: of that frame in the flange frame.
        is_tool: whether it is mounted on the flange itself; otherwise something that a tool holds.
    """

    name: str
    shapes: tuple[Shape, ...]
    pose: Pose
    is_tool: bool = False

    def add_to(self, arm: mujoco.MjSpec) -> None:
        """Add it to the description of an arm, as a body on its flange."""
        flange = arm.site("flange")
        at = flange.parent.add_frame(pos=flange.pos, quat=flange.quat)
        body = flange.parent.add_body(
            name=f"{TOOL_PREFIX if self.is_tool else WORKPIECE_PREFIX}{self.name}",
            pos=self.pose.xyz,
            quat=np.roll(self.pose.quat, 1),
        )
        body.set_frame(at)
        for one in self.shapes:
            body.add_geom(
                type=_GEOMS[one.kind],
                size=mujoco_size(one.kind, one.size),
                pos=one.pose.xyz,
                quat=np.roll(one.pose.quat, 1),
                mass=0.0,
                rgba=_COLOUR,
            )


def mujoco_size(kind: ShapeKind, size: Array) -> Array:
    """The size of a shape as MuJoCo has it: half edges; a radius and half a length; shape (3,) [m]."""
    radius, length, _ = size.tolist()
    return 0.5 * size if kind == "box" else np.array([radius, 0.5 * length, 0.0])


def plain(name: str) -> str:
    """The name of a body as its scene, tool or workpiece has it."""
    for prefix in (PREFIX, TOOL_PREFIX, WORKPIECE_PREFIX):
        if name.startswith(prefix):
            return name.removeprefix(prefix)
    return name
