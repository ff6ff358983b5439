"""Run the tutorial and draw where its steps leave the arm: docs/_static/tutorial.png.

    MUJOCO_GL=egl .venv/bin/python scripts/tutorial_pictures.py

Its blocks run as they are printed. It needs a display, or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import mujoco
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from heptarm.sim.plant.appearance import ArmMeshes  # noqa: E402
from heptarm.sim.plant.world import compiled  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402
from scripts.newcomer import BLOCK  # noqa: E402
from scripts.scenes_picture import seen  # noqa: E402

PAGE = ROOT / "docs" / "tutorial" / "first-ten-minutes.md"
PICTURE = ROOT / "docs" / "_static" / "tutorial.png"
#: What a block contains after which the arm is drawn, and the title of its picture.
STEPS = {
    "arm.move(ready)": "arm.move(ready)",
    "lin_rel(z=-0.10": "10 cm down on a straight line",
    "handle.cancel()": "cancelled on its way to A1 = 60 deg",
}


def postures() -> dict[str, Array]:
    """Joint positions after the steps, by title, each of shape (7,) [rad]."""
    names: dict[str, Any] = {}
    found: dict[str, Array] = {}
    for block in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        exec(compile(block, str(PAGE), "exec"), names)
        for part, title in STEPS.items():
            if part in block:
                found[title] = names["arm"].wait_for_rest().q
    return found


def main() -> int:
    """Draw the steps side by side."""
    model = compiled("iiwa14", meshes=ArmMeshes())
    data = mujoco.MjData(model)
    figure = Figure((9.6, 3.1), dpi=100)
    for axes, (title, q) in zip(figure.subplots(1, len(STEPS)), postures().items(), strict=True):
        data.qpos[:7] = q
        mujoco.mj_forward(model, data)
        axes.imshow(seen(model, data, (0.3, 0.0, 0.42), 1.45))
        axes.set_title(title, fontsize=10)
        axes.axis("off")
    figure.tight_layout()
    figure.savefig(PICTURE)
    print(f"wrote {PICTURE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
