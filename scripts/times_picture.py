"""Draw docs/_static/times.png, where the time goes, from the newest stored runs of `make bench`.

python scripts/times_picture.py
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.figures_page import machines, newest  # noqa: E402

PICTURE = ROOT / "docs" / "_static" / "times.png"
#: Figures that have a floor, without their placement, and what they and their floors are.
BESIDE_FLOORS = {
    "round_trip": "a request | raw echo",
    "round_trip_key": "a request with a key | raw echo",
    "push_age": "age of a state at 1 kHz | bare path",
    "tick": "a tick of the plant | mj_step",
    "servo_set": "set of a servo | bare send",
    "fri_reply_busy": "an FRI reply | C echo",
    "fri_law_c": "reply of a law in C | C echo",
    "fri_law_numba": "reply of a law by Numba | C echo",
    "fri_law_c_polled": "reply of a law in C, busy_poll | C echo",
    "ros2_states_200hz": "ROS 2 joint states | bare topic",
    "ros1_states_200hz": "ROS 1 joint states | bare topic",
}
#: Parts of a request in their order.
PARTS = {
    "request_encode": "Python: check, encode",
    "request_path": "kernel: both directions, wake two threads",
    "request_java": "C: frames; Java: decode, act, answer",
    "request_decode": "Python: answer, journal",
}
OWN, FLOOR = "#d9622b", "#9aa5b1"

Record = dict[str, Any]


def main() -> None:
    """Draw the picture."""
    found = newest()
    figures = {figure["name"]: figure for figure in found}
    picture = plt.figure(figsize=(11, 6.6), constrained_layout=True)
    upper, lower = picture.subfigures(2, 1, height_ratios=(5, 1.5))
    one, two = upper.subplots(1, 2, sharex=True, sharey=True)
    _beside_floors(one, figures, "one_core", "everything on one core")
    _beside_floors(two, figures, "two_cores", "each side on a core of its own")
    one.invert_yaxis()  # of both
    one.legend(loc="upper right", fontsize=8)
    _parts(lower.subplots(), figures)
    lower.legend(ncol=5, fontsize=7, loc="outside lower center", frameon=False)
    shown = [one for one in found if one["name"].startswith((*BESIDE_FLOORS, *PARTS))]
    picture.suptitle(
        f"Medians and their floors, each pair on one machine: {', '.join(machines(shown))}", fontsize=9
    )
    picture.savefig(PICTURE, dpi=100, metadata={"Software": None})
    print(PICTURE.relative_to(ROOT))


def _beside_floors(axis: plt.Axes, figures: dict[str, Record], placement: str, title: str) -> None:
    rows = [(figures.get(f"{name}_{placement}"), text) for name, text in BESIDE_FLOORS.items()]
    for row, (figure, _) in enumerate(rows):
        if figure is None:
            continue
        scale = {"us": 1.0, "ms": 1e3}[figure["unit"]]
        own, floor = figure["value"] * scale, figure["reference"] * scale
        axis.barh(row - 0.2, own, 0.38, color=OWN, label="heptarm" if row == 0 else None)
        axis.barh(row + 0.2, floor, 0.38, color=FLOOR, label="its floor" if row == 0 else None)
        axis.text(own * 1.08, row - 0.2, f"{own:.3g} µs, {figure['ratio']:.2g} ×", va="center", fontsize=8)
    axis.set_yticks(range(len(rows)), [text for _, text in rows], fontsize=8)
    axis.set_xscale("log")
    axis.set_xlim(1.0, 2e4)
    axis.set_title(title, fontsize=9)
    axis.set_xlabel("median [µs]")
    axis.grid(alpha=0.3, axis="x")


def _parts(axis: plt.Axes, figures: dict[str, Record]) -> None:
    """The parts of a request, in the fastest tenth, which a busy machine changes least."""
    times = [figures[name]["detail"]["fastest_tenth"] for name in PARTS]
    begins = np.concatenate([[0.0], np.cumsum(times)])
    colours = ("#f3b48f", "#e58a57", FLOOR, "#6fa3c7", "#f7d3bd")
    for begin, time, text, colour in zip(begins, times, PARTS.values(), colours, strict=False):
        axis.barh(0, time, left=begin, color=colour, edgecolor="white", label=text)
        axis.text(begin + time / 2, 0, f"{time:.1f}", ha="center", va="center", fontsize=8)
    axis.set_yticks([])
    axis.set_xlim(0.0, begins[-1])
    axis.set_title("parts of a request across two cores, fastest tenth", fontsize=9)
    axis.set_xlabel("time since the call [µs]")


if __name__ == "__main__":
    main()
