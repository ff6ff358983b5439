"""Draw paths around a wall for the documentation: docs/_static/upright.png and upright.webp.

    MUJOCO_GL=egl .venv/bin/python scripts/paths_pictures.py

Both paths have the same start and goal; along the right one the tool, which carries a glass, stays upright. It needs no
cabinet, but a display, or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.image
import mujoco
import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

import heptarm as ha  # noqa: E402
from heptarm import planning  # noqa: E402
from heptarm.sim.plant.appearance import ArmMeshes  # noqa: E402
from heptarm.sim.plant.world import Box, compiled  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402

PICTURE = ROOT / "docs" / "_static" / "upright.png"
FILM = ROOT / "docs" / "_static" / "upright.webp"
WALL = "0.6,0,0.3,0.5,0.02,0.6"
START, GOAL = ha.deg(-40, 50, 0, -80, 0, 50, 0), ha.deg(40, 50, 0, -80, 0, 50, 0)
SIZE = (400, 400)  # height and width of one view [pixels]
SHOWN, FRAMES, RATE, QUALITY = 6, 36, 10.0, 55  # postures in the picture; pictures of the film, per second
#: Half length and radius of the glass, and its distance from the flange [m].
GLASS = (0.05, 0.03, 0.06)


def postures(keep: ha.Upright | None, count: int) -> Array:
    """Joint positions along the path at even distances, shape (count, 7) [rad]."""
    world = ha.CollisionModel("iiwa14", boxes=[WALL])
    path = planning.find_path(world, start=START, goal=GOAL, keep=keep, timeout=600.0, improve=200)
    print(path)
    marks = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path.curve, axis=0), axis=1))])
    places = np.linspace(0.0, marks[-1], count)
    return np.array([np.interp(places, marks, column) for column in path.curve.T]).T


class View:
    """Draws an arm that holds a glass beside the wall."""

    def __init__(self) -> None:
        self._model = compiled("iiwa14", [Box.of(WALL)], meshes=ArmMeshes())
        self._data = mujoco.MjData(self._model)
        self._renderer = mujoco.Renderer(self._model, *SIZE)
        self._camera = mujoco.MjvCamera()
        self._camera.lookat, self._camera.distance = (0.35, 0.0, 0.4), 2.1
        self._camera.azimuth, self._camera.elevation = 150.0, -18.0

    def seen(self, q: Array) -> Array:
        """The arm at joint positions, shape (height, width, 3)."""
        self._data.qpos[:7] = q
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        self._add_glass()
        return np.array(self._renderer.render())

    def _add_glass(self) -> None:
        flange = self._data.site("flange")
        turn, (half, radius, far) = flange.xmat.reshape(3, 3), GLASS
        scene = self._renderer.scene
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            mujoco.mjtGeom.mjGEOM_CYLINDER,
            np.array([radius, half, 0.0]),
            flange.xpos + far * turn[:, 2],
            flange.xmat,
            np.array([0.1, 0.45, 0.9, 1.0], np.float32),
        )
        scene.ngeom += 1


def main() -> int:
    """Draw the picture and the film."""
    view = View()
    paths = [postures(keep, FRAMES) for keep in (None, ha.Upright("z", within=0.3))]
    frames = [np.concatenate([view.seen(path[index]) for path in paths], axis=1) for index in range(FRAMES)]
    chosen = np.linspace(0, FRAMES - 1, SHOWN).astype(int).tolist()
    empty = np.median(frames, axis=0)
    trail = empty.copy()
    for index in chosen:  # each posture where it differs from what is seen without it
        differs = np.abs(frames[index] - empty).max(axis=2) > 12
        trail[differs] = 0.3 * trail[differs] + 0.7 * frames[index][differs]
    matplotlib.image.imsave(PICTURE, trail.astype(np.uint8))
    pictures = [Image.fromarray(one) for one in frames]
    pictures += pictures[-2:0:-1]
    pictures[0].save(
        FILM, save_all=True, append_images=pictures[1:], duration=round(1e3 / RATE), loop=0, quality=QUALITY
    )
    for file in (PICTURE, FILM):
        print(f"wrote {file.relative_to(ROOT)}, {file.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
