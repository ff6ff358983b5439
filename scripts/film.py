"""Make the film of the README: docs/_static/film.webp, a peg inserted into a hole in the virtual cabinet.

    MUJOCO_GL=egl .venv/bin/python scripts/film.py [FILE]

The program is that of examples/16_insertion.py, in real time; the film shows what happened, faster. It needs a display,
or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

import heptarm as ha  # noqa: E402
from heptarm.sim.plant.appearance import ArmMeshes  # noqa: E402
from heptarm.sim.plant.scene import Scene  # noqa: E402
from heptarm.sim.plant.shared_state import PositionsFile  # noqa: E402
from heptarm.sim.plant.world import compiled  # noqa: E402
from heptarm.skills import insert  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402

FILM = ROOT / "docs" / "_static" / "film.webp"
SCENE = "peg-in-hole"
SIZE = (640, 400)  # width and height [pixels]
LENGTH, RATE = 9.0, 14.0  # of the film [s], pictures per second
QUALITY = 55
#: Time between two samples of the simulator [s].
_PERIOD = 0.02


def perform(arm: ha.Arm) -> None:
    """Take the peg out of its holder and insert it into the hole, 2.3 mm beside where it is expected."""
    gripper_tool = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
    peg = ha.Workpiece("peg", mass=0.19, com=(0, 0, 0.025), frames={"tip": ha.Pose.at(0, 0, 0.065)})
    with arm.tool(gripper_tool):
        gripper = ha.TwoSignalGripper(
            arm, open="OutputX3Pin1", close="OutputX3Pin2", is_open="InputX3Pin3", is_closed="InputX3Pin4"
        )
        gripper.open()
        arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
        down = arm.pose().quat
        arm.move(ha.ptp(ha.Pose.of((0.6, -0.1, 0.365), down)), speed=0.5)
        arm.move(ha.lin(ha.Pose.of((0.6, -0.1, 0.265), down), speed_mps=0.15))
        gripper.close()
        with arm.attached(peg):
            arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.2))
            arm.move(ha.lin(ha.Pose.of((0.602, 0.0988, 0.315), down), speed_mps=0.25))
            insert(arm, "z", depth=0.03, force=10.0, search=ha.spiral(0.0055), distance=0.015)
            gripper.open()
        arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.25))
        arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)


@dataclass(frozen=True, slots=True)
class View:
    """Where the camera of a film is; it goes round what it looks at, slowly, to and fro.

    Attributes:
        lookat: what it looks at [m].
        distance: from there [m].
        azimuth: about the vertical axis, in the middle [deg].
        elevation: above the horizon, negative looks down [deg].
        turn: how far it goes to either side [deg].
    """

    lookat: tuple[float, float, float] = (0.36, 0.0, 0.38)
    distance: float = 1.45
    azimuth: float = 142.0
    elevation: float = -17.0
    turn: float = 12.0


def modelled(scene: str) -> mujoco.MjModel:
    """The arm in a scene, as it is drawn."""
    return compiled("iiwa14", scene=Scene.of(scene), meshes=ArmMeshes())


def recorded(model: mujoco.MjModel, scene: str, perform: Callable[[ha.Arm], object]) -> Array:
    """Positions of arm and scene during a performance, shape (n, nq).

    Args:
        model: of arm and scene.
        scene: name of the scene.
        perform: called with a virtual arm in it.
    """
    found = []
    with ha.connect(f"sim://iiwa14?scene={scene}", watchdog=5.0) as arm:
        cabinet = arm.connection.cabinet
        assert cabinet is not None and cabinet.positions is not None
        file = PositionsFile(cabinet.positions, model.nq)
        performance = threading.Thread(target=perform, args=(arm,))
        performance.start()
        while performance.is_alive():
            now = file.read()
            if now is not None:
                found.append(now)
            time.sleep(_PERIOD)
    return np.array(found)


def chosen(positions: Array, length: float) -> Array:
    """The pictures' positions, from the first movement to the last: half of the film by time, half by what moves.

    Args:
        positions: shape (n, nq).
        length: of the film [s].
    """
    moved = np.abs(np.diff(positions, axis=0)).max(axis=1)
    first, last = np.flatnonzero(moved > 1e-4)[[0, -1]].tolist()
    moved = moved[first : last + 1]
    passed = np.cumsum(0.5 / len(moved) + 0.5 * moved / moved.sum())
    steps = np.searchsorted(passed, np.linspace(0.0, passed[-1], round(length * RATE)))
    return np.asarray(positions[first + np.minimum(steps, len(moved))])


def drawn(
    model: mujoco.MjModel, positions: Array, view: View, size: tuple[int, int]
) -> list[npt.NDArray[np.uint8]]:
    """The pictures, each of shape (height, width, 3)."""
    data, camera, pictures = mujoco.MjData(model), mujoco.MjvCamera(), []
    model.vis.global_.offwidth, model.vis.global_.offheight = 2 * size[0], 2 * size[1]
    model.vis.quality.shadowsize = 4096
    with mujoco.Renderer(model, 2 * size[1], 2 * size[0]) as renderer:
        for index, one in enumerate(positions):
            data.qpos[:] = one
            mujoco.mj_forward(model, data)
            camera.lookat, camera.distance = view.lookat, view.distance
            camera.azimuth = view.azimuth + view.turn * np.cos(2 * np.pi * index / len(positions))
            camera.elevation = view.elevation
            renderer.update_scene(data, camera)
            large = Image.fromarray(renderer.render())
            pictures.append(np.asarray(large.resize(size, Image.Resampling.LANCZOS)))
    return pictures


def written(pictures: list[npt.NDArray[np.uint8]], target: Path) -> None:
    """Write a film."""
    first, *others = [Image.fromarray(one) for one in pictures]
    first.save(
        target,
        save_all=True,
        append_images=others,
        duration=round(1e3 / RATE),
        loop=0,
        quality=QUALITY,
        method=6,
    )
    print(f"wrote {target}: {target.stat().st_size / 1e6:.2f} MB")


def main() -> int:
    """Record, draw, write."""
    model = modelled(SCENE)
    positions = chosen(recorded(model, SCENE, perform), LENGTH)
    written(drawn(model, positions, View(), SIZE), Path(sys.argv[1]) if len(sys.argv) > 1 else FILM)
    return 0


if __name__ == "__main__":
    sys.exit(main())
