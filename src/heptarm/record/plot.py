"""Figures of recordings: signals over time beside their limits, the path in space, two recordings on each other."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.record.recorded import FRI, RecordedData
from heptarm.record.samples import labels
from heptarm.values.checks import flag
from heptarm.values.files import path_of, refuse_existing
from heptarm.values.robot import RobotModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What is drawn if no signals are named; "path" is the path in space.
USUAL = ("q", "dq", "tau", "wrench", "path")
PATH = "path"
#: Requests and events that are marked on the time line.
_MARKED = ("Stop", "SafetyChanged", "ControlChanged", "ConditionFired", "TriggerFired", "Pause", "Resume")
#: Points of a line that a figure needs at most.
_POINTS = 4000
_DPI = 110


@dataclass(frozen=True)
class _Quantity:
    """How a signal is drawn: its title, a factor, its unit, and the names of its limits in the robot model."""

    title: str
    factor: float = 1.0
    unit: str = ""
    limits: tuple[str, str] = ("", "")


_DEG = 180.0 / np.pi
_QUANTITIES = {
    "q": _Quantity("joint position", _DEG, "deg", ("q_min", "q_max")),
    "q_cmd": _Quantity("commanded position", _DEG, "deg", ("q_min", "q_max")),
    "q_sent": _Quantity("position sent", _DEG, "deg", ("q_min", "q_max")),
    "q_ipo": _Quantity("interpolator's position", _DEG, "deg", ("q_min", "q_max")),
    "dq": _Quantity("joint speed", _DEG, "deg/s", ("-dq_max", "dq_max")),
    "tau": _Quantity("joint torque", 1.0, "Nm", ("-tau_max", "tau_max")),
    "tau_ext": _Quantity("external torque", 1.0, "Nm"),
    "tau_cmd": _Quantity("commanded torque", 1.0, "Nm"),
    "tau_sent": _Quantity("torque sent", 1.0, "Nm"),
    "xyz": _Quantity("place of the motion frame", 1e3, "mm"),
    "xyz_cmd": _Quantity("commanded place", 1e3, "mm"),
    "force": _Quantity("external force", 1.0, "N"),
    "torque": _Quantity("external torque at the frame", 1.0, "Nm"),
    "wrench": _Quantity("external force and torque", 1.0, "N, Nm"),
    "e1": _Quantity("redundancy angle", _DEG, "deg"),
    "latency": _Quantity("time from receipt to answer", 1e-3, "us"),
    "progress": _Quantity("progress", 100.0, "%"),
    "override": _Quantity("override", 100.0, "%"),
}


def figure_of(recording: RecordedData, signals: Sequence[str] = ()) -> Figure:
    """A figure of signals over time, one below the other, with motions as bands and events as lines.

    Limits are drawn as fractions of the way to them where a signal has one for each joint: 1 is the limit.

    Args:
        recording: what is drawn.
        signals: names as in `recording.names`, or "path"; none: positions, speeds and torques by their limits, wrench
            and path, as far as they were recorded.

    Raises:
        CommandRejected: no such signal, or nothing to draw.
        MissingExtra: matplotlib is not installed.
    """
    chosen = _chosen((recording,), signals)
    figure, axes = _rows(chosen)
    for name, one in zip(chosen, axes, strict=True):
        if name == PATH:
            _draw_path(one, recording, "tab:blue", "")
            continue
        _draw_bands(one, recording, is_first=name == chosen[0])
        _draw_signal(one, recording, name)
    figure.suptitle(_title(recording), x=0.01, ha="left", fontsize=11)
    return figure


def compare(first: RecordedData, second: RecordedData, signals: Sequence[str] = ()) -> Figure:
    """Two recordings on each other, from the beginning of their first motions on; the second one is drawn broken.

    Raises:
        CommandRejected: no such signal in both, or nothing to draw.
        MissingExtra: matplotlib is not installed.
    """
    chosen = _chosen((first, second), signals)
    figure, axes = _rows(chosen)
    for name, one in zip(chosen, axes, strict=True):
        for recording, style, colour in ((first, "-", "tab:blue"), (second, "--", "tab:orange")):
            if name == PATH:
                _draw_path(one, recording, colour, style)
            else:
                _draw_signal(
                    one, recording, name, style=style, zero=_start(recording), has_legend=style == "-"
                )
    title = f"{first.path.name} (solid) and {second.path.name} (broken), from their first motions on"
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def save(figure: Figure, out: str | Path, *, overwrite: bool = False) -> Path:
    """Write a figure: .png, .svg, .pdf, or .html, a page with the figure in it.

    Args:
        figure: to write.
        out: the file; its suffix chooses the format.
        overwrite: replace a file that exists.

    Raises:
        CommandRejected: another suffix, or the file exists or cannot be written.
    """
    path = path_of(out, "out")
    suffix = path.suffix.lower()
    if suffix not in (".png", ".svg", ".pdf", ".html"):
        raise CommandRejected(
            f"the suffix must be one of .png, .svg, .pdf, .html, got {path.suffix!r}",
            parameter="out",
            value=str(out),
            allowed=".png, .svg, .pdf, .html",
        )
    refuse_existing(path, overwrite=flag(overwrite, "overwrite"), name="out")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if suffix == ".html":
            path.write_text(_page(figure), encoding="utf-8")
        else:
            figure.savefig(path, dpi=_DPI)
    except OSError as error:
        raise CommandRejected(
            f"{path} cannot be written: {error.strerror}", parameter="out", value=str(out)
        ) from error
    return path


def _page(figure: Figure) -> str:
    data = io.BytesIO()
    figure.savefig(data, format="svg")
    source = base64.b64encode(data.getvalue()).decode()
    suptitle = figure.get_suptitle() if hasattr(figure, "get_suptitle") else ""
    title = html.escape(suptitle or "heptarm")
    return (
        f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{title}</title>\n'
        '<body style="margin:0;background:white">'
        f'<img style="max-width:100%" alt="{title}" src="data:image/svg+xml;base64,{source}"></body></html>\n'
    )


# --------------------------------------------------------------------------------------------------- parts


def _chosen(recordings: Sequence[RecordedData], signals: Sequence[str]) -> list[str]:
    """Names to draw, checked."""
    if signals:
        for name in signals:
            for recording in recordings:
                array = recording["xyz" if name == PATH else name]
                if array.dtype.kind not in "fiu":
                    raise CommandRejected(
                        f"signal {name!r} has no numbers to draw", parameter="signals", value=name
                    )
        return list(signals)
    found = [
        name
        for name in USUAL
        if all(_has_numbers(recording, "xyz" if name == PATH else name) for recording in recordings)
    ]
    if not found:
        raise CommandRejected(
            "there is nothing to draw: the recording has no states",
            parameter="signals",
            hint="record with a state rate above 0",
        )
    return found


def _has_numbers(recording: RecordedData, name: str) -> bool:
    return name in recording and len(recording[name]) > 1 and not bool(np.isnan(recording[name]).all())


def _rows(names: Sequence[str]) -> tuple[Figure, list[Any]]:
    """A figure with a row for each signal; the path is higher."""
    figures: Any = require("matplotlib.figure", extra="record")
    heights = [3.6 if name == PATH else 1.9 for name in names]
    figure = figures.Figure(figsize=(11, 0.8 + sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(names), 1, height_ratios=heights)
    axes: list[Any] = []
    shared = None
    for index, name in enumerate(names):
        if name == PATH:
            axes.append(figure.add_subplot(grid[index], projection="3d"))
        else:
            axes.append(figure.add_subplot(grid[index], sharex=shared))
            shared = shared or axes[-1]
    return figure, axes


def _title(recording: RecordedData) -> str:
    facts = recording.facts
    where = facts.get("title", "") + (" (virtual)" if facts.get("virtual") == "true" else "")
    reason = f", black box: {facts['black_box']}" if "black_box" in facts else ""
    return f"{recording.path.name}: {where}, {recording.duration:.1f} s{reason}"


def _start(recording: RecordedData) -> float:
    return recording.motions[0].begin if recording.motions else 0.0


def _draw_signal(
    axes: Axes,
    recording: RecordedData,
    name: str,
    *,
    style: str = "-",
    zero: float = 0.0,
    has_legend: bool = True,
) -> None:
    short = name.removeprefix(FRI)
    quantity = _QUANTITIES.get(short, _Quantity(short))
    t = recording[f"{FRI}t" if name.startswith(FRI) else "t"] - zero
    values = recording[name].astype(np.float64)
    values = values[:, None] if values.ndim == 1 else values
    step = 1 if len(t) <= _POINTS else -(-2 * len(t) // _POINTS)
    limits = _limits(recording.robot, quantity)
    by_limit = short in ("dq", "tau") and limits is not None
    values = values / limits[1] if by_limit and limits is not None else values * quantity.factor
    names = labels(name, values.shape[1]) if values.shape[1] > 1 else ("",)
    for column, label in enumerate(names):
        axes.plot(
            *_thinned(t, values[:, column], step), style, color=f"C{column}", linewidth=1.0,
            label=label if has_legend else "_",
        )  # fmt: skip
    if by_limit:
        axes.axhline(1.0, color="firebrick", linewidth=0.8, linestyle=":")
        axes.axhline(-1.0, color="firebrick", linewidth=0.8, linestyle=":")
    axes.set_ylabel(
        f"{quantity.title}\n{'[fraction of limit]' if by_limit else f'[{quantity.unit}]'}", fontsize=8
    )
    if has_legend and len(names) > 1:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=7)
    axes.set_xlabel("time [s]", fontsize=8)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _thinned(
    t: npt.NDArray[Any], values: npt.NDArray[Any], step: int
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """The smallest and largest value of every few, so that no peak is lost."""
    if step == 1:
        return t, values
    count = len(t) // step
    blocks = values[: count * step].reshape(count, step)
    times = np.repeat(t[: count * step : step], 2)
    both = np.stack([blocks.min(axis=1), blocks.max(axis=1)], axis=1).reshape(-1)
    return np.append(times, t[count * step :]), np.append(both, values[count * step :])


def _limits(
    robot: RobotModel | None, quantity: _Quantity
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]] | None:
    low, high = quantity.limits
    if robot is None or not high:
        return None
    upper = getattr(robot, high)
    return (-upper if low.startswith("-") else getattr(robot, low)), upper


def _draw_bands(axes: Axes, recording: RecordedData, *, is_first: bool) -> None:
    """Motions as bands, notes and important events as lines; their names above the first row."""
    first, last = _span(recording)
    top = axes.get_xaxis_transform()
    for index, one in enumerate(recording.motions):
        # a part of a recording has motions that began before it or end behind it
        begin, until = max(one.begin, first), last if np.isnan(one.end) else min(one.end, last)
        axes.axvspan(begin, until, color="0.5", alpha=0.12 if index % 2 else 0.06, linewidth=0)
        if is_first:
            middle = (begin + until) / 2
            axes.text(
                middle,
                1.02,
                one.text[:18],
                transform=top,
                fontsize=7,
                ha="center",
                va="bottom",
                clip_on=False,
            )
    for event in recording.events:
        if event.kind == "note" or event.kind == "error" or event.name in _MARKED:
            colour = "tab:green" if event.kind == "note" else "firebrick"
            axes.axvline(event.t, color=colour, linewidth=0.9, linestyle="--", alpha=0.8)
            if is_first:
                text = event.text if event.kind == "note" else event.name
                axes.text(
                    event.t,
                    0.98,
                    f" {text[:24]}",
                    transform=top,
                    color=colour,
                    fontsize=7,
                    va="top",
                    rotation=90,
                )


def _span(recording: RecordedData) -> tuple[float, float]:
    """First and last time that is drawn [s]."""
    times = [t for t in (recording.t, recording.signals.get(f"{FRI}t")) if t is not None and len(t)]
    return min((float(t[0]) for t in times), default=0.0), max((float(t[-1]) for t in times), default=0.0)


def _draw_path(axes: Any, recording: RecordedData, colour: str, style: str) -> None:
    points = recording["xyz"] * 1e3
    points = points[~np.isnan(points).any(axis=1)]
    points = points[:: max(1, len(points) // _POINTS)]
    if not len(points):
        return
    axes.plot(*points.T, style or "-", color=colour, linewidth=1.2, label=recording.path.name)
    axes.scatter(*points[0], color=colour, marker="o", s=18)
    axes.scatter(*points[-1], color=colour, marker="s", s=18)
    axes.set_xlabel("x [mm]", fontsize=8)
    axes.set_ylabel("y [mm]", fontsize=8)
    axes.set_zlabel("z [mm]", fontsize=8)
    axes.set_title("path of the motion frame (circle: begin, square: end)", fontsize=8, loc="left")
    spans = np.ptp(points, axis=0)
    axes.set_box_aspect(np.maximum(spans, max(float(spans.max()), 1.0) * 0.2))
