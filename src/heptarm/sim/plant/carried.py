"""Shapes of tools and workpieces in MuJoCo's models: they are on the flange, collide and have no mass.

Their mass comes with the load data; see `heptarm.sim.plant.payload`. A model that only looks ahead is compiled with
them (`CarriedShapes.add_to`). That of the running plant cannot be compiled again, since its arrays are in use
everywhere: it has room for shapes, which collide with nothing until they are mounted (`FlangeShapes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from heptarm.sim.plant.scene import PREFIX
from heptarm.values.checks import Array, Value
from heptarm.values.pose import Pose
from heptarm.values.shape import MOST_SHAPES, Shape, ShapeKind

#: Put before the names of bodies of tools and of workpieces, so that they differ from those of arm and scene.
TOOL_PREFIX, WORKPIECE_PREFIX = "tool/", "workpiece/"
#: Put before the names of bodies that a program adds to the world, see `heptarm.sim.plant.obstacles`.
OBSTACLE_PREFIX = "added/"
#: Red, green, blue and opacity of what is on the flange.
COLOUR = (0.45, 0.47, 0.5, 1.0)
#: Name of the body of the running plant that has what is mounted.
_MOUNTED = "mounted"
#: Names of the shapes that a model has room for: those of a tool and of a workpiece.
_SLOTS = tuple(f"{_MOUNTED}/{index}" for index in range(2 * MOST_SHAPES))
#: Contact types of a shape that is mounted, as those of the links.
_MEETS_ALL = 1
#: MuJoCo's flag that it does not search trees of the shapes of a body for those that are near others.
NO_TREES = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
#: MuJoCo's kind of each kind of shape.
GEOMS: dict[ShapeKind, mujoco.mjtGeom] = {
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
        prefix = TOOL_PREFIX if self.is_tool else WORKPIECE_PREFIX
        body = _on_flange(arm, f"{prefix}{self.name}", self.pose)
        for shape in self.shapes:
            body.add_geom(
                type=GEOMS[shape.kind],
                size=mujoco_size(shape.kind, shape.size),
                pos=shape.pose.xyz,
                quat=np.roll(shape.pose.quat, 1),
                mass=0.0,
                rgba=COLOUR,
            )


def make_room(arm: mujoco.MjSpec) -> None:
    """Give an arm a body on its flange with shapes that collide with nothing, for `FlangeShapes`."""
    body = _on_flange(arm, _MOUNTED, Pose.of((0.0, 0.0, 0.0)))
    for name in _SLOTS:
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[1e-3, 0.0, 0.0],
            contype=0,
            conaffinity=0,
            mass=0.0,
            rgba=COLOUR,
        )


def _on_flange(arm: mujoco.MjSpec, name: str, pose: Pose) -> mujoco.MjsBody:
    """A new body on the flange; its pose in the flange frame."""
    flange = arm.site("flange")
    at = flange.parent.add_frame(pos=flange.pos, quat=flange.quat)
    body = flange.parent.add_body(name=name, pos=pose.xyz, quat=np.roll(pose.quat, 1))
    body.set_frame(at)
    return body


class FlangeShapes:
    """Mounts shapes on the flange of a running model; used by the thread that ticks the plant.

    A model without `make_room` has a tool of its scene on the flange: nothing is mounted there.

    Args:
        model: MuJoCo's model.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, _MOUNTED)
        found = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in _SLOTS]
        self._slots = [geom for geom in found if geom >= 0]
        self._disabled = int(model.opt.disableflags)

    def mount(self, bodies: Sequence[CarriedShapes]) -> None:
        """Replace what is mounted; it collides from the next tick on.

        The trees with which MuJoCo finds near shapes within a body are made when a model is compiled, without the
        shapes that are mounted later. So the search by trees is off while something is mounted.
        """
        model, disabled = self._model, self._disabled
        if not self._slots:
            return
        shapes = [(shape, body.pose @ shape.pose) for body in bodies for shape in body.shapes]
        model.geom_contype[self._slots] = model.geom_conaffinity[self._slots] = 0
        model.body_contype[self._body] = model.body_conaffinity[self._body] = _MEETS_ALL if shapes else 0
        for geom, (shape, pose) in zip(self._slots, shapes):
            half = _half_extents(shape.kind, shape.size)
            model.geom_type[geom] = GEOMS[shape.kind]
            model.geom_size[geom] = mujoco_size(shape.kind, shape.size)
            model.geom_pos[geom], model.geom_quat[geom] = pose.xyz, np.roll(pose.quat, 1)
            model.geom_sameframe[geom] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
            model.geom_aabb[geom] = (0.0, 0.0, 0.0, *half)
            model.geom_rbound[geom] = _radius(shape.kind, half)
            model.geom_contype[geom] = model.geom_conaffinity[geom] = _MEETS_ALL
        model.opt.disableflags = disabled | NO_TREES if shapes else disabled


def _half_extents(kind: ShapeKind, size: Array) -> Array:
    """Half the edges of the box around a shape, shape (3,) [m]."""
    radius, length, _ = size.tolist()
    ends = {"cylinder": 0.5 * length, "capsule": 0.5 * length + radius}
    return 0.5 * size if kind == "box" else np.array([radius, radius, ends.get(kind, radius)])


def _radius(kind: ShapeKind, half: Array) -> float:
    """Radius of the sphere around a shape [m]."""
    if kind == "box":
        return float(np.linalg.norm(half))
    return float(np.hypot(half[0], half[2])) if kind == "cylinder" else float(half[2])


def mujoco_size(kind: ShapeKind, size: Array) -> Array:
    """The size of a shape as MuJoCo has it: half edges; a radius and half a length; shape (3,) [m]."""
    radius, length, _ = size.tolist()
    return 0.5 * size if kind == "box" else np.array([radius, 0.5 * length, 0.0])


def plain(name: str) -> str:
    """The name of a body as its scene, tool or workpiece has it, or the program that added it."""
    for prefix in (PREFIX, TOOL_PREFIX, WORKPIECE_PREFIX, OBSTACLE_PREFIX):
        if name.startswith(prefix):
            return name.removeprefix(prefix)
    return name
