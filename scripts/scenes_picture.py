"""Draw pictures of the ready scenes with MuJoCo: scenes.png, two-arms.png, camera.png and social.png in docs/_static.

    MUJOCO_GL=egl .venv/bin/python scripts/scenes_picture.py

It needs a display, or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.image
import mujoco
import numpy as np
from matplotlib.figure import Figure

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
CAMERA = ROOT / "docs" / "_static" / "camera.png"
#: What a link to the site shows: size in inches at 100 dots per inch.
SOCIAL, SOCIAL_SIZE = ROOT / "docs" / "_static" / "social.png", (12.0, 6.3)
#: Depth at which the picture of depths is black [m].
FAR = 1.2
NAMES = ("table", "peg-in-hole", "bins")
SIZE = (420, 480)  # height and width [pixels]
POSTURE = tuple(deg(0, 30, 0, -80, 0, 70, 0).tolist())


def drawn(name: str) -> Array:
    """A scene seen from its right side, shape (height, width, 3)."""
    return seen(*settled(name), (0.42, 0.0, 0.32), 1.55)


def settled(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A scene at rest."""
    plant = Plant(q=POSTURE, scene=Scene.of(name))
    plant.step(200)
    model = compiled("iiwa14", scene=Scene.of(name), meshes=ArmMeshes())
    data = mujoco.MjData(model)
    data.qpos[:] = plant.data.qpos
    mujoco.mj_forward(model, data)
    return model, data


def three_kinds() -> Array:
    """What a camera gives: colour, depth and bodies by their labels, shape (height, width, 3)."""
    model, data = settled("bins")
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = (0.55, 0.0, 0.2), 0.8, 160.0, -50.0
    with mujoco.Renderer(model, *SIZE) as renderer:
        renderer.update_scene(data, camera)
        colour = np.array(renderer.render())
        renderer.enable_depth_rendering()
        depth = np.clip(1.0 - renderer.render() / FAR, 0.0, 1.0)
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        bodies = np.array(renderer.render())[..., 0]
    palette = np.random.default_rng(4).integers(60, 255, (bodies.max() + 2, 3)).astype(np.uint8)
    grey = np.repeat((255 * depth).astype(np.uint8)[..., None], 3, axis=2)
    return np.concatenate([colour, grey, palette[bodies + 1]], axis=1)


def social() -> Figure:
    """What a link to the site shows."""
    figure = Figure(SOCIAL_SIZE, dpi=100, facecolor="#14202c")
    figure.text(0.06, 0.80, "heptarm", color="white", fontsize=64, weight="bold")
    figure.text(
        0.06, 0.70, "a KUKA LBR iiwa from Python, with or without a robot", color="#c9d6e4", fontsize=26
    )
    axes = figure.add_axes((0.06, 0.06, 0.88, 0.56))
    axes.imshow(matplotlib.image.imread(PICTURE))
    axes.axis("off")
    return figure


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
    """Draw the scenes side by side, two arms in one, what a camera sees, and what a link shows."""
    for file, picture in (
        (PICTURE, np.concatenate([drawn(name) for name in NAMES], axis=1)),
        (TWO_ARMS, both()),
        (CAMERA, three_kinds()),
    ):
        matplotlib.image.imsave(file, picture)
        print(f"wrote {file.relative_to(ROOT)}")
    social().savefig(SOCIAL)
    print(f"wrote {SOCIAL.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
