"""What a plot shows, whatever draws it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Style = Literal["screen", "paper"]
STYLES: tuple[Style, ...] = ("screen", "paper")
#: Longest names of motions and events, in characters.
LONGEST = 24
#: Room above and below the values of a row, as a fraction of their span.
_MARGIN = 0.05
#: Least extent of a path in a direction, as a fraction of its largest, and in metres: a flat box cannot be read.
_LEAST_EXTENT, _LEAST_PATH = 0.2, 0.01


@dataclass(frozen=True, eq=False)
class Line:
    """A line.

    Attributes:
        x: of its points; of a path [mm].
        y: likewise.
        z: of a path [mm]; None: the line is not in space.
        label: in the legend; empty: none.
        colour: number of its colour, from 0.
        dash: number of its pattern, from 0: solid, dashed, dotted, dash-dotted.
    """

    x: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    z: npt.NDArray[np.float64] | None = None
    label: str = ""
    colour: int = 0
    dash: int = 0


@dataclass(frozen=True, eq=False)
class ChartRow:
    """One pair of axes.

    Attributes:
        title: what is drawn, such as "joint position".
        unit: of it.
        lines: the lines.
        x_title: of the other axis, with its unit.
        least: the least span of the axis, so that noise does not look like motion; in the unit.
        edges: values that are marked as limits.
        is_time: over time, so that bands and marks belong here.
        is_log: both axes are logarithmic.
        is_path: a path in space.
        crosses: points of a path that are marked, shape (n, 3) [mm].
    """

    title: str
    unit: str
    lines: tuple[Line, ...]
    x_title: str = "time [s]"
    least: float = 0.0
    edges: tuple[float, ...] = ()
    is_time: bool = True
    is_log: bool = False
    is_path: bool = False
    crosses: npt.NDArray[np.float64] | None = None

    @property
    def span(self) -> tuple[float, float]:
        """Lower and upper end of the axis: all values and limits, at least `least` wide."""
        low, high = extremes([line.y for line in self.lines] + [np.array(self.edges, float)])
        room = max(0.0, self.least - (high - low)) / 2
        margin = _MARGIN * max(high - low, self.least)
        return low - room - margin, high + room + margin

    @property
    def box(self) -> npt.NDArray[np.float64]:
        """Lowest and highest corner of a path's box, shape (2, 3) [mm]: no side is less than a fifth of the longest."""
        every = [(line.x, line.y, line.z) for line in self.lines if line.z is not None]
        ends = np.array([extremes([path[axis] for path in every]) for axis in range(3)])
        middle, spans = ends.mean(axis=1), np.ptp(ends, axis=1)
        spans = np.maximum(spans, max(float(spans.max()) * _LEAST_EXTENT, _LEAST_PATH * 1e3)) * (1 + _MARGIN)
        return np.array([middle - spans / 2, middle + spans / 2])


@dataclass(frozen=True)
class Band:
    """A motion: its begin and end [s], and its name."""

    begin: float
    end: float
    text: str = ""


@dataclass(frozen=True)
class Mark:
    """An event: its time [s], its name, and whether it is a stop or an error."""

    t: float
    text: str
    is_alarm: bool = False


@dataclass(frozen=True, eq=False)
class ChartContent:
    """What a plot shows: rows, one below the other, with motions and events.

    Attributes:
        title: above it.
        rows: the rows.
        bands: motions, in the rows over time.
        marks: events, likewise.
    """

    title: str
    rows: tuple[ChartRow, ...]
    bands: tuple[Band, ...] = ()
    marks: tuple[Mark, ...] = ()

    @property
    def times(self) -> tuple[float, float]:
        """First and last time of the rows over time [s]."""
        return extremes(
            [line.x for row in self.rows if row.is_time and not row.is_path for line in row.lines]
        )


def extremes(arrays: Sequence[npt.NDArray[np.float64]]) -> tuple[float, float]:
    """Smallest and largest finite value of arrays; 0 and 0 if they have none."""
    finite = [array[np.isfinite(array)] for array in arrays]
    known = [array for array in finite if array.size]
    return min((float(values.min()) for values in known), default=0.0), max(
        (float(values.max()) for values in known), default=0.0
    )


def thinned(line: Line, most: int) -> Line:
    """A line with about so many points at most: the smallest and largest of every few, so that no peak is lost."""
    if len(line.x) <= most:
        return line
    step = -(-2 * len(line.x) // most)
    count = len(line.x) // step
    blocks = line.y[: count * step].reshape(count, step)
    times = np.repeat(line.x[: count * step : step], 2)
    both = np.stack([blocks.min(axis=1), blocks.max(axis=1)], axis=1).reshape(-1)
    x, y = np.append(times, line.x[count * step :]), np.append(both, line.y[count * step :])
    return Line(x, y, None, line.label, line.colour, line.dash)


def with_room(bands: Sequence[Band], character: float) -> list[Band]:
    """The motions whose names have room beside each other; a character takes so much time [s]."""
    found: list[Band] = []
    free = -np.inf
    for band in bands:
        middle, half = (band.begin + band.end) / 2, len(band.text[:LONGEST]) * character / 2
        if middle - half >= free:
            found.append(band)
            free = middle + half + character
    return found
