"""Bodies that a program adds to its model of the world: free bodies, which can be placed and held."""

from __future__ import annotations

import mujoco
import numpy as np

from heptarm.sim.plant.carried import GEOMS, OBSTACLE_PREFIX, mujoco_size
from heptarm.values.checks import Array
from heptarm.values.mesh import Mesh
from heptarm.values.world import WorldBody


def add_body(spec: mujoco.MjSpec, added: WorldBody) -> None:
    """Add a body to a description of an arm and its world."""
    body = spec.worldbody.add_body(
        name=OBSTACLE_PREFIX + added.name, pos=added.pose.xyz, quat=np.roll(added.pose.quat, 1)
    )
    body.add_freejoint()
    # nothing falls or is pushed here, but MuJoCo needs a mass
    body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
    for number, shape in enumerate(added.shapes):
        if isinstance(shape, Mesh):
            _add_mesh(spec, body, shape, f"{OBSTACLE_PREFIX}{added.name}/{number}")
        else:
            body.add_geom(
                type=GEOMS[shape.kind],
                size=mujoco_size(shape.kind, shape.size),
                pos=shape.pose.xyz,
                quat=np.roll(shape.pose.quat, 1),
            )
    for place in added.points:
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[added.radius, 0.0, 0.0], pos=place)


def _add_mesh(spec: mujoco.MjSpec, body: mujoco.MjsBody, mesh: Mesh, name: str) -> None:
    for part, vertices in enumerate(mesh.parts()):
        # a mesh that has only vertices is their convex hull
        spec.add_mesh(
            name=f"{name}/{part}",
            uservert=vertices.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
        )
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"{name}/{part}",
            pos=mesh.pose.xyz,
            quat=np.roll(mesh.pose.quat, 1),
        )


def merged(points: Array, radius: float) -> tuple[Array, float]:
    """Spheres that cover those around many points.

    Args:
        points: shape (n, 3) [m].
        radius: of the sphere around each of them [m].

    Returns:
        Centres, shape (m, 3) [m], one for each occupied cell of a grid of cells as large as `radius`; their radius [m].
    """
    cells = np.floor(points / radius).astype(np.int64)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    index = index.ravel()
    counts = np.bincount(index)
    centres = np.stack([np.bincount(index, column) / counts for column in points.T], axis=1)
    farthest = float(np.linalg.norm(points - centres[index], axis=1).max())
    return centres, radius + farthest
