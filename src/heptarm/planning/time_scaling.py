"""Time-optimal path parameterisation under limits that vary along the path.

Every motion that follows a path is timed here, section by section from rest to rest. Where the limits of s are the
same along the whole section and the joints can follow, one jerk-limited profile is optimal. Elsewhere the maximum
velocity curve is integrated forwards and backwards (Bobrow 1985), then smoothed until the jerk limits hold.
"""

from __future__ import annotations

import ctypes
import functools
from bisect import bisect_right
from dataclasses import dataclass, replace
from itertools import pairwise
from math import sqrt

import numpy as np

from heptarm._library import library
from heptarm.errors import CommandRejected
from heptarm.planning.jerk_profile import (
    JerkProfile,
    ProfileLimits,
    ScaledProfile,
    TimeLaw,
    brake,
    change,
)
from heptarm.values.checks import Array

#: Fraction of an axis' acceleration that the path's curvature may use, and the path's third derivative of the jerk.
_CURVE, _TWIST = 0.9, 0.9
#: Fraction of it that may appear at once, where a line meets an arc.
_JUMP = 0.1
#: Fraction of an axis' acceleration that the integration may use.
_GRIP = 0.97
#: Time between two samples of a tabulated profile [s], unless the section takes very long.
_STEP = 1e-3
_MOST_SAMPLES = 100_000
#: Most samples of the moving average; where the jerk needs more, the whole profile becomes slower instead.
_MOST_AVERAGED = 10_000
_ROUNDS = 8
_TOLERANCE = 1.01
_TINY = 1e-12
_ROUNDING = 1e-6
#: At least this fraction of the jerk brakes; the rest may be used up by the curvature.
_BRAKE = 0.6
#: At least this fraction of an axis' acceleration brakes, in a curve that leaves less.
_LEAST = 0.3
#: Limits of s that vary by less than this factor along a section count as constant.
_EVEN = 0.9
#: Samples of each phase of a profile when it is checked.
_CHECKS = 60
#: Shortest time between two of them, as a fraction of the duration.
_APART = 1e-9
_AXES = 7
#: At least this fraction of what is free for acceleration accelerates, where the curvature leaves less.
SPARE = 0.05
#: A motion slower than this fraction of its full speed stops at once.
_BARELY = 1e-3
#: A motion that brakes already gets this much more jerk than it needs to end that.
_SOONER = 1.05
_POINTER, _WORD, _REAL = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double


class _Limits(ctypes.Structure):
    """`struct limits` of native/path_timing.c."""

    _fields_ = (
        *((name, _POINTER) for name in ("s", "steepest", "first", "second", "third", "fastest")),
        *((name, _POINTER) for name in ("velocity", "acceleration", "jerk")),
        *(("count", _WORD), ("axes", _WORD)),
    )


@functools.cache
def _functions() -> ctypes.CDLL:
    """The functions of native/path_timing.c.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """
    made = library()
    made.hp_least_around.restype = made.hp_reachable.restype = made.hp_excess.restype = None
    made.hp_least_around.argtypes = (_WORD, *[_POINTER] * 4)
    made.hp_reachable.argtypes = (_WORD, _WORD, *[_POINTER] * 3, _REAL, _POINTER)
    made.hp_excess.argtypes = (_POINTER, _WORD, *[_POINTER] * 5)
    return made


