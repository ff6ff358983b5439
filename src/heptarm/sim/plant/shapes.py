"""The shapes of a MuJoCo model as triangles and colours, for viewers that have no MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.errors import require
from heptarm.sim.plant.appearance import HIDDEN_GROUP
from heptarm.values.checks import Array, Value

_COLOURS = {"silver": (192, 194, 199), "orange": (255, 107, 10), "dark": (64, 64, 69)}


@dataclass(frozen=True, slots=True, eq=False)
class DrawnShape(Value):
    """A shape that is drawn.

    Attributes:
        index: of MuJoCo's geom.
        body: index of the body that it is part of.
        vertices: in the frame of the geom, shape (n, 3) [m].
        faces: triangles, indices of vertices, shape (m, 3).
        colour: red, green, blue, 0 to 255.
    """

    index: int
    body: int
    vertices: Array
    faces: npt.NDArray[np.int64]
    colour: tuple[int, int, int]


def drawn_shapes(model: mujoco.MjModel) -> list[DrawnShape]:
    """All shapes of a model that are drawn and have an end: no planes, no height fields, none that are hidden.

    Raises:
        MissingExtra: the model has other shapes than meshes, and the package trimesh is not installed.
    """
    return [_shape(model, index) for index in range(model.ngeom) if _is_drawn(model, index)]


def _is_drawn(model: mujoco.MjModel, index: int) -> bool:
    kind = int(model.geom_type[index])
    endless = kind in (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    return not endless and int(model.geom_group[index]) < HIDDEN_GROUP


def _shape(model: mujoco.MjModel, index: int) -> DrawnShape:
    vertices, faces = _mesh(model, index)
    material = model.geom_matid[index]
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_MATERIAL, material) if material >= 0 else ""
    red, green, blue = (round(255 * float(part)) for part in model.geom_rgba[index, :3])
    colour = _COLOURS.get(name, (red, green, blue))
    return DrawnShape(index, int(model.geom_bodyid[index]), vertices, faces, colour)


def _mesh(model: mujoco.MjModel, index: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """Vertices and faces of a shape in its own frame."""
    kind = int(model.geom_type[index])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[index])
        first, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
        vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
        faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
        return np.array(vertices, float), np.array(faces, np.int64)
    return solid(kind, model.geom_size[index])


def solid(kind: int, size: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """Vertices and faces of a shape that is no mesh, in its own frame.

    Args:
        kind: MuJoCo's.
        size: likewise, shape (3,) [m].

    Raises:
        MissingExtra: the package trimesh is not installed.
    """
    radius, half, depth = size.tolist()
    creation = require("trimesh.creation", extra="viz")
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        mesh = creation.capsule(height=2 * half, radius=radius, count=(24, 24))
        mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = creation.cylinder(radius=radius, height=2 * half, sections=32)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = creation.box(extents=(2 * radius, 2 * half, 2 * depth))
    else:  # a sphere has one radius, an ellipsoid three
        mesh = creation.icosphere(subdivisions=3, radius=1.0)
        mesh.apply_scale((radius, half or radius, depth or radius))
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
