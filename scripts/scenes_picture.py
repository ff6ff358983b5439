"""Draw the pictures of the ready scenes for the documentation with MuJoCo: docs/_static/scenes.png and two-arms.png.

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
from heptarm.sim.plant.other_arm import OtherArm  # noqa: E402
from heptarm.sim.plant.plant import Plant  # noqa: E402
from heptarm.sim.plant.scene import Scene  # noqa: E402
from heptarm.sim.plant.world import compiled  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402
from heptarm.values.pose import deg  # noqa: E402

PICTURE = ROOT / "docs" / "_static" / "scenes.png"
TWO_ARMS = ROOT / "docs" / "_static" / "two-arms.png"
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
    return seen(model, data, (0.42, 0.0, 0.32), 1.55)


def seen(
    model: mujoco.MjModel, data: mujoco.MjData, middle: tuple[float, float, float], distance: float
) -> Array:
    """A model from a distance [m] of a point in the base [m], shape (height, width, 3)."""
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = middle, distance, 140.0, -24.0
    with mujoco.Renderer(model, *SIZE) as renderer:
        renderer.update_scene(data, camera)
        return np.array(renderer.render())


def both() -> Array:
    """The world of two arms, as a program has it that adds the right one, shape (height, width, 3)."""
    scene = Scene.of("two-arms")
    place = scene.place_of("right")
    assert place is not None
    model = compiled("iiwa14", scene=scene, meshes=ArmMeshes(), arms=[OtherArm("right", "iiwa14", place)])
    data = mujoco.MjData(model)
    data.qpos[:7] = deg(15, 30, 0, -90, 0, 60, 0)
    first = int(model.joint("right/A1").qposadr[0])
    data.qpos[first : first + 7] = deg(25, 15, 0, -100, 0, 65, 0)
    mujoco.mj_forward(model, data)
    return seen(model, data, (0.6, 0.0, 0.4), 2.6)


def main() -> int:
    """Draw the scenes side by side, and two arms in one."""
    for file, picture in (
        (PICTURE, np.concatenate([drawn(name) for name in NAMES], axis=1)),
        (TWO_ARMS, both()),
    ):
        matplotlib.image.imsave(file, picture)
        print(f"wrote {file.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
