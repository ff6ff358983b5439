"""Run the examples and draw their results: docs/_static/examples/*.png, and the page docs/guide/examples.md.

    .venv/bin/python scripts/example_pictures.py [NUMBER ...]     run and draw these; default: all
    .venv/bin/python scripts/example_pictures.py --page           write the page only

An example runs unchanged, in a process of its own; what its first arm reports is recorded meanwhile.
"""

from __future__ import annotations

import argparse
import ast
import io
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

import heptarm as ha  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402

EXAMPLES = ROOT / "examples"
PICTURES = ROOT / "docs" / "_static" / "examples"
PAGE = ROOT / "docs" / "guide" / "examples.md"
SOURCE = "https://github.com/heptarm/heptarm/blob/main/examples"
#: Recorded states per second [Hz], points of a curve, and colours of a picture.
RATE, POINTS, COLOURS = 200.0, 900, 32
#: What shows the result of an example: two plots.
PLOTS = {
    "02": ("joints", "speeds"),
    "03": ("joints", "speeds"),
    "04": ("top", "speed"),
    "05": ("joints", "speeds"),
    "06": ("joints", "speeds"),
    "07": ("joints", "speeds"),
    "08": ("top", "speed"),
    "09": ("height", "force"),
    "10": ("joints", "speeds"),
    "11": ("height", "torques"),
    "12": ("front", "speed"),
    "13": ("front", "joints"),
    "14": ("height", "force"),
    "15": ("top", "height"),
    "16": ("height", "force"),
    "17": ("front", "force"),
    "18": ("front", "height"),
    "19": ("front", "speeds"),
    "20": ("front", "speed"),
    "21": ("joints", "speeds"),
    "22": ("front", "speed"),
    "23": ("front", "height"),
    "24": ("height", "force"),
    "26": ("joints", "torques"),
}
DEFAULT = ("joints", "height")
#: Runs an example with the first connection recorded.
RUNNER = """
import runpy, sys
import heptarm as ha

file, rate = sys.argv[1], float(sys.argv[2])
del sys.argv[:3]
connect, connect_all, recorders = ha.connect, ha.connect_all, []

def watched(arm):
    if not recorders:
        recorder = arm.record(file, rate=rate)
        recorder.__enter__()
        recorders.append(recorder)
        close = arm.close
        def closed():
            recorder.__exit__(None, None, None)
            close()
        object.__setattr__(arm, "close", closed)  # an arm is sealed against names that it has not

def connected(*arguments, **keywords):
    arm = connect(*arguments, **keywords)
    watched(arm)
    return arm

def connected_all(*arguments, **keywords):
    arms = connect_all(*arguments, **keywords)
    watched(next(iter(arms)))
    return arms

ha.connect, ha.connect_all = connected, connected_all
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@dataclass(frozen=True)
class Example:
    """An example: its file, and the first line of its docstring."""

    file: Path
    title: str

    @property
    def number(self) -> str:
        """Two digits."""
        return self.file.name[:2]

    @property
    def picture(self) -> Path:
        """Its picture, which may not exist."""
        return PICTURES / f"{self.file.stem}.png"


def examples() -> list[Example]:
    """All examples by their numbers."""
    found = []
    for file in sorted(EXAMPLES.glob("[0-9][0-9]_*.py")):
        title = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").partition("\n")[0]
        found.append(Example(file, title))
    return found


def recorded(example: Example) -> ha.Recording:
    """Run an example and return the recording of its arm."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.mcap"
        environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT / "src")}
        command = [sys.executable, "-c", RUNNER, str(file), str(RATE), str(example.file)]
        subprocess.run(
            command, check=True, env=environment, cwd=folder, timeout=300, stdout=subprocess.DEVNULL
        )
        return ha.load(file)


