"""Taught trajectories: joint positions over time, to be simplified, saved and replayed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import (
    Array,
    Value,
    finite,
    finite_entries,
    flag,
    frozen,
    instance,
    numbers,
    within,
)
from heptarm.values.files import path_of, read_arrays, refuse_existing, unreadable, unwritable
from heptarm.values.motion.spline import JointSpline, spline_joints
from heptarm.values.motion.table import read_table
from heptarm.values.text import degrees, fixed, lines

#: Marks a file as a trajectory, so that another .npz is not mistaken for one.
FORMAT = "heptarm trajectory 1"
_WHAT, _HINT = (
    "a trajectory",
    "`heptarm teach` and Trajectory.save write one; a table of joint positions ends in .csv",
)
#: Most points of a spline that the cabinet accepts.
MOST_POINTS = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory(Value):
    """Joint positions over time, linear between two points.

    Attributes:
        times: ascending, the first is 0, shape (n,) [s].
        q: joint positions, shape (n, 7) [rad].
        robot: model that it was taught on, such as "iiwa14"; empty: unknown.
    """

    times: Array
    q: Array
    robot: str = ""

    def __post_init__(self) -> None:
        t, points = numbers(self.times, "times"), numbers(self.q, "q")
        if t.ndim != 1 or len(t) < 2 or points.shape != (len(t), 7):
            raise ShapeError(
                f"times and q must have shapes (n,) and (n, 7) with n >= 2, got {t.shape} and {points.shape}",
                parameter="q",
            )
        finite_entries(t, "times")
        finite_entries(points, "q")
        if not (np.diff(t) > 0).all():
            raise LimitError("times must be strictly ascending", code=2, parameter="times")
        instance(self.robot, str, "robot")
        object.__setattr__(self, "times", frozen(t - t[0]))
        object.__setattr__(self, "q", points)

    @staticmethod
    def of(times: npt.ArrayLike, q: npt.ArrayLike, *, robot: str = "") -> Trajectory:
        """A trajectory from times and joint positions; its time starts at 0.

        Raises:
            ShapeError: fewer than two points, or shapes that do not fit.
            LimitError: a number that is not finite, or times that do not ascend.
        """
        return Trajectory(cast("Array", times), cast("Array", q), robot)

    def __len__(self) -> int:
        """Number of points."""
        return len(self.times)

    def __str__(self) -> str:
        """A few lines: how long it is, where it begins and ends, how fast it is."""
        rows = {
            "robot": self.robot,
            "duration": f"{self.duration:.2f} s, {len(self)} points",
            "begin": degrees(self.q[0]),
            "end": degrees(self.q[-1]),
            "fastest": f"{' '.join(fixed(speed, 1) for speed in np.degrees(self.fastest))} deg/s",
        }
        return lines("Trajectory", rows)

    @property
    def duration(self) -> float:
        """Time of the last point [s]."""
        return float(self.times[-1])

    @property
    def fastest(self) -> Array:
        """Highest speed of each axis, shape (7,) [rad/s]."""
        return np.asarray(np.abs(self._slopes()).max(axis=0))

    def _slopes(self) -> Array:
        slopes: Array = np.diff(self.q, axis=0) / np.diff(self.times)[:, None]
        return slopes

    def at(self, t: float) -> tuple[Array, Array]:
        """Positions [rad] and velocities [rad/s] at a time [s], shape (7,) each; before and after, it is at rest."""
        t = finite(t, "t", unit="s")
        piece = int(np.searchsorted(self.times, t, side="right")) - 1
        if piece < 0 or t >= self.duration:
            return self.q[0 if piece < 0 else -1], np.zeros(7)
        slope = (self.q[piece + 1] - self.q[piece]) / (self.times[piece + 1] - self.times[piece])
        return self.q[piece] + slope * (t - self.times[piece]), slope

    def positions(self, times: Array) -> Array:
        """Positions at times of shape (m,) [s], shape (m, 7) [rad]."""
        times = finite_entries(numbers(times, "times"), "times")
        if times.ndim != 1:
            raise ShapeError(f"times must have shape (m,), got {times.shape}", parameter="times", value=times)
        return np.stack([np.interp(times, self.times, column) for column in self.q.T], axis=1)

    def trimmed(self, *, still: float = 1e-3) -> Trajectory:
        """The trajectory without the rests at its ends.

        Args:
            still: a joint closer than this to its first (last) position counts as at rest [rad].

        Raises:
            CommandRejected: nothing moves at all.
        """
        within(still, "still", 0.0, 1.0, unit="rad")
        away = np.flatnonzero(np.abs(self.q - self.q[0]).max(axis=1) > still)
        before = np.flatnonzero(np.abs(self.q - self.q[-1]).max(axis=1) > still)
        if not len(away) or not len(before):
            raise CommandRejected(
                f"nothing moves by more than {still:g} rad",
                parameter="still",
                hint="teach again, or give a smaller value of still",
            )
        begin, end = max(int(away[0]) - 1, 0), min(int(before[-1]) + 1, len(self) - 1)
        if begin >= end:  # it creeps, so that the rest at its beginning ends behind that at its end
            return self
        return Trajectory.of(self.times[begin : end + 1], self.q[begin : end + 1], robot=self.robot)

    def thinned(self, *, tolerance: float = 2e-3) -> Trajectory:
        """The trajectory with as few of its points as needed.

        The points are chosen as Douglas and Peucker do ("Algorithms for the reduction of the number of points required
        to represent a digitized line", 1973), with the distance at equal times.

        Args:
            tolerance: largest deviation of a joint at any recorded time [rad].
        """
        within(tolerance, "tolerance", 0.0, 1.0, above=True, unit="rad")
        return self._chosen(_needed(self.times, self.q, tolerance))

    def _chosen(self, indices: list[int]) -> Trajectory:
        return Trajectory.of(self.times[indices], self.q[indices], robot=self.robot)

    def spline(self, *, tolerance: float = 5e-3, speed: float | None = None) -> JointSpline:
        """A joint spline through its points, timed by the cabinet.

        Args:
            tolerance: largest deviation of a joint from straight lines between the chosen points [rad].
            speed: fraction of each joint's maximum, (0, 1]; None: the cabinet's default.

        Raises:
            CommandRejected: nothing moves, or the spline needs too many points.
        """
        within(tolerance, "tolerance", 0.0, 1.0, above=True, unit="rad")
        moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.q, axis=0)).max(axis=1))])
        keep = np.concatenate([[True], np.diff(moved) > 1e-9])  # a rest is a single point of the path
        path, points = moved[keep], self.q[keep]
        if len(path) < 2:
            raise CommandRejected("nothing moves", parameter="trajectory", hint="teach again")
        chosen = points[_needed(path, points, tolerance)]
        if len(chosen) > MOST_POINTS + 1:
            raise CommandRejected(
                f"a spline must have at most {MOST_POINTS} points, this one needs {len(chosen)}",
                parameter="tolerance",
                value=tolerance,
                hint="give a larger tolerance, or replay it by servo",
            )
        return spline_joints([*chosen[1:]], speed=speed)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write a file, .npz; returns its path.

        Args:
            path: the file; another suffix is replaced by .npz.
            overwrite: replace a file that exists.

        Raises:
            CommandRejected: the file exists, or cannot be written.
        """
        file = refuse_existing(path_of(path).with_suffix(".npz"), overwrite=flag(overwrite, "overwrite"))
        try:
            np.savez_compressed(file, format=FORMAT, times=self.times, q=self.q, robot=self.robot)
        except OSError as error:
            raise unwritable(file, error) from error
        return file

    @staticmethod
    def load(path: str | Path, *, rate: float | None = None) -> Trajectory:
        """Read a file that `save` has written, or a table (.csv, .txt) of another program.

        A table has seven columns of joint positions [rad], A1 to A7, and may have a column of times [s] before them. In
        the first line their names may stand; of more columns those named q.A1 to q.A7 and t are taken.

        Args:
            path: the file.
            rate: rows per second of a table that has no times in seconds [Hz]; None: 100, if it has no times at all.

        Raises:
            CommandRejected: the file cannot be read or is neither, or the times of a table may not be in seconds and
                there is no rate; of a table the text has line and column.
        """
        file = path_of(path)
        if file.suffix.lower() in (".csv", ".txt"):
            rows = None if rate is None else within(rate, "rate", 0.0, 10000.0, above=True, unit="Hz")
            content = dict(zip(("times", "q"), read_table(file, rate=rows), strict=True))
            robot = ""
        else:
            content = read_arrays(file, _WHAT, hint=_HINT)
            for name in ("format", "times", "q", "robot"):
                if name not in content:
                    raise unreadable(file, f"the array {name!r} is missing", what=_WHAT, hint=_HINT)
            if str(content["format"]) != FORMAT:
                raise unreadable(file, f"its format is {content['format']}", what=_WHAT, hint=_HINT)
            robot = str(content["robot"])
        try:
            return Trajectory.of(content["times"], content["q"], robot=robot)
        except CommandRejected as error:
            raise unreadable(file, error.text, what=_WHAT, hint=_HINT) from None


def _needed(along: Array, points: Array, tolerance: float) -> list[int]:
    """Indices of the points to keep, by Douglas and Peucker: lines between them are within the tolerance."""
    kept = {0, len(along) - 1}
    stack = [(0, len(along) - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        fraction = (along[first + 1 : last] - along[first]) / (along[last] - along[first])
        straight = points[first] + fraction[:, None] * (points[last] - points[first])
        off = np.abs(points[first + 1 : last] - straight).max(axis=1)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            kept.add(middle)
            stack += [(first, middle), (middle, last)]
    return sorted(kept)
