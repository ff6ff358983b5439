"""How fast a path may be gone along whose limits change on the way.

The largest speed at every sample follows from what the program and the axes allow there; a pass from the start and
one from the end keep the acceleration; a moving average over time then bounds the jerk. So that the average does
not bring speed into a narrow place, every narrow place is first made as wide as the average is long. What is still
too much is slowed down where it is, and in the end as a whole.

The passes are those of Bobrow, Dubowsky, Gibson, "Time-Optimal Control of Robotic Manipulators Along Specified
Paths", IJRR 4(3), 1985, with symmetrical bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.values.arrays import Array
from heptarm.virtual.profile import Limits

#: Share of an axis' acceleration that the path's curvature may use, and the path's third derivative of the jerk.
_CURVE, _TWIST = 0.9, 0.9
#: Share of it that may come at once, where a line meets an arc.
_JUMP = 0.1
#: Share of an axis' acceleration that the passes may use.
_GRIP = 0.97
#: Time between two entries of a timetable [s], unless it is very long.
_STEP = 1e-3
_MOST = 100_000
_ROUNDS = 8
_TOLERANCE = 1.01
_TINY = 1e-12
#: Share of the jerk that braking uses; the rest is for the curvature.
_BRAKE = 0.6
#: Share of an axis' acceleration that braking uses in a curve that leaves less.
_LEAST = 0.3


@dataclass(frozen=True, slots=True)
class Course:
    """What bounds the speed along a path, at n samples of its parameter s.

    Attributes:
        s: shape (n,), ascending.
        first: dq/ds, shape (n, m): seven axes, then perhaps ways of the moved frame that count as axes.
        second: d²q/ds², likewise.
        third: d³q/ds³, likewise.
        pace: largest ds/dt that the program allows, shape (n,).
        velocity: largest speeds, shape (n, m).
        acceleration: likewise.
        jerk: likewise.
        braking: axes' accelerations when it is cancelled, shape (m,); infinite where nothing counts.
        braking_jerk: likewise.
    """

    s: Array
    first: Array
    second: Array
    third: Array
    pace: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    braking: Array
    braking_jerk: Array

    def brakes(self, s: float, speed: float) -> Limits:
        """Limits of s for coming to rest from a place and a speed ds/dt."""
        low = max(0, int(np.searchsorted(self.s, s, side="right")) - 1)
        ahead = np.maximum(self.s[low:] - s, 0.0)
        first, second = np.abs(self.first[low:]) + _TINY, np.abs(self.second[low:])
        jerks = (_BRAKE * self.braking_jerk / first).min(axis=1)
        most, jerk = float((self.braking / first[0]).min()), float(jerks[0])
        for _ in range(4):  # the speed that is left at a place depends on how hard it brakes before
            late = speed * most / jerk / 2
            square = np.maximum(speed * speed - 2 * most * np.maximum(ahead - late, 0.0), 0.0)
            here = max(1, int(np.searchsorted(-square, 0.0)))
            room = np.maximum(self.braking - second[:here] * square[:here, None], _LEAST * self.braking)
            most, jerk = float((room / first[:here]).min()), float(jerks[:here].min())
        return Limits(2 * speed + _TINY, most, jerk)


class Timetable:
    """s over time, tabulated; the same interface as a profile.

    Args:
        step: between two entries [s].
        speed: ds/dt at the entries, 0 at both ends.
        first: s at the start.
        last: s at the end.
    """

    __slots__ = ("_acceleration", "_place", "_speed", "_step", "duration")

    def __init__(self, step: float, speed: Array, first: float, last: float) -> None:
        place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step)])
        share = (last - first) / place[-1]
        self._place: list[float] = (first + place * share).tolist()
        self._speed: list[float] = (speed * share).tolist()
        self._acceleration: list[float] = (np.gradient(speed, step) * share).tolist()
        self._step = step
        self.duration = step * (len(speed) - 1)

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; beyond the end it keeps its last values."""
        index = int(time / self._step)
        if index >= len(self._place) - 1:
            return self._place[-1], 0.0, 0.0
        k = time / self._step - index
        v, w = self._speed[index], self._speed[index + 1]
        a, b = self._acceleration[index], self._acceleration[index + 1]
        place = self._place[index] + self._step * k * (v + 0.5 * k * (w - v))
        return place, v + k * (w - v), a + k * (b - a)


