"""Pictures of the arm without a graphics driver: matplotlib's Agg draws its shaded meshes from far to near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import require
from heptarm.values.checks import Array

#: Fraction of the light from everywhere, from the lamp, and its highlight.
_AMBIENT, _DIFFUSE, _GLOSS = 0.50, 0.55, 0.25
#: Direction to the lamp, relative to the camera: right, up, back.
_LAMP = np.array([-0.45, 0.75, 0.55])


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A camera that looks at a point.

    Attributes:
        target: point in the base that is in the middle [m].
        distance: from there to the camera [m].
        azimuth: direction from the point to the camera about the base's z axis [rad].
        elevation: of the camera above the point [rad].
        opening: vertical field of view [rad].
    """

    target: tuple[float, float, float] = (0.3, 0.0, 0.5)
    distance: float = 2.2
    azimuth: float = -1.05
    elevation: float = 0.31
    opening: float = 0.62

    @property
    def axes(self) -> Array:
        """Right, up and back of the camera in the base, rows of a rotation matrix, shape (3, 3)."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        level, rise = np.cos(self.elevation), np.sin(self.elevation)
        back = np.array([level * c, level * s, rise])
        right = np.array([-s, c, 0.0])
        return np.array([right, np.cross(back, right), back])

    def seen(self, points: Array) -> Array:
        """Points as the camera sees them: right and up in heights of the picture, and depth [m], shape (n, 3)."""
        relative = (np.asarray(points) - np.array(self.target)) @ self.axes.T
        depth = self.distance - relative[:, 2]
        scale = 0.5 / np.tan(0.5 * self.opening) / depth
        return np.column_stack([relative[:, 0] * scale, relative[:, 1] * scale, depth])


class ArmPicture:
    """Draws an arm at joint positions; needs MuJoCo for its kinematics and matplotlib.

    Args:
        robot: name of the robot, such as "iiwa14".
        viewpoint: of the camera.
        size: width and height of the pictures [pixels].
    """

    def __init__(self, robot: str, viewpoint: Viewpoint, size: tuple[int, int] = (420, 420)) -> None:
        self._mujoco: Any = require("mujoco", extra="sim")
        self._agg: Any = require("matplotlib.backends.backend_agg", extra="viz")
        from heptarm.sim.plant.appearance import DRAWN_GROUP, ArmMeshes
        from heptarm.sim.plant.world import compiled

        self._model = compiled(robot, meshes=ArmMeshes())
        self._data = self._mujoco.MjData(self._model)
        self.viewpoint, self.size = viewpoint, size
        shown = np.flatnonzero(self._model.geom_group == DRAWN_GROUP).tolist()
        self._pieces = [(geom, *self._corners(geom)) for geom in shown]

    def _corners(self, geom: int) -> tuple[Array, Array, Array]:
        """Corners and normals of the triangles of a mesh in its own frame, shape (n, 3, 3) each; its colour."""
        model, mesh = self._model, int(self._model.geom_dataid[geom])
        first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        vertices = model.mesh_vert[int(model.mesh_vertadr[mesh]) :]
        normals = model.mesh_normal[int(model.mesh_normaladr[mesh]) :]
        faces, of_normals = (
            model.mesh_face[first : first + count],
            model.mesh_facenormal[first : first + count],
        )
        colour = model.mat_rgba[int(model.geom_matid[geom])][:3]
        return vertices[faces].astype(float), normals[of_normals].astype(float), np.array(colour, float)

    def draw(self, q: Array) -> npt.NDArray[np.uint8]:
        """The arm at joint positions, shape (7,) [rad], on white: red, green, blue, shape (height, width, 3)."""
        self._data.qpos[:7] = q
        self._mujoco.mj_kinematics(self._model, self._data)
        axes = self.viewpoint.axes
        eye = np.array(self.viewpoint.target) + self.viewpoint.distance * axes[2]
        lamp = (_LAMP / np.linalg.norm(_LAMP)) @ axes
        corners, colours = [], []
        for geom, vertices, normals, colour in self._pieces:
            turn = self._data.geom_xmat[geom].reshape(3, 3).T
            at, out = vertices @ turn + self._data.geom_xpos[geom], normals @ turn
            faces = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
            visible = ((eye - at[:, 0]) * faces).sum(axis=1) > 0.0
            at, out = at[visible], out[visible]
            towards = eye - at
            half = lamp + towards / np.linalg.norm(towards, axis=-1, keepdims=True)
            half /= np.linalg.norm(half, axis=-1, keepdims=True)
            light = _AMBIENT + _DIFFUSE * np.maximum(out @ lamp, 0.0)
            gloss = _GLOSS * np.maximum((out * half).sum(axis=-1), 0.0) ** 20
            corners.append(at)
            colours.append(np.clip(light[..., None] * colour + gloss[..., None], 0.0, 1.0))
        return self._painted(np.concatenate(corners), np.concatenate(colours))

    def _painted(self, corners: Array, colours: Array) -> npt.NDArray[np.uint8]:
        """Triangles from far to near."""
        width, height = self.size
        seen = self.viewpoint.seen(corners.reshape(-1, 3)).reshape(-1, 3, 3)
        order = np.argsort(-seen[:, :, 2].mean(axis=1))
        pixels = seen[order, :, :2] * height + np.array([0.5 * width, 0.5 * height])
        opaque = np.concatenate([colours[order], np.ones((len(order), 3, 1))], axis=2)
        renderer = self._agg.RendererAgg(width, height, 72)
        transforms: Any = require("matplotlib.transforms", extra="viz")
        context = renderer.new_gc()
        renderer.draw_gouraud_triangles(context, pixels, opaque, transforms.IdentityTransform())
        drawn = np.asarray(renderer.buffer_rgba()).astype(float)
        alpha = drawn[..., 3:] / 255.0
        return (drawn[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype(np.uint8)
