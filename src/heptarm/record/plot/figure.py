"""A chart drawn with Matplotlib, for the screen or for paper."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from heptarm.errors import require
from heptarm.record.plot.content import LONGEST, ChartContent, ChartRow, Mark, Style, thinned, with_room

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Points of a line that a figure needs at most.
_POINTS = 4000
#: Text that stays text in vector files, so that a journal can embed its type (42) and an editor can change it.
_FILES = {"pdf.fonttype": 42, "svg.fonttype": "none"}
_DASHES = ("-", "--", ":", "-.")
#: Width of a character relative to the size of the type.
_CHARACTER = 0.6
#: Names of events stand above the values of the first row: the room for them, as a fraction of the row without it.
_NAMES = 0.5


@dataclass(frozen=True)
class _Look:
    """A style: width and heights [in], type and lines [pt], colours, pixels per inch."""

    width: float
    height: float
    path_height: float
    type_size: float
    line: float
    colours: tuple[str, ...]
    dpi: int
    has_title: bool


_LOOKS: dict[str, _Look] = {
    "screen": _Look(11.0, 1.9, 4.6, 8.0, 1.0, tuple(f"C{index}" for index in range(10)), 110, True),
    # Okabe and Ito (2008): which the colour-blind can tell apart
    "paper": _Look(
        3.5,
        1.25,
        2.8,
        7.0,
        0.8,
        ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"),
        600,
        False,
    ),
}


def draw(chart: ChartContent, style: Style) -> Figure:
    """Draw a chart as a Matplotlib figure, which needs no display."""
    figures: Any = require("matplotlib.figure", extra="record")
    look = _LOOKS[style]
    heights = [look.path_height if row.is_path else look.height for row in chart.rows]
    named = next((index for index, row in enumerate(chart.rows) if row.is_time and chart.marks), None)
    if named is not None:
        heights[named] *= 1 + _NAMES
    top = 0.8 if look.has_title else 0.3
    figure: Figure = figures.Figure(
        figsize=(look.width, top + sum(heights)), dpi=look.dpi, layout="constrained"
    )
    grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    shared: Axes | None = None
    labels: tuple[str, ...] = ()
    for index, row in enumerate(chart.rows):
        if row.is_path:
            _draw_path(figure.add_subplot(grid[index], projection="3d"), row, look)
            continue
        axes = figure.add_subplot(grid[index], sharex=shared if row.is_time else None)
        if row.is_time:
            axes.set_xlim(*_widened(*chart.times))
            _draw_events(axes, chart, look, with_names=shared is None)
            shared = shared or axes
        _draw_row(axes, row, look)
        if index == named:
            low, high = row.span
            axes.set_ylim(low, high + _NAMES * (high - low))
        now = tuple(line.label for line in row.lines if line.label)
        # in a narrow column the same legend stands once
        if len(now) > 1 and (look.has_title or now != labels):
            _draw_legend(axes, look)
        labels = now
    if look.has_title:
        figure.suptitle(chart.title, x=0.01, ha="left", fontsize=11)
    return figure


def encoded(figure: Figure, kind: str) -> bytes:
    """A figure as a file: "png", "svg" or "pdf"."""
    matplotlib: Any = require("matplotlib", extra="record")
    data = io.BytesIO()
    with matplotlib.rc_context(_FILES):
        figure.savefig(data, format=kind)
    return data.getvalue()


# --------------------------------------------------------------------------------------------------- parts


def _widened(first: float, last: float) -> tuple[float, float]:
    room = 0.01 * (last - first) or 0.5
    return first - room, last + room


def _draw_row(axes: Axes, row: ChartRow, look: _Look) -> None:
    for line in row.lines:
        few = line if row.is_log else thinned(line, _POINTS)
        axes.plot(
            few.x,
            few.y,
            _DASHES[line.dash],
            color=look.colours[line.colour % len(look.colours)],
            linewidth=look.line,
            label=line.label or "_",
        )
    for edge in row.edges:
        axes.axhline(edge, color="firebrick", linewidth=0.8, linestyle=":")
    if row.is_log:
        axes.set(xscale="log", yscale="log")
    else:
        axes.set_ylim(*row.span)
    axes.set_ylabel(f"{row.title}\n[{row.unit}]" if row.unit else row.title, fontsize=look.type_size)
    axes.set_xlabel(row.x_title, fontsize=look.type_size)
    axes.tick_params(labelsize=look.type_size)
    # an offset above the axis is overlooked: whole numbers instead
    if not row.is_log:
        axes.ticklabel_format(useOffset=False)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_legend(axes: Axes, look: _Look) -> None:
    small = look.type_size - 1
    if look.has_title:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=small)
    else:  # above: beside the axes it would take a sixth of the column
        axes.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=7, frameon=False, fontsize=small,
            handlelength=1.0, columnspacing=0.8, handletextpad=0.3,
        )  # fmt: skip


def _draw_events(axes: Axes, chart: ChartContent, look: _Look, *, with_names: bool) -> None:
    """Motions as bands, events as lines; their names in the first row, as many as have room."""
    for index, band in enumerate(chart.bands):
        axes.axvspan(band.begin, band.end, color="0.5", alpha=0.12 if index % 2 else 0.06, linewidth=0)
    first, last = axes.get_xlim()
    marks = [mark for mark in chart.marks if first <= mark.t <= last]
    for mark in marks:
        axes.axvline(
            mark.t, color=_colour(mark), linewidth=0.9, linestyle="--", alpha=0.8 if len(marks) < 30 else 0.4
        )
    if not with_names:
        return
    small = look.type_size - 1
    second = (last - first) / (look.width - 1.6)  # how much time an inch of the axis is
    top = axes.get_xaxis_transform()
    if look.has_title:  # in a narrow column nothing has room above the legend
        for band in with_room(chart.bands, small / 72 * _CHARACTER * second):
            axes.text(
                (band.begin + band.end) / 2, 1.02, band.text[:LONGEST], transform=top, fontsize=small,
                ha="center", va="bottom",
            )  # fmt: skip
    for mark in _apart(marks, small / 72 * 2.0 * second):
        axes.text(
            mark.t, 0.98, mark.text[:LONGEST], transform=top, color=_colour(mark), fontsize=small,
            ha="center", va="top", rotation=90, clip_on=True,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.5},
        )  # fmt: skip


def _colour(mark: Mark) -> str:
    return "firebrick" if mark.is_alarm else "tab:green"


def _apart(marks: Sequence[Mark], distance: float) -> list[Mark]:
    """The events whose names are at least so far apart [s]; stops and errors come before notes."""
    found: list[Mark] = []
    for mark in sorted(marks, key=lambda mark: not mark.is_alarm):
        if all(abs(mark.t - other.t) >= distance for other in found):
            found.append(mark)
    return found


def _draw_path(axes: Any, row: ChartRow, look: _Look) -> None:
    """A path in space with equal scales in all directions."""
    for line in row.lines:
        points = np.stack([line.x, line.y, np.empty(0) if line.z is None else line.z])
        if not points.size:
            continue
        colour = look.colours[line.colour % len(look.colours)]
        step = max(1, points.shape[1] // _POINTS)
        axes.plot(*points[:, ::step], _DASHES[line.dash], color=colour, linewidth=1.2 * look.line)
        axes.scatter(*points[:, 0], color=colour, marker="o", s=18 * look.line)
        axes.scatter(*points[:, -1], color=colour, marker="s", s=18 * look.line)
    if row.crosses is not None:
        axes.scatter(*row.crosses.T, color="firebrick", marker="x", s=40)
    low, high = row.box
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    for axis, size in zip("xyz", high - low, strict=True):
        getattr(axes, f"set_{axis}label")(f"{axis} [{row.unit}]", fontsize=look.type_size)
        # a short side has no room for many numbers
        getattr(axes, f"{axis}axis").get_major_locator().set_params(
            nbins=max(2, round(7 * size / max(high - low)))
        )
    axes.tick_params(labelsize=look.type_size - 1)
    if look.has_title:
        axes.set_title(row.title, fontsize=look.type_size, loc="left")