class Relay:
    """Profiles one after the other; each begins where the one before it came to rest."""

    __slots__ = ("_begins", "_profiles", "duration")

    def __init__(self, profiles: list[Timetable]) -> None:
        self._profiles = profiles
        self._begins = np.concatenate([[0.0], np.cumsum([p.duration for p in profiles])]).tolist()
        self.duration: float = self._begins[-1]

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]."""
        for begin, end, profile in zip(self._begins, self._begins[1:], self._profiles, strict=False):
            if time < end:
                return profile.at(time - begin)
        return self._profiles[-1].at(self._profiles[-1].duration)

    def rest(self, time: float) -> float:
        """When it rests for the next time [s]."""
        return next((end for end in self._begins[1:] if time < end), self.duration)


def paced(course: Course) -> Timetable:
    """The timetable that goes along a course from rest to rest.

    Raises:
        CommandRejected: an axis would have to move infinitely fast.
    """
    first, second, third = (np.abs(x) + _TINY for x in (course.first, course.second, course.third))
    fastest = np.minimum(course.pace, (course.velocity / first).min(axis=1))
    fastest = np.minimum(fastest, np.sqrt((_CURVE * course.acceleration / second).min(axis=1)))
    fastest = np.minimum(fastest, np.cbrt((_TWIST * course.jerk / third).min(axis=1)))
    jumps = np.flatnonzero(np.diff(course.s) <= 0.0)  # the two samples where pieces meet
    jump = np.abs(course.second[jumps + 1] - course.second[jumps]) + _TINY
    bend = np.sqrt((_JUMP * course.acceleration[jumps] / jump).min(axis=1))
    fastest[jumps], fastest[jumps + 1] = np.minimum(fastest[jumps], bend), np.minimum(fastest[jumps + 1], bend)
    if not (np.isfinite(fastest).all() and fastest.min() > 0.0):
        raise CommandRejected("the path cannot be gone along at any speed")
    window = _window(course)
    hold = (course.acceleration / first).min(axis=1) * window**2 / 24  # what the average falls behind by
    grip = np.full(len(course.s), _GRIP)
    best: tuple[float, float, Array] | None = None
    for _ in range(_ROUNDS):
        step, speed = _timed(course, _widened(course.s, fastest, fastest * window / 2 + hold), grip, window)
        speeds, accelerations, jerks = _excess(course, step, speed)
        # as a whole it may be too fast by this
        k = max(1.0, float(speeds.max()), sqrt(float(accelerations.max())), float(np.cbrt(jerks.max())))
        duration = k * step * (len(speed) - 1)
        if best is None or duration < best[0]:
            best = duration, k, speed
        if k <= _TOLERANCE or duration / k >= best[0]:
            break
        hard = _spread(course.s, accelerations, fastest * window)
        slower = np.maximum(_spread(course.s, speeds, fastest * window), np.sqrt(hard))
        slower = np.maximum(slower, np.cbrt(_spread(course.s, jerks, fastest * window)))
        fastest = fastest / np.sqrt(np.maximum(1.0, slower))
        grip = grip / np.sqrt(np.maximum(1.0, hard))
    assert best is not None
    duration, k, speed = best
    return Timetable(duration / (len(speed) - 1), speed / k, float(course.s[0]), float(course.s[-1]))


def _window(course: Course) -> float:
    """Length of the moving average [s]: the largest acceleration comes and goes within the jerk."""
    with np.errstate(invalid="ignore"):
        times = course.acceleration / course.jerk
    return float(times[np.isfinite(times)].max(initial=_STEP))


def _widened(s: Array, fastest: Array, reaches: Array) -> Array:
    """Every speed also holds within its reach to both sides."""
    result = fastest.copy()
    for index in np.argsort(-fastest).tolist():  # the narrowest place has the last word
        low, high = np.searchsorted(s, (s[index] - reaches[index], s[index] + reaches[index]))
        result[low:high] = np.minimum(result[low:high], fastest[index])
    return result


def _spread(s: Array, excess: Array, reach: Array) -> Array:
    """The largest excess within a reach to both sides."""
    result = excess.copy()
    for index in np.flatnonzero(excess > 1.0).tolist():
        low, high = np.searchsorted(s, (s[index] - reach[index], s[index] + reach[index]))
        result[low:high] = np.maximum(result[low:high], excess[index])
    return result


def _timed(course: Course, fastest: Array, grip: Array, window: float) -> tuple[float, Array]:
    """Time step and ds/dt over time, from rest to rest."""
    s = course.s
    square = fastest**2
    square[0] = square[-1] = 0.0
    gaps = (2.0 * np.diff(s)).tolist()
    first, second = np.abs(course.first) + _TINY, np.abs(course.second)
    bound = course.acceleration * grip[:, None]
    counts = np.isfinite(course.acceleration).any(axis=0)
    bound, first, second = bound[:, counts], first[:, counts], second[:, counts]
    free, taken = bound / first, second / first

    def grips(index: int, x: float) -> float:
        return float((free[index] - taken[index] * x).min())

    x = square.tolist()
    least = (0.05 * free.min(axis=1)).tolist()
    for k in range(len(x) - 1):
        more = max(least[k], min(grips(k, x[k]), grips(k + 1, x[k])))
        x[k + 1] = min(x[k + 1], x[k] + gaps[k] * more)
    for k in range(len(x) - 1, 0, -1):
        more = max(least[k], min(grips(k, x[k]), grips(k - 1, x[k])))
        x[k - 1] = min(x[k - 1], x[k] + gaps[k - 1] * more)
    speed = np.sqrt(np.array(x))
    times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(s) / (speed[1:] + speed[:-1]))])
    step = max(_STEP, float(times[-1]) / _MOST)
    count = max(1, round(window / step))
    grid = np.arange(0.0, times[-1] + step, step)
    padded = np.concatenate([np.zeros(count), np.interp(grid, times, speed, right=0.0), np.zeros(count)])
    total = np.concatenate([[0.0], np.cumsum(padded)])
    return step, (total[count:] - total[:-count]) / count


def _excess(course: Course, step: float, speed: Array) -> tuple[Array, Array, Array]:
    """By what factor speed, acceleration and jerk are too large, at the samples of the course."""
    place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
    place = course.s[0] + place * ((course.s[-1] - course.s[0]) / place[-1])
    v, acceleration = speed[:, None], np.gradient(speed, step)
    a, j = acceleration[:, None], np.gradient(acceleration, step)[:, None]
    first, second, third = (
        np.column_stack([np.interp(place, course.s, column) for column in x.T])
        for x in (course.first, course.second, course.third)
    )
    at = np.clip(np.searchsorted(course.s, place), 0, len(course.s) - 1)
    fast = np.maximum((np.abs(first) * v / course.velocity[at]).max(axis=1), speed / course.pace[at])
    hard = np.abs(first * a + second * v**2) / course.acceleration[at]
    sudden = np.abs(first * j + 3 * second * v * a + third * v**3) / course.jerk[at]
    result = np.zeros((3, len(course.s)))
    for row, seen in zip(result, (fast, hard.max(axis=1), sudden.max(axis=1)), strict=True):
        np.maximum.at(row, at, seen)
    return result[0], result[1], result[2]