@dataclass(frozen=True, slots=True)
class PathConstraints:
    """What bounds ds/dt and its derivatives along a path, at n samples of its parameter s.

    Attributes:
        s: shape (n,), ascending.
        first: dq/ds, shape (n, m): seven axes, then coordinates of the tool frame that have limits as an axis has.
        second: d²q/ds², likewise.
        third: d³q/ds³, likewise.
        fastest: largest ds/dt that the program allows, shape (n,).
        velocity: largest velocities of the coordinates, shape (n, m).
        acceleration: likewise.
        jerk: likewise.
        braking: accelerations of the coordinates for a stop on the path, shape (m,); infinite: no limit.
        braking_jerk: likewise.
    """

    s: Array
    first: Array
    second: Array
    third: Array
    fastest: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    braking: Array
    braking_jerk: Array

    @property
    def steepest(self) -> Array:
        """Bounds of |dq/ds| around the samples, shape (n, m): between two of them it may lie beyond their chord."""
        before, after = np.diff(self.s, prepend=self.s[0]), np.diff(self.s, append=self.s[-1])
        return np.abs(self.first) + np.abs(self.third) * (np.maximum(before, after) ** 2 / 8)[:, None]

    def slower(self, factors: Array) -> PathConstraints:
        """The same path, passed more slowly by factors at the samples, shape (n,)."""
        by = factors[:, None]
        return replace(
            self,
            fastest=self.fastest / factors,
            velocity=self.velocity / by,
            acceleration=self.acceleration / by**2,
            jerk=self.jerk / by**3,
        )

    def stop_limits(self, s: float, speed: float) -> ProfileLimits:
        """Limits of s for coming to rest from a place and a speed ds/dt."""
        low = max(0, int(np.searchsorted(self.s, s, side="right")) - 1)
        ahead = np.maximum(self.s[low:] - s, 0.0)
        first, second = np.abs(self.first[low:]) + _TINY, np.abs(self.second[low:])
        most = float((self.braking / first[0]).min())
        used = (3 * second * (speed * most) + np.abs(self.third[low:]) * speed**3) / self.braking_jerk
        jerks = (np.maximum(1.0 - used, _BRAKE) * self.braking_jerk / first).min(axis=1)
        jerk = float(jerks[0])
        for _ in range(4):  # the speed that is left at a place depends on how hard it brakes before
            late = speed * most / jerk / 2
            square = np.maximum(speed * speed - 2 * most * np.maximum(ahead - late, 0.0), 0.0)
            here = max(1, int(np.searchsorted(-square, 0.0)))
            room = np.maximum(self.braking - second[:here] * square[:here, None], _LEAST * self.braking)
            most, jerk = float((room / first[:here]).min()), float(jerks[:here].min())
        return ProfileLimits(2 * speed + _TINY, most, jerk)


