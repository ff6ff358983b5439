"""How fast a trajectory of the tool frame may be followed, so that every axis stays within its limits.

A trajectory over its own time is sampled ahead. The largest rate of that time, 1 at most, is found by reachability
analysis (Pham and Pham, "A new approach to time-optimal path parameterization based on reachability analysis", 2018):
it brakes on the path before an axis would be too fast, accelerate too hard or leave its range, and before its end.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from math import tau
from operator import le

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.velocity import NEAREST
from heptarm.planning.motion import TICK
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: How far ahead a trajectory is looked at, in its own time, and the time between two samples where it is straight [s];
#: and the part of what was seen after which it is looked at again.
HORIZON, _APART, _LOOK = 0.35, 0.07, 0.3
#: Most samples: where more are needed, an axis is so slow that it needs to look less far ahead.
_MOST = 80
#: The same at the start, where the arm moves already.
_FIRST = 1e-3
#: Samples are so dense that the joints between two are near to the line between them: squares of twice the distance
#: [rad²], and of its ratio to the step, which does not count below a smallest distance ...
_BENT, _SLANT, _STILL = 1e-3**2, 0.05**2, 3e-6**2
#: ... unless they would be nearer than this [s]: there the joints jump.
_LEAST = 1e-6
#: Fractions of an axis' speed and acceleration that are planned with; the rest is for what is between two samples.
_SPEED, _GRIP = 0.985, 0.9
#: The square of the rate at the start may exceed what the samples allow by this factor, and be so large at rest, where
#: each axis can stop within a tick.
_ROUNDING, _AT_REST = 1.02, 1e-6
#: Ticks of a slowed trajectory that are checked before it is followed: until the next target, usually.
_CHECKED = 12
_TINY = 1e-12
#: How often a step in time is corrected for the axes at most, and the largest part of a correction that is left to do.
_CORRECTIONS, _LEFT = 8, 0.8
#: Margin of the fraction of a step, for the noise of the inverse kinematics.
_EXACT = 1e-4


class RateProfile:
    """How the time of a trajectory passes: the square of its rate is linear over it between samples.

    Args:
        times: samples of the trajectory's time, ascending [s].
        squares: of the rate there.
        q: joint positions there, shape (n, 7) [rad].
        slopes: their derivatives by the trajectory's time, likewise.
        is_whole: it ends where the trajectory does, or where an axis could not go on.

    Attributes:
        is_whole: likewise.
        duration: until the end [s].
        next_look: when the trajectory is to be looked at again, before the arm brakes at the end of this [s].
    """

    __slots__ = ("_clock", "_q", "_rates", "_slopes", "_times", "duration", "is_whole", "next_look")

    def __init__(
        self, times: list[float], squares: list[float], *, q: Array, slopes: Array, is_whole: bool
    ) -> None:
        self._q, self._slopes = q, slopes
        rates = np.sqrt(squares)
        steps = 2.0 * np.diff(times) / np.maximum(rates[1:] + rates[:-1], _TINY)
        self._times, self._rates = times, rates.tolist()
        self._clock: list[float] = [0.0, *np.cumsum(steps).tolist()]
        self.duration = self._clock[-1]
        self.is_whole = is_whole
        first, last = times[0], times[-1]
        self.next_look = float(np.interp(first + _LOOK * (last - first), times, self._clock))

    def at(self, elapsed: float) -> tuple[float, float]:
        """Time of the trajectory and its rate when so much time has passed [s]."""
        clock, times, rates = self._clock, self._times, self._rates
        k = min(bisect_right(clock, elapsed), len(clock) - 1)
        begin, end = rates[k - 1], rates[k]
        later = elapsed - clock[k - 1]
        if elapsed >= clock[k]:  # behind the end: at rest, or on with the rate there
            return times[k] + end * (elapsed - clock[k]), end
        change = (end - begin) / (clock[k] - clock[k - 1])
        return times[k - 1] + (begin + 0.5 * change * later) * later, begin + change * later

    @property
    def first_ticks(self) -> list[float]:
        """Moments at which set-points show whether the axes can get on to it [s]: more where it is slowed."""
        slowed = any(abs(self.at(moment)[1] - 1.0) > _TINY for moment in (TICK, _CHECKED * TICK))
        return [TICK * (1 + k) for k in range(_CHECKED if slowed else 2)]

    def near(self, time: float) -> Array:
        """Joint positions near to those at a time of the trajectory [s], as it was sampled, shape (7,) [rad]."""
        times = self._times
        k = min(max(1, bisect_right(times, time)), len(times) - 1)
        gap = times[k] - times[k - 1]
        s = min(1.0, (time - times[k - 1]) / gap)
        # Hermite's cubic
        begin, end = self._q[k - 1], self._q[k]
        step, u = end - begin, 1.0 - s
        bent = u * (gap * self._slopes[k - 1] - step) - s * (gap * self._slopes[k] - step)
        place: Array = begin + s * step + (s * u) * bent
        return place

    def change(self, elapsed: float) -> float:
        """Change of the rate over the ticks beside a moment [1/s]."""
        before, after = max(0.0, elapsed - TICK), elapsed + TICK
        return (self.at(after)[1] - self.at(before)[1]) / (after - before)


@dataclass(frozen=True, slots=True)
class _Samples:
    times: list[float]
    q: list[Array]
    is_open: bool  # the trajectory goes on
    is_blocked: bool  # an axis could not go on


class AxisLimits:
    """Finds rate profiles of one robot.

    Args:
        robot: its limits hold.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._velocity, self._acceleration = _SPEED * robot.dq_max, _GRIP * robot.ddq_max
        self._fastest, self._hardest = robot.dq_max, robot.ddq_max
        self._low, self._high = robot.q_min + NEAREST, robot.q_max - NEAREST

    def joins(self, speed: Array, *q: Array) -> bool:
        """Whether the axes can go on to set-points, tick by tick.

        Args:
            speed: of the axes now, shape (7,) [rad/s].
            q: set-points, the first one now, shape (7,) [rad].
        """
        speeds = np.diff(np.array(q), axis=0) / TICK
        changes = np.diff(np.vstack([speed, speeds]), axis=0) / TICK
        return bool((np.abs(changes) <= self._hardest).all() and (np.abs(speeds) <= self._fastest).all())

    def followable(
        self, at: Callable[[float], Array], here: Array, before: Array, dt: float
    ) -> tuple[float, Array]:
        """The step of time nearest to another one with which no axis changes its speed too much, and its set-point.

        A profile was found from samples: between two of them an axis may need a few per cent more.

        Args:
            at: the set-point after a step of time [s], shape (7,) [rad].
            here: the set-point now, likewise.
            before: the step of the set-points that led here, likewise.
            dt: the step of time that is asked for [s].
        """
        step, there, last = dt, at(dt), 1.0
        for _ in range(_CORRECTIONS if dt > 0.0 else 0):
            fraction = self.fraction(before, there - here)
            if fraction == 1.0:
                break
            # the speed changes with the step, so that a correction leaves a part of itself, and the next ones of that
            left = (fraction - 1.0) / (last - 1.0) if last != 1.0 else 0.0
            last = fraction
            step *= 1.0 + (fraction - 1.0) / (1.0 - min(max(0.0, left), _LEFT))
            there = at(step)
        return step, there

    def fraction(self, before: Array, step: Array) -> float:
        """The fraction of a set-point's step nearest to 1 with which no axis changes its speed too much.

        Where the axes disagree, it stays as near to 1 as one of them allows.

        Args:
            before: the last step, shape (7,) [rad].
            step: the next one, likewise.
        """
        most = (1.0 - _EXACT) * self._hardest * TICK * TICK
        if (np.abs(step - before) <= most).all():
            return 1.0
        moves = np.abs(step) > _TINY
        if not moves.any():  # at the end of the profile: no fraction of it is another step
            return 1.0
        size, sign = np.abs(step[moves]), np.sign(step[moves])
        middle, reach = before[moves] * sign / size, most[moves] / size
        low, high = float((middle - reach).max()), float((middle + reach).min())
        return max(0.0, min(max(1.0, min(low, high)), max(low, high)))

    def profile(
        self,
        joints: Callable[[float, Array], Array],
        here: Array,
        *,
        start: float,
        end: float,
        rate: float,
        horizon: float = HORIZON,
    ) -> RateProfile | None:
        """The fastest profile from a time of a trajectory on.

        Args:
            joints: joint positions at a time [s], next to others, shape (7,) [rad]; Unreachable: there are none.
            here: joint positions at the start, shape (7,) [rad].
            start: time of the trajectory [s].
            end: of the trajectory, which rests there [s].
            rate: at the start.
            horizon: the arm is at rest at the latest so far ahead [s].

        Returns:
            None: from that rate no axis could brake in time.
        """
        samples = self._samples(joints, here, start, min(end, start + horizon), end)
        if len(samples.times) < 3:
            return None
        times, q = np.array(samples.times), np.array(samples.q)
        gaps = np.diff(times)
        if not (gaps > 0.0).all():  # a trajectory without any duration
            return None
        slopes = np.diff(q, axis=0) / gaps[:, None]
        first = np.empty_like(q)
        second = np.empty_like(q)
        before, after = gaps[:-1, None], gaps[1:, None]
        first[1:-1] = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
        second[1:-1] = 2.0 * (slopes[1:] - slopes[:-1]) / (before + after)
        second[0], second[-1] = second[1], second[-2]
        first[0] = slopes[0] - 0.5 * gaps[0] * second[0]
        first[-1] = slopes[-1] + 0.5 * gaps[-1] * second[-1]
        rests = samples.is_open or samples.is_blocked
        squares = self._greatest(first, second, gaps, rate * rate, 0.0 if rests else 1.0)
        return (
            None
            if squares is None
            else RateProfile(samples.times, squares, q=q, slopes=first, is_whole=not samples.is_open)
        )

    def _greatest(
        self, first: Array, second: Array, gaps: Array, begin: float, end: float
    ) -> list[float] | None:
        """Squares of the rate at the samples; None: there is no profile from the first one.

        With z the square and u half its slope, an axis needs first u + second z of its acceleration.
        """
        sign = np.where(first < 0.0, -1.0, 1.0)
        along, bend = np.abs(first) + _TINY, second * sign
        free, taken = self._acceleration / along, bend / along
        # some u has to be left between those that two axes need: -free_i - taken_i z <= u <= free_j - taken_j z
        crossing = taken[:, None, :] - taken[:, :, None]
        with np.errstate(divide="ignore"):
            bound = np.where(
                crossing > _TINY, (free[:, None, :] + free[:, :, None]) / np.maximum(crossing, _TINY), np.inf
            ).min(axis=(1, 2))
        bound = np.minimum(bound, ((self._velocity / along).min(axis=1)) ** 2)
        most = np.minimum(bound, 1.0).tolist()
        rows, turns = free.tolist(), taken.tolist()
        steps = (2.0 * gaps).tolist()
        # backwards: from which squares the end can be reached
        most[-1] = min(most[-1], end)
        for k in range(len(steps) - 1, -1, -1):
            step, last = steps[k], most[k + 1]
            inverse, then = 1.0 / step, last / step
            most[k] = min(
                most[k],
                last + step * min(a + b * last for a, b in zip(rows[k + 1], turns[k + 1], strict=True)),
            )
            for a, b in zip(rows[k], turns[k], strict=True):
                if inverse > b:
                    most[k] = min(most[k], (then + a) / (inverse - b))
                elif b > inverse:
                    most[k] = min(most[k], a / (b - inverse))
        if begin > most[0] * _ROUNDING:
            return None
        # forwards: as fast as can be; next to a singularity an axis is fast at a rate of nearly 0
        at_rest = np.minimum(_AT_REST, (self._hardest * TICK / along).min(axis=1) ** 2).tolist()
        squares = [begin]
        for k, step in enumerate(steps):
            z = squares[-1]
            gain = min(a - b * z for a, b in zip(rows[k], turns[k], strict=True))
            loss = max(-a - b * z for a, b in zip(rows[k], turns[k], strict=True))
            for a, b in zip(rows[k + 1], turns[k + 1], strict=True):
                if (scale := 1.0 + b * step) > 0.0:
                    gain, loss = min(gain, (a - b * z) / scale), max(loss, (-a - b * z) / scale)
            then = max(0.0, z + step * loss, min(most[k + 1], z + step * gain))
            if then > most[k + 1] * _ROUNDING + at_rest[k + 1]:
                return None
            squares.append(then)
        return squares

    # ---------------------------------------------------------------------------------- sampling

    def _samples(
        self, joints: Callable[[float, Array], Array], here: Array, start: float, last: float, end: float
    ) -> _Samples:
        """Follow the trajectory as far as the axes can."""
        low, high = np.minimum(self._low, here).tolist(), np.maximum(self._high, here).tolist()

        def at(time: float, near: Array) -> Array | None:
            """Joint positions within the limits; None: there are none."""
            try:
                q = joints(time, near)
            except Unreachable:
                return None
            step = q - near
            if step @ step > 1.0:  # a joint that passes half a turn goes on
                q = q - tau * np.round(step / tau)
            values = q.tolist()
            return q if all(map(le, low, values)) and all(map(le, values, high)) else None

        times, found = [start], [here]
        count = max(1, round((last - start) / _APART))
        # ends of intervals that are not sampled yet, with joint positions that may be known, the nearest one last
        pending: list[tuple[float, Array | None]] = [
            (time, None) for time in np.linspace(last, start, count, endpoint=False).tolist()
        ]
        if last - start > 2.0 * _FIRST:
            pending.append((start + _FIRST, None))
        while pending and len(times) < _MOST:
            a, qa = times[-1], found[-1]
            b, qb = pending[-1]
            middle = 0.5 * (a + b)
            qm = at(middle, qa)
            if qm is not None and qb is None:
                qb = at(b, qm)
                pending[-1] = b, qb
            if qm is not None and qb is not None:
                bent, step = 2.0 * qm - qa - qb, qb - qa
                square = bent @ bent
                if square <= _STILL or (square <= _BENT and square <= _SLANT * (step @ step)):
                    times += [middle, b]
                    found += [qm, qb]
                    pending.pop()
                    continue
            if b - a <= _LEAST:
                return _Samples(times, found, False, True)
            pending.append((middle, qm))
        return _Samples(times, found, times[-1] < end, False)