def drawn(example: Example, run: ha.Recording) -> None:
    """Draw the picture of an example."""
    keep = np.unique(np.linspace(0, len(run) - 1, POINTS).astype(int))
    seen = {name: run[name][keep] for name in ("t", "q", "dq", "tau", "tau_ext", "pose", "wrench")}
    figure, axes = plt.subplots(1, 2, figsize=(6.4, 2.2), layout="constrained")
    for one, plot in zip(axes, PLOTS.get(example.number, DEFAULT)):
        _plot(one, plot, seen)
        one.grid(alpha=0.25)
        one.spines[["top", "right"]].set_visible(False)
    PICTURES.mkdir(exist_ok=True)
    stream = io.BytesIO()
    figure.savefig(stream, dpi=110, format="png")
    plt.close(figure)
    from PIL import Image

    with Image.open(stream) as image:  # few colours: a tenth of the size
        image.convert("RGB").quantize(COLOURS).save(example.picture, optimize=True)


def _plot(axes: Any, plot: str, seen: dict[str, Array]) -> None:
    t, xyz = seen["t"], seen["pose"][:, :3] * 1e3
    if plot in ("top", "front"):
        up, name = (xyz[:, 0], "x") if plot == "top" else (xyz[:, 2], "z")
        axes.plot(xyz[:, 1], up, linewidth=1.0)
        axes.set(xlabel="y [mm]", ylabel=f"{name} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        return
    axes.set_xlabel("t [s]")
    if plot in ("joints", "speeds", "torques"):
        rows, unit = {
            "joints": (np.degrees(seen["q"]), "joints [deg]"),
            "speeds": (np.degrees(seen["dq"]), "joint speeds [deg/s]"),
            "torques": (seen["tau"], "torques [Nm]"),
        }[plot]
        for index in np.flatnonzero(np.ptp(np.nan_to_num(rows), axis=0) > 0.5):
            axes.plot(t, rows[:, index], linewidth=1.0, label=f"A{index + 1}")
        axes.legend(fontsize=6, ncols=2)
        axes.set_ylabel(unit)
    elif plot == "force":
        axes.plot(t, np.linalg.norm(seen["wrench"][:, :3], axis=1), linewidth=0.8)
        axes.set_ylabel("force [N]")
    elif plot == "height":
        axes.plot(t, xyz[:, 2], linewidth=1.0)
        axes.set_ylabel("z [mm]")
    else:
        axes.plot(t, np.linalg.norm(np.gradient(xyz, t, axis=0), axis=1), linewidth=0.8)
        axes.set_ylabel("speed [mm/s]")


HEAD = """# Examples

Programs for tasks of a lab. Each runs unchanged: `python examples/01_first_motion.py` on a private simulator, or on
the robot in `HEPTARM_TARGET`. The pictures are what the arm reported meanwhile, drawn by `scripts/example_pictures.py`.
The folder also has programs for [ROS](ros2.md), for [Sunrise applications](own-applications.md) and for FRI in C++.
"""


def page() -> str:
    """The page of all examples."""
    lines = [HEAD]
    for one in examples():
        lines += [f"## {one.number} {one.file.stem[3:].replace('_', ' ').capitalize()}", "", one.title, ""]
        if one.picture.exists():
            lines += [f"![What the arm did in {one.file.name}](../_static/examples/{one.picture.name})", ""]
        lines += [
            f"[`examples/{one.file.name}`]({SOURCE}/{one.file.name})",
            "",
        ]
    return "\n".join(lines)


def main() -> int:
    """Run and draw examples, and write the page."""
    parser = argparse.ArgumentParser(description="Run the examples and draw their results.")
    parser.add_argument("numbers", nargs="*", help="which; default: all")
    parser.add_argument("--page", action="store_true", help="write the page only")
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    matplotlib.rcParams.update({"font.size": 7})
    for one in [] if arguments.page else examples():
        if not arguments.numbers or one.number in arguments.numbers:
            drawn(one, recorded(one))
            print(f"{one.file.name}: {one.picture.stat().st_size // 1024} KiB", flush=True)
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
