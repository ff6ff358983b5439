"""A chart as an interactive page, drawn with plotly."""

from __future__ import annotations

import base64
import html
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import require
from heptarm.record.plot.content import LONGEST, ChartContent, ChartRow, Line, thinned, with_room

#: Points of a line that a page has at most: enough to zoom in tenfold.
_POINTS = 20_000
_COLOURS = (
    "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf",
)  # fmt: skip
_DASHES = ("solid", "dash", "dot", "dashdot")
_ALARM, _NOTE = "#b22222", "#2ca02c"
#: Heights of a row, a path and the title [px].
_ROW, _PATH, _TITLE = 200, 520, 70
#: Gap between rows over the same time, and below one with a title of its axis [px].
_GAP, _WIDE_GAP = 24, 70
#: What a character of a motion's name takes of the width of a row.
_CHARACTER = 0.008


def page(chart: ChartContent) -> str:
    """An HTML page that needs no network, with the chart in it: about 5 MB, of which plotly.js has most.

    Rows over time have one axis of time, so that zoom and cursor are the same in all. The legend hides lines: a
    click hides one joint in all rows, a double click all others.

    Raises:
        MissingExtra: plotly is not installed.
    """
    plotly: Any = require("plotly.io", extra="record")
    heights = [_PATH if row.is_path else _ROW for row in chart.rows]
    gaps = [
        _GAP if here.is_time and below.is_time else _WIDE_GAP
        for here, below in zip(chart.rows, chart.rows[1:], strict=False)
    ] + [_WIDE_GAP]
    total = float(sum(heights) + sum(gaps))
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {
        "title": {"text": html.escape(chart.title), "x": 0.01, "font": {"size": 15}},
        "template": {},
        "height": total + _TITLE,
        "margin": {"l": 90, "r": 20, "t": _TITLE, "b": 0},
        "hovermode": "x unified",
        "hoversubplots": "axis",
        "legend": {"groupclick": "togglegroup", "itemsizing": "constant", "tracegroupgap": 0},
        "dragmode": "zoom",
    }
    last = max((index for index, row in enumerate(chart.rows) if row.is_time), default=-1)
    shown: set[str] = set()
    top = total
    for index, row in enumerate(chart.rows):
        domain = [(top - heights[index]) / total, top / total]
        top -= heights[index] + gaps[index]
        number = "" if index == 0 else str(index + 1)
        if row.is_path:
            layout[f"scene{number}"] = _scene(row, domain)
            data += [_path(line, f"scene{number}") for line in row.lines]
            data += _points(row, f"scene{number}")
            continue
        x = "" if row.is_time else number
        if not row.is_time or index == last:
            axis = {"title": {"text": row.x_title}, "anchor": f"y{number}", **_CURSOR}
            layout[f"xaxis{x}"] = axis | (
                {"type": "log"} if row.is_log else {"range": list(chart.times)} if row.is_time else {}
            )
        # pan and zoom change the time only, unless the pointer is on the other axis
        layout[f"yaxis{number}"] = {
            "title": {
                "text": f"{row.title}<br>[{row.unit}]" if row.unit else row.title,
                "font": {"size": 12},
            },
            "domain": domain,
            "anchor": f"x{x}",
            "gridcolor": "#e5e5e5",
            "zerolinecolor": "#cccccc",
            **({"type": "log"} if row.is_log else {"range": list(row.span)}),
        }
        for line in row.lines:
            data.append(_trace(line, row, x, number, is_first=line.label not in shown))
            shown.add(line.label)
        layout.setdefault("shapes", []).extend(
            {"type": "line", "xref": f"x{x} domain", "yref": f"y{number}", "x0": 0, "x1": 1, "y0": edge, "y1": edge,
             "line": {"color": _ALARM, "width": 1, "dash": "dot"}}
            for edge in row.edges
        )  # fmt: skip
    _add_events(chart, data, layout)
    body = plotly.to_html(
        {"data": data, "layout": layout},
        include_plotlyjs=True,
        full_html=False,
        validate=False,
        config={"displaylogo": False, "responsive": True, "scrollZoom": True},
    )
    title = html.escape(chart.title)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head>\n'
        f'<body style="margin:0;background:white">{body}</body></html>\n'
    )


_CURSOR = {
    "showspikes": True, "spikemode": "across", "spikesnap": "cursor", "spikethickness": 1, "spikedash": "solid",
    "spikecolor": "#555555", "gridcolor": "#e5e5e5", "zeroline": False,
}  # fmt: skip


def _numbers(values: npt.NDArray[np.float64], kind: str) -> dict[str, str]:
    """An array as plotly.js reads it from base64: a third of the size of digits."""
    return {"dtype": kind, "bdata": base64.b64encode(values.astype(f"<{kind}").tobytes()).decode()}


