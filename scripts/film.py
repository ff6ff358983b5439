"""Make the film of the README: docs/_static/film.webp, a peg inserted by examples/16_insertion.py in the virtual cabinet.

    MUJOCO_GL=egl .venv/bin/python scripts/film.py [FILE]

The example runs on a cabinet of its own in real time; the film shows what happened, faster. It needs a display, or EGL or
OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

from heptarm.sim.plant.appearance import ArmMeshes  # noqa: E402
from heptarm.sim.plant.scene import Scene  # noqa: E402
from heptarm.sim.plant.shared_state import PositionsFile  # noqa: E402
from heptarm.sim.plant.world import compiled  # noqa: E402
from heptarm.values.arrays import Array  # noqa: E402

FILM = ROOT / "docs" / "_static" / "film.webp"
EXAMPLE = ROOT / "examples" / "16_insertion.py"
SCENE = "peg-in-hole"
SIZE = (640, 400)  # width and height [pixels]
LENGTH, RATE = 9.0, 14.0  # of the film [s], pictures per second
QUALITY = 55
#: Time between two samples of the simulator [s].
_PERIOD = 0.02


def recorded(model: mujoco.MjModel) -> Array:
    """Positions of arm and scene while the example runs, shape (n, nq)."""
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
            port = json.loads(cabinet.stdout.readline())["port"]
            file = PositionsFile(path, model.nq)
            environment["HEPTARM_TARGET_WITH_PEG_IN_HOLE"] = f"sim://127.0.0.1:{port}"
            example = subprocess.Popen([sys.executable, str(EXAMPLE), "1"], env=environment)
            while example.poll() is None:
                now = file.read()
                if now is not None:
                    found.append(now)
                time.sleep(_PERIOD)
            if example.returncode:
                raise SystemExit(f"{EXAMPLE.name} failed")
        finally:
            cabinet.stdin.close()
            cabinet.wait(30)
    return np.array(found)


def chosen(positions: Array) -> Array:
    """The pictures' positions: from the first movement to the last, evenly."""
    moved = np.flatnonzero(np.abs(np.diff(positions, axis=0)).max(axis=1) > 1e-4)
    first, last = int(moved[0]), int(moved[-1])
    return positions[np.linspace(first, last, round(LENGTH * RATE)).round().astype(int)]


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
            camera.lookat, camera.distance = (0.34, 0.0, 0.40), 1.62
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
