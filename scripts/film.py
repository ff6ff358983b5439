"""Make the film of the README: docs/_static/film.webp, a peg inserted into a hole in the virtual cabinet.

    MUJOCO_GL=egl .venv/bin/python scripts/film.py [FILE]

The program is that of examples/16_insertion.py, in real time; the film shows what happened, faster. It needs a display,
or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
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


def perform(target: str) -> None:
    """Take the peg out of its holder and insert it into the hole, 2.3 mm beside where it is expected."""
    gripper_tool = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
    peg = ha.Workpiece("peg", mass=0.19, com=(0, 0, 0.025), frames={"tip": ha.Pose.at(0, 0, 0.065)})
    with ha.connect(target, watchdog=2.0) as arm, arm.tool(gripper_tool):
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


def recorded(model: mujoco.MjModel) -> Array:
    """Positions of arm and scene during the performance, shape (n, nq)."""
    found = []
    with tempfile.TemporaryDirectory(prefix="heptarm-") as folder:
        path = Path(folder) / "positions"
        command = [sys.executable, "-m", "heptarm.sim.runtime.cabinet", "--port", "0", "--scene", SCENE]
        command += ["--positions", str(path), "--parent-pipe"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
        cabinet = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        assert cabinet.stdin is not None and cabinet.stdout is not None
        try:
            target = f"sim://127.0.0.1:{json.loads(cabinet.stdout.readline())['port']}"
            file = PositionsFile(path, model.nq)
            performance = threading.Thread(target=perform, args=(target,))
            performance.start()
            while performance.is_alive():
                now = file.read()
                if now is not None:
                    found.append(now)
                time.sleep(_PERIOD)
        finally:
            cabinet.stdin.close()
            cabinet.wait(30)
    return np.array(found)


def chosen(positions: Array) -> Array:
    """The pictures' positions, from the first movement to the last: half of the film by time, half by what moves."""
    moved = np.abs(np.diff(positions, axis=0)).max(axis=1)
    first, last = np.flatnonzero(moved > 1e-4)[[0, -1]].tolist()
    moved = moved[first : last + 1]
    passed = np.cumsum(0.5 / len(moved) + 0.5 * moved / moved.sum())
    steps = np.searchsorted(passed, np.linspace(0.0, passed[-1], round(LENGTH * RATE)))
    return np.asarray(positions[first + np.minimum(steps, len(moved))])


def drawn(model: mujoco.MjModel, positions: Array) -> list[npt.NDArray[np.uint8]]:
    """The pictures, each of shape (height, width, 3), from a camera that goes round the arm slowly."""
    data, camera, pictures = mujoco.MjData(model), mujoco.MjvCamera(), []
    model.vis.global_.offwidth, model.vis.global_.offheight = 2 * SIZE[0], 2 * SIZE[1]
    model.vis.quality.shadowsize = 4096
    with mujoco.Renderer(model, 2 * SIZE[1], 2 * SIZE[0]) as renderer:
        for index, one in enumerate(positions):
            data.qpos[:] = one
            mujoco.mj_forward(model, data)
            turn = 12.0 * np.cos(2 * np.pi * index / len(positions))
            camera.lookat, camera.distance = (0.36, 0.0, 0.38), 1.45
            camera.azimuth, camera.elevation = 142.0 + turn, -17.0
            renderer.update_scene(data, camera)
            large = Image.fromarray(renderer.render())
            pictures.append(np.asarray(large.resize(SIZE, Image.Resampling.LANCZOS)))
    return pictures


def main() -> int:
    """Record, draw, write."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else FILM
    model = compiled("iiwa14", scene=Scene.of(SCENE), meshes=ArmMeshes())
    pictures = [Image.fromarray(one) for one in drawn(model, chosen(recorded(model)))]
    pictures[0].save(
        target,
        save_all=True,
        append_images=pictures[1:],
        duration=round(1e3 / RATE),
        loop=0,
        quality=QUALITY,
        method=6,
    )
    print(f"wrote {target}: {target.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