def _trace(line: Line, row: ChartRow, x: str, y: str, *, is_first: bool) -> dict[str, Any]:
    few = line if row.is_log else thinned(line, _POINTS)
    return {
        "type": "scattergl" if len(few.x) > 5000 else "scatter",
        "mode": "lines",
        "x": _numbers(few.x, "f8"),
        "y": _numbers(few.y, "f4"),
        "xaxis": f"x{x}",
        "yaxis": f"y{y}",
        "name": line.label or row.title,
        "legendgroup": line.label or f"{row.title} {line.colour}",
        "showlegend": bool(line.label) and is_first,
        "line": {"color": _COLOURS[line.colour % len(_COLOURS)], "width": 1.3, "dash": _DASHES[line.dash]},
        "hovertemplate": f"%{{y:.4g}} {html.escape(row.unit)}",
    }


def _path(line: Line, scene: str) -> dict[str, Any]:
    every = [np.zeros(0) if axis is None else axis for axis in (line.x, line.y, line.z)]
    step = max(1, len(every[0]) // _POINTS)
    ends = [0] * len(every[0][::step])
    return (
        {
            "type": "scatter3d",
            "mode": "lines",
            **{name: _numbers(axis[::step], "f4") for name, axis in zip("xyz", every, strict=True)},
            "scene": scene,
            "name": line.label or "path",
            "showlegend": False,
            "line": {"color": _COLOURS[line.colour % len(_COLOURS)], "width": 4, "dash": _DASHES[line.dash]},
            "hovertemplate": "%{x:.1f}, %{y:.1f}, %{z:.1f} mm",
        }
        if ends
        else {"type": "scatter3d", "scene": scene}
    )


def _points(row: ChartRow, scene: str) -> list[dict[str, Any]]:
    """Begins, ends and crosses of paths."""
    lines = [(line, line.z) for line in row.lines if line.z is not None and len(line.x)]
    begins = [[line.x[0], line.y[0], z[0]] for line, z in lines]
    ends = [[line.x[-1], line.y[-1], z[-1]] for line, z in lines]
    groups = [("begin", "circle", "#333333", np.array(begins)), ("end", "square", "#333333", np.array(ends))]
    groups.append(("collision", "x", _ALARM, np.zeros(0) if row.crosses is None else row.crosses))
    return [
        {
            "type": "scatter3d",
            "mode": "markers",
            **dict(zip("xyz", points.T.tolist(), strict=True)),
            "scene": scene,
            "name": name,
            "showlegend": False,
            "marker": {"symbol": symbol, "size": 5, "color": colour},
        }
        for name, symbol, colour, points in groups
        if points.size
    ]


def _scene(row: ChartRow, domain: list[float]) -> dict[str, Any]:
    """Axes in space with equal scales."""
    low, high = (edge.tolist() for edge in row.box)
    sizes = np.subtract(high, low)
    ratio = dict(zip("xyz", (1.1 * sizes / sizes.max()).tolist(), strict=True))
    axes = {
        f"{name}axis": {"title": {"text": f"{name} [{row.unit}]"}, "range": [low[index], high[index]]}
        for index, name in enumerate("xyz")
    }
    return {**axes, "domain": {"x": [0, 1], "y": domain}, "aspectmode": "manual", "aspectratio": ratio}


def _add_events(chart: ChartContent, data: list[dict[str, Any]], layout: dict[str, Any]) -> None:
    """Motions as bands through all rows over time, events as lines; the cursor shows their names."""
    rows = [index for index, row in enumerate(chart.rows) if row.is_time]
    if not rows:
        return
    shapes, names = layout.setdefault("shapes", []), layout.setdefault("annotations", [])
    for index in rows:
        place = {
            "xref": "x",
            "yref": f"y{index + 1 if index else ''} domain",
            "y0": 0,
            "y1": 1,
            "layer": "below",
        }
        for number, band in enumerate(chart.bands):
            shapes.append(
                place | {"type": "rect", "x0": band.begin, "x1": band.end, "line": {"width": 0}, "fillcolor": "#808080",
                         "opacity": 0.14 if number % 2 else 0.07}
            )  # fmt: skip
        for mark in chart.marks:
            shapes.append(
                place | {"type": "line", "x0": mark.t, "x1": mark.t,
                         "line": {"color": _ALARM if mark.is_alarm else _NOTE, "width": 1, "dash": "dash"}}
            )  # fmt: skip
    first = rows[0]
    axis = f"y{first + 1 if first else ''}"
    first_time, last_time = chart.times
    for band in with_room(chart.bands, _CHARACTER * (last_time - first_time)):
        names.append(
                {"xref": "x", "yref": f"{axis} domain", "x": (band.begin + band.end) / 2, "y": 1, "yanchor": "bottom",
                 "text": html.escape(band.text[:LONGEST]), "showarrow": False, "font": {"size": 10}}
            )  # fmt: skip
    if chart.marks:
        low, _ = chart.rows[first].span
        data.append(
            {"type": "scatter", "mode": "markers", "x": [mark.t for mark in chart.marks], "y": [low] * len(chart.marks),
             "text": [html.escape(mark.text) for mark in chart.marks], "hovertemplate": "%{text}", "name": "events",
             "xaxis": "x", "yaxis": axis, "showlegend": True, "cliponaxis": False,
             "marker": {"symbol": "triangle-up", "size": 9,
                        "color": [_ALARM if mark.is_alarm else _NOTE for mark in chart.marks]}}
        )  # fmt: skip
