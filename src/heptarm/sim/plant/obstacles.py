"""Bodies that a program adds to its model of the world: free bodies, which can be placed and held."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from heptarm.sim.plant.carried import GEOMS, OBSTACLE_PREFIX, mujoco_size
from heptarm.values.checks import Array, Value
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape

_COLOUR = (0.7, 0.6, 0.45, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle(Value):
    """A body of a world.

    Attributes:
        name: of the body.
        shapes: in its frame.
        pose: where it is put first, in the base.
        points: centres of spheres in its frame, shape (n, 3) [m].
        radius: of these spheres [m].
    """

    name: str
    shapes: tuple[Shape | Mesh, ...]
    pose: Pose
    points: Array
    radius: float = 0.0

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add it to a description of an arm and its world."""
        body = spec.worldbody.add_body(
            name=OBSTACLE_PREFIX + self.name, pos=self.pose.xyz, quat=np.roll(self.pose.quat, 1)
        )
        body.add_freejoint()
        # nothing falls or is pushed here, but MuJoCo needs a mass
        body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
        for number, shape in enumerate(self.shapes):
            if isinstance(shape, Mesh):
                self._add_mesh(spec, body, shape, number)
            else:
                body.add_geom(
                    type=GEOMS[shape.kind],
                    size=mujoco_size(shape.kind, shape.size),
                    pos=shape.pose.xyz,
                    quat=np.roll(shape.pose.quat, 1),
                    rgba=_COLOUR,
                )
        for place in self.points:
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[self.radius, 0.0, 0.0], pos=place, rgba=_COLOUR
            )

    def _add_mesh(self, spec: mujoco.MjSpec, body: mujoco.MjsBody, mesh: Mesh, number: int) -> None:
        for part, vertices in enumerate(mesh.parts()):
            name = f"{OBSTACLE_PREFIX}{self.name}/{number}/{part}"
            # a mesh that has only vertices is their convex hull
            spec.add_mesh(
                name=name, uservert=vertices.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            )
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                pos=mesh.pose.xyz,
                quat=np.roll(mesh.pose.quat, 1),
                rgba=_COLOUR,
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
