"""Set-points of a motion in joint space, many at once.

Its path consists of straight lines and its profile of cubic polynomials, so that set-points need no more than the
numbers of both.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from heptarm.io.compiled import Unavailable, compiled_library
from heptarm.sim.planning.composite_path import CompositePath
from heptarm.sim.planning.jerk_profile import TimeLaw
from heptarm.values.arrays import Array

#: So many set-points are computed at once in C, and without a compiler, where each time takes half a millisecond.
MANY, MANY_IN_PYTHON = 64, 1024
_AXES = 7
_SOURCE = Path(__file__).with_name("ahead.c")
_REAL, _POINTER, _INT = ctypes.c_double, ctypes.c_void_p, ctypes.c_int


@functools.cache
def ahead_library() -> ctypes.CDLL | None:
    """Load the function; None: this system is not supported, or has no compiler."""
    try:
        made = compiled_library("ahead", _SOURCE.read_bytes(), holds_gil=True)
    except Unavailable:
        return None
    made.ha_ahead.argtypes = (_POINTER, _INT, _POINTER, _INT, *([_REAL] * 3), _INT, *([_POINTER] * 5))
    made.ha_ahead.restype = _INT
    return made


@dataclass(frozen=True, slots=True)
class SetPointRows:
    """Set-points of ticks one after the other.

    Attributes:
        times: of the motion at each of them [s].
        places: path parameter s at each of them.
        joints: joint positions at each of them, shape (7,) [rad].
        is_last: whether the next set-point is the end of the motion, or one that an axis cannot follow.
    """

    times: list[float]
    places: list[float]
    joints: list[Array]
    is_last: bool


class MotionTable:
    """The numbers from which the set-points of a motion follow.

    Args:
        pieces: of the profile, see `TimeLaw.pieces`.
        lines: of the path, see `CompositePath.lines`.
        duration: of the profile [s].
    """

    __slots__ = ("_at", "_duration", "_library", "_lines", "_pieces")

    def __init__(self, pieces: Array, lines: Array, duration: float) -> None:
        self._pieces, self._lines = np.ascontiguousarray(pieces), np.ascontiguousarray(lines)
        self._duration, self._library = duration, ahead_library()
        self._at = (self._pieces.ctypes.data, len(pieces), self._lines.ctypes.data, len(lines), duration)

    @classmethod
    def of(cls, path: CompositePath, profile: TimeLaw) -> MotionTable | None:
        """Of a path and a profile; None: the set-points have to be computed one by one."""
        lines = path.lines
        pieces = None if lines is None else profile.pieces
        return None if lines is None or pieces is None else cls(pieces, lines, profile.duration)

    def ahead(self, time: float, step: float, *, last: Array, leap: Array) -> SetPointRows:
        """The next set-points.

        Args:
            time: of the motion at the last one [s].
            step: by which it grows in each tick [s].
            last: the last one, shape (7,) [rad].
            leap: largest change of an axis in a tick, shape (7,) [rad].
        """
        if self._library is None:
            return self._in_python(time, step, last, leap)
        times, joints = np.empty((2, MANY)), np.empty((MANY, _AXES))
        at = times.ctypes.data
        count = self._library.ha_ahead(
            *self._at,
            time,
            step,
            MANY,
            leap.ctypes.data,
            last.ctypes.data,
            at,
            at + 8 * MANY,
            joints.ctypes.data,
        )
        passed, places = times[:, :count].tolist()
        return SetPointRows(passed, places, list(joints[:count]), count < MANY)

    def _in_python(self, time: float, step: float, last: Array, leap: Array) -> SetPointRows:
        pieces, lines = self._pieces, self._lines
        times = np.cumsum(np.concatenate([[time], np.full(MANY_IN_PYTHON, step)]))[1:]
        times = times[times < self._duration]
        at = np.maximum(0, np.searchsorted(pieces[:, 0], times, side="right") - 1)
        since, (_, a, b, c, d) = times - pieces[at, 0], pieces[at].T
        places = np.maximum(a + since * (b + since * (c + since * d)), 0.0)
        places = places[: _first(places >= 1.0)]
        at = np.maximum(0, np.searchsorted(lines[:, 0], places, side="right") - 1)
        low, high = lines[at, 0], lines[at, 1]
        part = np.minimum(1.0, (places - low) / (high - low))
        joints = lines[at, 2 : 2 + _AXES] + part[:, None] * lines[at, 2 + _AXES :]
        leaps = np.abs(np.diff(joints, axis=0, prepend=last[None])) > leap
        count = _first(leaps.any(axis=1))
        return SetPointRows(
            times[:count].tolist(), places[:count].tolist(), list(joints[:count]), count < MANY_IN_PYTHON
        )


def _first(found: Array) -> int:
    """Index of the first that is true, or how many there are."""
    return int(found.argmax()) if found.any() else len(found)
