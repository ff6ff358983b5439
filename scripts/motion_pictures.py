"""Draw a picture of every kind of motion for the documentation: docs/_static/motions/*.svg.

    .venv/bin/python scripts/motion_pictures.py [NAME ...]

Each kind runs on a private virtual cabinet. Left: the path of the flange, with the programmed points. Right: what the
limits made of it, the speed along the path, or that of the joints.
"""

from __future__ import annotations

import argparse
import io
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

import heptarm as ha  # noqa: E402
from heptarm.values.checks import Array  # noqa: E402
from heptarm.values.motion.motion import Motion  # noqa: E402

FOLDER = ROOT / "docs" / "_static" / "motions"
READY = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: Pushed states per second [Hz], and points of a curve that are drawn.
RATE, POINTS = 500.0, 160
SPEED = 0.2  # [m/s]
LINE, MARK, FAINT = "#2563ad", "#c2410c", "#9aa4b2"

_At: TypeAlias = Callable[[float, float, float], ha.Pose]


@dataclass(frozen=True)
class Kind:
    """A kind of motion.

    Attributes:
        motions: the program, from a function that makes a pose from offsets to the start [m].
        points: programmed points as offsets [m], which are drawn.
        plane: the two axes of the base that are drawn.
        joints: whether speeds of the joints are drawn instead of that along the path.
    """

    motions: Callable[[_At], Motion | Sequence[Motion]]
    points: tuple[tuple[float, float, float], ...] = ()
    plane: str = "yx"
    joints: bool = False


_CORNERS = ((0, 0.12, 0), (-0.1, 0.12, 0), (-0.1, 0, 0), (0, 0, 0))
_BENDS = ((0.03, 0.05, 0.0), (0.0, 0.1, 0.03), (0.0, 0.16, 0.03))


def _corners(at: _At, **more: float) -> list[Motion]:
    return [ha.lin(at(*point), speed_mps=SPEED, **more) for point in _CORNERS]  # type: ignore[arg-type]


KINDS = {
    "ptp": Kind(lambda at: ha.ptp(READY + ha.deg(40, 15, 0, 20, 0, -10, 60), speed=0.5), joints=True),
    "lin": Kind(lambda at: ha.lin(at(0.08, 0.16, 0), speed_mps=SPEED), ((0.08, 0.16, 0),)),
    "circ": Kind(
        lambda at: ha.circ(at(0.05, 0.06, 0), at(0, 0.12, 0), speed_mps=SPEED),
        ((0.05, 0.06, 0), (0, 0.12, 0)),
    ),
    "spline": Kind(
        lambda at: ha.spline(
            [at(*_BENDS[0]), at(*_BENDS[1]), ha.lin(at(*_BENDS[2])), at(0, 0, 0)], speed_mps=SPEED
        ),
        _BENDS,
        plane="yz",
    ),
    "spline-joints": Kind(
        lambda at: ha.spline_joints(
            [READY + ha.deg(10, 5, 0, 10, 0, 0, 20), READY + ha.deg(20, 0, 5, 0, 0, 10, 0), READY], speed=0.5
        ),
        joints=True,
    ),
    "ellipse": Kind(
        lambda at: ha.ellipse(at(0, 0, 0), 0.04, centre=at(0, 0.08, 0).xyz, speed_mps=0.25),
        ((0, 0.08, 0),),
    ),
    "stops": Kind(_corners, _CORNERS),
    "blending": Kind(lambda at: _corners(at, blend_m=0.03), _CORNERS),
}


def ran(arm: ha.Arm, kind: Kind) -> dict[str, Array]:
    """What was commanded: t [s], offsets of the flange [m], speeds of the joints [rad/s]."""
    arm.move(ha.ptp(READY))
    start = arm.wait_for_rest().pose
    motions = kind.motions(lambda x, y, z: ha.Pose.of(start.xyz + [x, y, z], start.quat))
    seen = [state for state in arm.start(motions).states() if state.pose is not None]
    arrays = {
        "t": np.array([(state.stamp - seen[0].stamp) * 1e-9 for state in seen]),
        "xyz": np.array([state.pose_cmd.xyz - start.xyz for state in seen]),
        "q": np.array([state.q_cmd for state in seen]),
    }
    keep = np.unique(np.linspace(0, len(seen) - 1, POINTS).astype(int))
    return {name: array[keep] for name, array in arrays.items()}


def drawn(kind: Kind, seen: dict[str, Array]) -> Any:
    """The figure of a run."""
    figure, (path, speed) = plt.subplots(1, 2, figsize=(7.2, 2.4), layout="constrained")
    across, up = ("xyz".index(axis) for axis in kind.plane)
    path.plot(seen["xyz"][:, across] * 1e3, seen["xyz"][:, up] * 1e3, color=LINE)
    path.plot(0, 0, "o", color=LINE, markersize=5)
    for point in kind.points:
        path.plot(point[across] * 1e3, point[up] * 1e3, "x", color=MARK, markersize=7)
    path.set(xlabel=f"{kind.plane[0]} [mm]", ylabel=f"{kind.plane[1]} [mm]")
    path.set_aspect("equal", adjustable="datalim")
    if kind.joints:
        rates = np.gradient(seen["q"], seen["t"], axis=0)
        for index in np.flatnonzero(np.abs(rates).max(axis=0) > 1e-3):
            speed.plot(seen["t"], np.degrees(rates[:, index]), label=f"A{index + 1}")
        speed.legend(fontsize=7, ncols=2)
        speed.set(xlabel="t [s]", ylabel="joint speed [deg/s]")
    else:
        along = np.linalg.norm(np.gradient(seen["xyz"], seen["t"], axis=0), axis=1)
        speed.plot(seen["t"], along * 1e3, color=LINE)
        speed.set(xlabel="t [s]", ylabel="speed [mm/s]", ylim=(0, None))
    for axes in (path, speed):
        axes.grid(color=FAINT, alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def saved(figure: Any, file: Path) -> None:
    """Write a figure as SVG: with text as text, the same for the same run, with short numbers."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)
    text = re.sub(r"(\d+\.\d)\d+", r"\1", stream.getvalue())
    file.write_text(re.sub(r"[ \t]+$", "", text, flags=re.M), encoding="utf-8")


def main() -> int:
    """Draw all kinds, or the named ones."""
    parser = argparse.ArgumentParser(description="Draw a picture of every kind of motion.")
    parser.add_argument("names", nargs="*", choices=[[], *KINDS], help="which; default: all")
    names = parser.parse_args().names or list(KINDS)
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "heptarm", "font.size": 8})
    FOLDER.mkdir(exist_ok=True)
    with ha.connect("sim://iiwa14?speed=2", state_rate=RATE, watchdog=10.0) as arm:
        for name in names:
            seen = ran(arm, KINDS[name])
            saved(drawn(KINDS[name], seen), FOLDER / f"{name}.svg")
            print(f"{name}: {seen['t'][-1]:.2f} s, {(FOLDER / f'{name}.svg').stat().st_size // 1024} KiB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
