"""Set-points of a motion in joint space with numpy: what `native/set_points.c` is compared with."""

from __future__ import annotations

import numpy as np

from heptarm.planning.table import MANY, MotionTable
from heptarm.values.checks import Array

AXES = 7


def ahead(
    table: MotionTable, time: float, step: float, last: Array, leap: Array
) -> tuple[Array, Array, Array]:
    """Times, places and joints of the next set-points, `MANY` at most; see `SetPointRows.compute`."""
    pieces, lines = table.pieces, table.lines
    times = np.cumsum(np.concatenate([[time], np.full(MANY, step)]))[1:]
    times = times[times < table.duration]
    at = np.maximum(0, np.searchsorted(pieces[:, 0], times, side="right") - 1)
    since, (_, a, b, c, d) = times - pieces[at, 0], pieces[at].T
    places = np.maximum(a + since * (b + since * (c + since * d)), 0.0)
    places = places[: _first(places >= 1.0)]
    at = np.maximum(0, np.searchsorted(lines[:, 0], places, side="right") - 1)
    low, high = lines[at, 0], lines[at, 1]
    part = np.minimum(1.0, (places - low) / (high - low))
    joints = lines[at, 2 : 2 + AXES] + part[:, None] * lines[at, 2 + AXES :]
    count = _first((np.abs(np.diff(joints, axis=0, prepend=last[None])) > leap).any(axis=1))
    return times[:count], places[:count], joints[:count]


def _first(found: Array) -> int:
    """Index of the first that is true, or how many there are."""
    return int(found.argmax()) if found.any() else len(found)