class TabulatedProfile:
    """s over time at even samples; has the interface of `TimeLaw`.

    Args:
        step: time between two samples [s].
        speed: ds/dt at the samples, 0 at both ends.
        first: s at the start.
        last: s at the end.
    """

    __slots__ = ("_acceleration", "_place", "_speed", "_step", "duration")

    def __init__(self, step: float, speed: Array, first: float, last: float) -> None:
        place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step)])
        scale = (last - first) / place[-1]
        self._place: list[float] = (first + place * scale).tolist()
        self._speed: list[float] = (speed * scale).tolist()
        self._acceleration: list[float] = (np.gradient(speed, step) * scale).tolist()
        self._step = step
        self.duration = step * (len(speed) - 1)

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]; constant after the end."""
        index = int(time / self._step)
        if index >= len(self._place) - 1:
            return self._place[-1], 0.0, 0.0
        k = time / self._step - index
        v, w = self._speed[index], self._speed[index + 1]
        a, b = self._acceleration[index], self._acceleration[index + 1]
        place = self._place[index] + self._step * k * (v + 0.5 * k * (w - v))
        return place, v + k * (w - v), a + k * (b - a)

    @property
    def pieces(self) -> Array:
        """See `TimeLaw`."""
        count = len(self._place) - 1
        pieces = np.zeros((count, 5))
        pieces[:, 0], pieces[:, 1] = np.arange(count) * self._step, self._place[:-1]
        pieces[:, 2], pieces[:, 3] = self._speed[:-1], np.diff(self._speed) / (2 * self._step)
        return pieces


class ProfileSequence:
    """Profiles one after the other; each begins where the one before it came to rest."""

    __slots__ = ("_begins", "_profiles", "duration")

    def __init__(self, profiles: list[TimeLaw]) -> None:
        self._profiles = profiles
        self._begins = np.concatenate([[0.0], np.cumsum([p.duration for p in profiles])]).tolist()
        self.duration: float = self._begins[-1]

    def at(self, time: float) -> tuple[float, float, float]:
        """s, ds/dt, d²s/dt² at a time [s]."""
        for begin, end, profile in zip(self._begins, self._begins[1:], self._profiles, strict=False):
            if time < end:
                return profile.at(time - begin)
        return self._profiles[-1].at(self._profiles[-1].duration)

    @property
    def pieces(self) -> Array | None:
        """See `TimeLaw`."""
        found = []
        for begin, profile in zip(self._begins, self._profiles, strict=False):
            pieces = profile.pieces
            if pieces is None:
                return None
            found.append(pieces + (begin, 0.0, 0.0, 0.0, 0.0))
        return np.concatenate(found)

    def next_rest(self, time: float) -> float:
        """Time of the first rest after a time [s]."""
        return next((end for end in self._begins[1:] if time < end), self.duration)


class PathTiming:
    """How a path is followed in time, and how it is left on a stop.

    Args:
        rests: values of s at which the arm rests, ascending; the last is 1.
        sections: what bounds the motion from one rest to the next.

    Attributes:
        profile: s over time at full speed.

    Raises:
        CommandRejected: an axis would have to move infinitely fast.
    """

    def __init__(self, rests: tuple[float, ...], sections: tuple[PathConstraints, ...]) -> None:
        self._rests, self._sections = rests, sections
        self.profile = ProfileSequence([time_optimal(section) for section in sections])

    def stop(self, time: float, scale: float, rate: float) -> TimeLaw:
        """Come to rest on the path.

        Args:
            time: of the profile [s].
            scale: speed as a fraction of the profile's.
            rate: change of that fraction [1/s].
        """
        s, speed, acceleration = self.profile.at(time)
        state = (s, speed * scale, acceleration * scale * scale + speed * rate)
        limits = self.stop_limits(s, state[1])
        if state[1] > 0.0 > state[2]:  # it brakes already: end that early enough not to turn round
            limits = replace(limits, jerk=max(limits.jerk, _SOONER * state[2] ** 2 / (2 * state[1])))
        stop = brake(state, limits)
        if stop.at(stop.duration)[0] <= self._rests[self._section(s)] or scale < _BARELY:
            return stop
        return ScaledProfile(self.profile, time, self.profile.next_rest(time), scale)  # that rests sooner

    def stop_limits(self, s: float, speed: float) -> ProfileLimits:
        """Limits of s for coming to rest from a place and a speed ds/dt."""
        return self._sections[self._section(s)].stop_limits(s, speed)

    def _section(self, s: float) -> int:
        return min(bisect_right(self._rests, s), len(self._sections) - 1)


def time_optimal(path: PathConstraints) -> TimeLaw:
    """The fastest profile that follows a path from rest to rest within all limits.

    Raises:
        CommandRejected: an axis would have to move infinitely fast.
    """
    second, third = (np.abs(x) + _TINY for x in (path.second, path.third))
    first = path.steepest + _TINY
    fastest = np.minimum(path.fastest, (path.velocity / first).min(axis=1))
    simple, excess = _simple_profile(path, fastest, first)
    if simple is not None and excess <= _TOLERANCE:
        return simple
    searched = _Search(path, fastest, first, second, third).profile()
    return searched if simple is None or searched.duration < simple.duration else simple


def _simple_profile(path: PathConstraints, fastest: Array, first: Array) -> tuple[JerkProfile | None, float]:
    """One jerk-limited profile for the whole path, and the factor by which the axes made it slower.

    There is none (None) where the limits of s vary along the path.
    """
    bounds = (fastest, (path.acceleration / first).min(axis=1), (path.jerk / first).min(axis=1))
    if (np.diff(path.s) <= 0.0).any() or any(x.min() < _EVEN * x.max() or x.min() <= 0.0 for x in bounds):
        return None, 1.0
    limits = ProfileLimits(*(float(x.min()) for x in bounds))
    begin, end = float(path.s[0]), float(path.s[-1])
    profile = change((begin, 0.0, 0.0), end, limits)
    excess = _axis_excess(path, profile, limits)
    if excess > 1.0 + _ROUNDING:
        profile = change((begin, 0.0, 0.0), end, limits.slower(excess))
    return profile, excess


def _axis_excess(path: PathConstraints, profile: JerkProfile, limits: ProfileLimits) -> float:
    """Factor by which a profile from rest to rest would have to be slower for the seven axes."""
    top = profile.at(profile.duration / 2)[1]
    ramp = 2 * sqrt(top / limits.jerk)
    if top * limits.jerk > limits.acceleration**2:
        ramp = top / limits.acceleration + limits.acceleration / limits.jerk
    ramp = min(ramp, profile.duration / 2)
    edges = (0.0, ramp, profile.duration - ramp, profile.duration)
    times = np.unique(np.concatenate([np.linspace(a, b, _CHECKS) for a, b in pairwise(edges)]))
    # without a constant phase two of them differ by rounding only, and the difference quotient below would be noise
    times = times[np.concatenate([[True], np.diff(times) > _APART * profile.duration])]
    s, speed, acceleration = np.array([profile.at(time) for time in times.tolist()]).T
    v, a = speed[:, None], acceleration[:, None]
    j = np.gradient(acceleration, times)[:, None]
    steepest, first, second, third = (
        np.column_stack([np.interp(s, path.s, column) for column in x.T[:_AXES]])
        for x in (path.steepest, path.first, path.second, path.third)
    )
    velocity, most, jerk = (x[0, :_AXES] for x in (path.velocity, path.acceleration, path.jerk))
    return max(
        float((steepest * v / velocity).max()),
        sqrt(float((np.abs(first * a + second * v**2) / most).max())),
        float(np.cbrt((np.abs(first * j + 3 * second * v * a + third * v**3) / jerk).max())),
    )


class _Search:
    """Searches the fastest profile where the limits vary.

    Args:
        path: the limits.
        fastest: largest ds/dt at the samples by program and axes' velocities, shape (n,).
        first: magnitudes of the derivatives, shape (n, m).
        second: likewise.
        third: likewise.
    """

    def __init__(
        self, path: PathConstraints, fastest: Array, first: Array, second: Array, third: Array
    ) -> None:
        self._path = path
        fastest = np.minimum(fastest, np.sqrt((_CURVE * path.acceleration / second).min(axis=1)))
        fastest = np.minimum(fastest, np.cbrt((_TWIST * path.jerk / third).min(axis=1)))
        joints = np.flatnonzero(np.diff(path.s) <= 0.0)  # the two samples where segments meet
        jump = np.abs(path.second[joints + 1] - path.second[joints]) + _TINY
        bend = np.sqrt((_JUMP * path.acceleration[joints] / jump).min(axis=1))
        fastest[joints] = np.minimum(fastest[joints], bend)
        fastest[joints + 1] = np.minimum(fastest[joints + 1], bend)
        if not (np.isfinite(fastest).all() and fastest.min() > 0.0):
            raise CommandRejected("the path cannot be followed at any speed")
        self._fastest = fastest
        with np.errstate(invalid="ignore"):
            times = path.acceleration / path.jerk
        # length of the moving average [s]: the largest acceleration comes and goes within the jerk
        self._window = float(times[np.isfinite(times)].max(initial=_STEP))
        # what the average falls behind by
        self._behind = (path.acceleration / first).min(axis=1) * self._window**2 / 24
        limited = np.isfinite(path.acceleration).any(axis=0)
        self._free = np.ascontiguousarray((path.acceleration / first)[:, limited])
        self._taken = np.ascontiguousarray((np.abs(path.second) / first)[:, limited])
        self._excess = Excess(path)

    def profile(self) -> TabulatedProfile:
        """The best profile found."""
        path, window, fastest = self._path, self._window, self._fastest
        grip = np.full(len(path.s), _GRIP)
        best: tuple[float, float, Array] | None = None
        for _ in range(_ROUNDS):
            reach = fastest * window / 2 + self._behind
            step, speed = self._integrate(least_around(path.s, fastest, reach), grip)
            speeds, accelerations, jerks = self._excess.of(step, speed)
            # as a whole it may be too fast by this
            k = max(1.0, float(speeds.max()), sqrt(float(accelerations.max())), float(np.cbrt(jerks.max())))
            duration = k * step * (len(speed) - 1)
            if best is None or duration < best[0]:
                best = duration, k, speed
            if k <= _TOLERANCE or duration / k >= best[0]:
                break
            around = fastest * window
            hard = -least_around(path.s, -accelerations, around)
            slower = np.maximum(-least_around(path.s, -speeds, around), np.sqrt(hard))
            slower = np.maximum(slower, np.cbrt(-least_around(path.s, -jerks, around)))
            fastest = fastest / np.sqrt(np.maximum(1.0, slower))
            grip = grip / np.sqrt(np.maximum(1.0, hard))
        assert best is not None
        duration, k, speed = best
        return TabulatedProfile(duration / (len(speed) - 1), speed / k, float(path.s[0]), float(path.s[-1]))

    def _integrate(self, fastest: Array, grip: Array) -> tuple[float, Array]:
        """Time step and ds/dt over time, from rest to rest."""
        s, window = self._path.s, self._window
        square = fastest**2
        square[0] = square[-1] = 0.0
        speed = np.sqrt(reachable(s, self._free * grip[:, None], self._taken, square))
        times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(s) / (speed[1:] + speed[:-1]))])
        step = max(_STEP, float(times[-1]) / _MOST_SAMPLES)
        count = min(max(1, round(window / step)), _MOST_AVERAGED)
        grid = np.arange(0.0, times[-1] + step, step)
        padded = np.concatenate([np.zeros(count), np.interp(grid, times, speed, right=0.0), np.zeros(count)])
        total = np.concatenate([[0.0], np.cumsum(padded)])
        return step, (total[count:] - total[:-count]) / count


def reachable(s: Array, free: Array, taken: Array, square: Array) -> Array:
    """Squares of speed that accelerations allow, forwards and backwards (Bobrow 1985), shape (n,).

    Args:
        s: path parameter at samples, ascending, shape (n,).
        free: largest acceleration of s by each coordinate at speed 0, shape (n, m).
        taken: by how much that falls with the square of speed, shape (n, m).
        square: largest squares of speed, shape (n,).
    """
    given, result = [np.ascontiguousarray(array) for array in (s, free, taken)], square.copy()
    addresses = [array.ctypes.data for array in given]
    _functions().hp_reachable(*free.shape, *addresses, SPARE, result.ctypes.data)
    return result


class Excess:
    """Factors by which motions along a path exceed its limits."""

    def __init__(self, path: PathConstraints) -> None:
        limited = np.isfinite([path.velocity, path.acceleration, path.jerk]).any(axis=(0, 1))
        columns = (path.steepest, path.first, path.second, path.third)
        limits = (path.velocity, path.acceleration, path.jerk)
        self._s, self._arrays = (
            path.s,
            [
                *(np.ascontiguousarray(path.s), *(column[:, limited].copy() for column in columns)),
                *(np.ascontiguousarray(path.fastest), *(limit[:, limited].copy() for limit in limits)),
            ],
        )
        addresses = [array.ctypes.data for array in self._arrays]
        self._memory = _Limits(*addresses, len(path.s), int(limited.sum()))

    def of(self, step: float, speed: Array) -> Array:
        """Of velocity, acceleration and jerk at the samples of the path, shape (3, n).

        Args:
            step: time between two samples of the speed [s].
            speed: ds/dt over time.
        """
        place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
        place = self._s[0] + place * ((self._s[-1] - self._s[0]) / place[-1])
        acceleration = np.gradient(speed, step)
        jerk, result = np.gradient(acceleration, step), np.zeros((3, len(self._s)))
        given = [array.ctypes.data for array in (place, speed, acceleration, jerk, result)]
        _functions().hp_excess(ctypes.byref(self._memory), len(place), *given)
        return result


def least_around(s: Array, values: Array, reaches: Array) -> Array:
    """The least of values within a reach to both sides of each sample of s; all of shape (n,)."""
    given, result = [np.ascontiguousarray(array) for array in (s, values, reaches)], np.empty_like(values)
    addresses = [array.ctypes.data for array in (*given, result)]
    _functions().hp_least_around(len(s), *addresses)
    return result
