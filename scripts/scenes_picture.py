"""Draw the picture of the ready scenes for the documentation with MuJoCo: docs/_static/scenes.png.

    MUJOCO_GL=egl .venv/bin/python scripts/scenes_picture.py

It needs a display, or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.image
import mujoco
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

from heptarm.sim.plant.appearance import ArmMeshes  # noqa: E402
from heptarm.sim.plant.plant import Plant  # noqa: E402
from heptarm.sim.plant.scene import Scene  # noqa: E402
from heptarm.sim.plant.world import compiled  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402
from heptarm.values.pose import deg  # noqa: E402

PICTURE = ROOT / "docs" / "_static" / "scenes.png"
NAMES = ("table", "peg-in-hole", "bins")
SIZE = (420, 480)  # height and width [pixels]
POSTURE = tuple(deg(0, 30, 0, -80, 0, 70, 0).tolist())


def drawn(name: str) -> Array:
    """A scene seen from its right side, shape (height, width, 3)."""
    plant = Plant(q=POSTURE, scene=Scene.of(name))
    plant.step(200)
    model = compiled("iiwa14", scene=Scene.of(name), meshes=ArmMeshes())
    data = mujoco.MjData(model)
    data.qpos[:] = plant.data.qpos
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = (0.42, 0.0, 0.32), 1.55, 140.0, -24.0
    with mujoco.Renderer(model, *SIZE) as renderer:
        renderer.update_scene(data, camera)
        return np.array(renderer.render())


def main() -> int:
    """Draw all scenes side by side."""
    matplotlib.image.imsave(PICTURE, np.concatenate([drawn(name) for name in NAMES], axis=1))
    print(f"wrote {PICTURE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
