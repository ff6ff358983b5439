"""Set-points of a motion in joint space, many at once.

Its path consists of straight lines and its profile of cubic polynomials, so that set-points need no more than the
numbers of both. C computes them; without the extension, numpy does with full arrays.
"""

from __future__ import annotations

import ctypes
import functools
from array import array

import numpy as np

from heptarm._library import Unavailable, library
from heptarm.planning.composite_path import CompositePath
from heptarm.planning.jerk_profile import TimeLaw
from heptarm.values.checks import Array

#: So many set-points are computed at once in C, and without the extension, where each time takes half a millisecond.
MANY, MANY_IN_PYTHON = 64, 1024
_AXES = 7
_WORD, _REAL, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


@functools.cache
def ahead_library() -> ctypes.CDLL | None:
    """Load the function; None: this system is not supported, or has no compiler."""
    try:
        made = library(holds_gil=True)
    except Unavailable:
        return None
    made.ha_ahead.argtypes, made.ha_ahead.restype = (_POINTER, _POINTER, _REAL, _REAL), _WORD
    return made


class _Table(ctypes.Structure):
    """`struct table` of set_points.h."""

    _fields_ = (
        ("pieces", _POINTER),
        ("lines", _POINTER),
        ("piece_count", _WORD),
        ("line_count", _WORD),
        ("end", _REAL),
    )


class Cursor(ctypes.Structure):
    """`struct cursor` of set_points.h."""

    _fields_ = (("time", _REAL), ("place", _REAL), ("piece", _WORD), ("line", _WORD))


class _Ahead(ctypes.Structure):
    """`struct ahead` of set_points.h."""

    _fields_ = (
        ("last", _POINTER),
        ("leap", _POINTER),
        ("times", _POINTER),
        ("places", _POINTER),
        ("joints", _POINTER),
        ("most", _WORD),
    )


class MotionTable:
    """The numbers from which the set-points of a motion follow.

    Args:
        pieces: of the profile, see `TimeLaw.pieces`.
        lines: of the path, see `CompositePath.lines`.
        duration: of the profile [s].

    Attributes:
        address: of the same for C.
    """

    __slots__ = ("_memory", "address", "duration", "lines", "pieces")

    def __init__(self, pieces: Array, lines: Array, duration: float) -> None:
        self.pieces, self.lines = np.ascontiguousarray(pieces), np.ascontiguousarray(lines)
        self.duration = duration
        self._memory = _Table(
            self.pieces.ctypes.data, self.lines.ctypes.data, len(pieces), len(lines), duration
        )
        self.address = ctypes.addressof(self._memory)

    @classmethod
    def of(cls, path: CompositePath, profile: TimeLaw) -> MotionTable | None:
        """Of a path and a profile; None: the set-points have to be computed one by one."""
        lines = path.lines
        pieces = None if lines is None else profile.pieces
        return None if lines is None or pieces is None else cls(pieces, lines, profile.duration)


class SetPointRows:
    """Set-points of ticks one after the other; computed in place, since a tick has cold caches.

    Args:
        leap: largest change of an axis in a tick, shape (7,) [rad].

    Attributes:
        most: how many are computed at once.
        times: of the motion at each of them [s].
        places: path parameter s at each of them.
        joints: joint positions, shape (n, 7) [rad]; other arrays each time.
        is_last: whether the next set-point is the end of the motion, or one that an axis cannot follow.
    """

    __slots__ = (
        "_address",
        "_last",
        "_leap",
        "_library",
        "_memory",
        "_written",
        "is_last",
        "joints",
        "most",
        "places",
        "times",
    )

    def __init__(self, leap: Array) -> None:
        self._library = ahead_library()
        self.most = MANY_IN_PYTHON if self._library is None else MANY
        self.times, self.places = array("d", bytes(8 * self.most)), array("d", bytes(8 * self.most))
        self._leap, self._last, self._written = leap.copy(), np.zeros(_AXES), np.zeros((self.most, _AXES))
        self.joints, self.is_last = self._written, False
        self._memory = _Ahead(
            self._last.ctypes.data,
            self._leap.ctypes.data,
            self.times.buffer_info()[0],
            self.places.buffer_info()[0],
            self._written.ctypes.data,
            self.most,
        )
        self._address = ctypes.addressof(self._memory)

    def compute(self, table: MotionTable, time: float, step: float, last: Array) -> int:
        """Compute the next set-points; returns how many they are.

        Args:
            table: of the motion.
            time: of the motion at the last one [s].
            step: by which it grows in each tick [s].
            last: the last one, shape (7,) [rad].
        """
        self._last[:] = last
        if self._library is None:
            count = self._in_python(table, time, step)
        else:
            count = self._library.ha_ahead(table.address, self._address, time, step)
        self.joints, self.is_last = self._written.copy(), count < self.most
        return count

    def _in_python(self, table: MotionTable, time: float, step: float) -> int:
        pieces, lines = table.pieces, table.lines
        times = np.cumsum(np.concatenate([[time], np.full(self.most, step)]))[1:]
        times = times[times < table.duration]
        at = np.maximum(0, np.searchsorted(pieces[:, 0], times, side="right") - 1)
        since, (_, a, b, c, d) = times - pieces[at, 0], pieces[at].T
        places = np.maximum(a + since * (b + since * (c + since * d)), 0.0)
        places = places[: _first(places >= 1.0)]
        at = np.maximum(0, np.searchsorted(lines[:, 0], places, side="right") - 1)
        low, high = lines[at, 0], lines[at, 1]
        part = np.minimum(1.0, (places - low) / (high - low))
        joints = lines[at, 2 : 2 + _AXES] + part[:, None] * lines[at, 2 + _AXES :]
        leaps = np.abs(np.diff(joints, axis=0, prepend=self._last[None])) > self._leap
        count = _first(leaps.any(axis=1))
        self.times[:count], self.places[:count] = array("d", times[:count]), array("d", places[:count])
        self._written[:count] = joints[:count]
        return count


def _first(found: Array) -> int:
    """Index of the first that is true, or how many there are."""
    return int(found.argmax()) if found.any() else len(found)
