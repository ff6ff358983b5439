"""Set-points of a motion in joint space, many at once.

Its path consists of straight lines and its profile of cubic polynomials, so that set-points need no more than the
numbers of both; set_points.c computes them.
"""

from __future__ import annotations

import ctypes
import functools
from array import array
from typing import Any

import numpy as np

from heptarm._library import library
from heptarm.planning.composite_path import CompositePath
from heptarm.planning.jerk_profile import TimeLaw
from heptarm.values.checks import Array

#: So many set-points are computed at once.
MANY = 64
_AXES = 7
_WORD, _REAL, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


@functools.cache
def _ahead() -> Any:
    """`ha_ahead` of set_points.c.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """
    function = library(holds_gil=True).ha_ahead
    function.argtypes, function.restype = (_POINTER, _POINTER, _REAL, _REAL), _WORD
    return function


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
        times: of the motion at each of them [s].
        places: path parameter s at each of them.
        joints: joint positions, shape (n, 7) [rad]; other arrays each time.
        is_last: whether the next set-point is the end of the motion, or one that an axis cannot follow.
    """

    __slots__ = (
        "_address",
        "_compute",
        "_last",
        "_leap",
        "_memory",
        "_written",
        "is_last",
        "joints",
        "places",
        "times",
    )

    def __init__(self, leap: Array) -> None:
        self._compute = _ahead()
        self.times, self.places = array("d", bytes(8 * MANY)), array("d", bytes(8 * MANY))
        self._leap, self._last, self._written = leap.copy(), np.zeros(_AXES), np.zeros((MANY, _AXES))
        self.joints, self.is_last = self._written, False
        self._memory = _Ahead(
            self._last.ctypes.data,
            self._leap.ctypes.data,
            self.times.buffer_info()[0],
            self.places.buffer_info()[0],
            self._written.ctypes.data,
            MANY,
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
        count: int = self._compute(table.address, self._address, time, step)
        self.joints, self.is_last = self._written.copy(), count < MANY
        return count
