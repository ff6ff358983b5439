"""Chunks of actions: joint positions with time stamps become one smooth path, and a thread sends it.

A policy predicts many actions at once, and the next chunk comes while the arm follows the last one. `ActionPath` is
the path: a cubic spline through the actions, plus an offset that begins where the arm is on the last chunk, with its
velocity and acceleration, and vanishes within the limits of the joints. Behind the last action the path brakes.
`ActionStream` is the thread.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.errors import HeptarmError, LimitError, ShapeError
from heptarm.io.clock import Clock
from heptarm.values.checks import Array, Value, finite, finite_entries, numbers, within

#: Fractions of the limits that the actions alone may use, and that they and the offset may use together: the rest is
#: for the cabinet, which follows the targets.
_ACTIONS, _WHOLE = 0.8, 0.95
#: Times in which an offset may vanish: shortest, longest [s], and how many are tried.
_SHORTEST, _LONGEST, _TRIED = 0.04, 8.0, 36
#: Points of time at which a path is compared with the limits.
_LOOKS = 80
#: Weights of the third differences with which actions are smoothed until they are within the limits.
_WEIGHTS = np.geomspace(1e-3, 1e9, 37)
#: Actions of a chunk at most, and the shortest time between two of them [s].
MOST_ACTIONS, _NEAREST = 10_000, 1e-3
#: Limits by the number of the derivative, for errors.
_NAMES = ("", "rad/s", "rad/s²", "rad/s³")
#: Longest wait for the thread at the end [s].
_PATIENCE = 5.0
#: Deviations below this are rounding [rad].
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class TakenChunk(Value):
    """What became of a chunk of actions.

    Attributes:
        begin: time from which on the arm follows it [s].
        late: actions whose time had passed; the arm goes on with those behind them.
        smoothing: by how much an action was moved at most, since the joints cannot follow the chunk as it is [rad].
        blending: time in which the path of the last chunk changes to this one [s].
    """

    begin: float
    late: int
    smoothing: float
    blending: float

    def __str__(self) -> str:
        """In words."""
        moved = f", smoothed by up to {self.smoothing * 1e3:.1f} mrad" if self.smoothing else ""
        return f"followed from {self.begin:.3f} s, {self.late} actions late, blended in {self.blending:.2f} s{moved}"


def action_times(at: npt.ArrayLike, count: int, *, rate: float) -> Array:
    """Times of the actions of a chunk, shape (count,) [s].

    Args:
        at: time of the first one, or of each [s].
        count: how many there are.
        rate: actions per second, if there is one time only [Hz].

    Raises:
        ShapeError: another number of times.
        LimitError: a time that is not finite, or they do not ascend by at least a millisecond.
    """
    times = numbers(at, "at", "a time or times")
    if not times.ndim:
        step = 1.0 / within(rate, "rate", 0.0, 1.0 / _NEAREST, above=True, unit="Hz")
        return np.asarray(finite(float(times), "at", unit="s") + step * np.arange(count, dtype=np.float64))
    finite_entries(times, "at")
    if times.shape != (count,):
        raise ShapeError(
            f"at must be one time or one for each of the {count} actions, got shape {times.shape}",
            parameter="at",
        )
    if count > 1 and np.diff(times).min() < _NEAREST * (1.0 - 1e-6):
        raise LimitError(
            "the times of actions must ascend by at least 1 ms", code=2, parameter="at", value=at
        )
    return times


class _Spline:
    """A natural cubic spline through actions, and the way on which the arm brakes behind the last one.

    Args:
        times: of the actions, shape (n,) [s].
        q: joint positions, shape (n, 7) [rad].
        acceleration: of braking, shape (7,) [rad/s²].
        jerk: likewise [rad/s³].
    """

    def __init__(self, times: Array, q: Array, *, acceleration: Array, jerk: Array) -> None:
        self._t, self._q, count = times, q, len(times)
        self._bend = np.zeros_like(q)
        if count > 2:  # continuous second derivatives, zero at both ends
            step = np.diff(times)
            matrix = np.diag(2.0 * (step[:-1] + step[1:]))
            matrix += np.diag(step[1:-1], 1) + np.diag(step[1:-1], -1)
            slope = np.diff(q, axis=0) / step[:, None]
            self._bend[1:-1] = np.linalg.solve(matrix, 6.0 * np.diff(slope, axis=0))
        self._speed = np.zeros(7) if count == 1 else self._inner(times[-1:])[1][0]
        fast = np.abs(self._speed)
        self._brake = float(np.maximum(1.5 * fast / acceleration, np.sqrt(6.0 * fast / jerk)).max())
        self.knots = self._inner(0.5 * (times[1:] + times[:-1]))[3], self._bend

    def _inner(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Position and three derivatives within the actions, shape (m, 7) each."""
        index = np.clip(np.searchsorted(self._t, t, side="right") - 1, 0, len(self._t) - 2)
        h = (self._t[index + 1] - self._t[index])[:, None]
        b = (t - self._t[index])[:, None] / h
        a = 1.0 - b
        p, r, m, k = self._q[index], self._q[index + 1], self._bend[index], self._bend[index + 1]
        return (
            a * p + b * r + ((a**3 - a) * m + (b**3 - b) * k) * h**2 / 6.0,
            (r - p) / h + ((3.0 * b**2 - 1.0) * k - (3.0 * a**2 - 1.0) * m) * h / 6.0,
            a * m + b * k,
            (k - m) / h,
        )

    def __call__(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk at times, shape (m, 7) each."""
        end = self._t[-1]
        if len(self._t) == 1:
            return self._behind(t)
        late = t > end
        if not late.any():
            return self._inner(np.maximum(t, self._t[0]))
        if late.all():
            return self._behind(t)
        rows = zip(self._inner(np.clip(t, self._t[0], end)), self._behind(t), strict=True)
        position, speed, bend, jerk = (np.where(late[:, None], b, a) for a, b in rows)
        return position, speed, bend, jerk

    def _behind(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Likewise behind the last action."""
        still = np.zeros((len(t), 7))
        if self._brake <= 0.0:
            return self._q[-1] + still, still, still, still
        length = self._brake
        u = np.clip((t - self._t[-1]) / length, 0.0, 1.0)[:, None]
        moves = (u < 1.0) * self._speed
        return (
            self._q[-1] + self._speed * length * (u - u**3 + 0.5 * u**4),
            moves * (1.0 - 3.0 * u**2 + 2.0 * u**3),
            moves * (6.0 * u**2 - 6.0 * u) / length,
            moves * (12.0 * u - 6.0) / length**2,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """A chunk, and the offset with which it begins.

    Attributes:
        begin: when it begins [s].
        spline: through its actions.
        offset: the path minus the spline at the beginning: position, velocity, acceleration, shape (3, 7).
        blending: time in which the offset vanishes [s].
    """

    begin: float
    spline: _Spline
    offset: Array
    blending: float

    def __call__(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk at times, shape (m, 7) each."""
        rows = self.spline(t)
        length = self.blending
        if length <= 0.0 or t[0] >= self.begin + length:
            return rows
        u = np.clip((t - self.begin) / length, 0.0, 1.0)
        powers = np.stack([u**k for k in range(6)])
        moves = (u < 1.0).astype(float)
        scaled = self.offset * np.array([1.0, length, length**2])[:, None]
        sums = []
        for order, row in enumerate(rows):
            shape = _FADES[order] @ powers * moves / length**order
            sums.append(row + shape.T @ scaled)
        position, speed, bend, jerk = sums
        return position, speed, bend, jerk


def _fades() -> tuple[Array, ...]:
    """Coefficients of the polynomials of degree 5 with which position, velocity and acceleration fade out, by order."""
    fade = np.array(
        [[1.0, 0, 0, -10, 15, -6], [0, 1, 0, -6, 8, -3], [0, 0, 0.5, -1.5, 1.5, -0.5]],
    )
    found = [fade]
    for _ in range(3):
        fade = np.hstack([fade[:, 1:] * np.arange(1, 6), np.zeros((3, 1))])
        found.append(fade)
    return tuple(found)


_FADES = _fades()


class ActionPath:
    """One smooth path through chunk after chunk; no clock and no arm.

    Args:
        q: where it begins, at rest, shape (7,) [rad].
        speed: largest of each joint, shape (7,) [rad/s].
        acceleration: likewise [rad/s²].
        jerk: likewise [rad/s³].
    """

    def __init__(self, q: Array, *, speed: Array, acceleration: Array, jerk: Array) -> None:
        self._limits = np.stack([speed, acceleration, jerk])
        self._pieces: tuple[_Piece, ...] = ()
        self.restart(0.0, q, np.zeros(7))

    def restart(self, t: float, q: Array, dq: Array) -> None:
        """Forget all chunks: brake from a position with a velocity at a time [s, rad, rad/s]."""
        here = self._spline(np.array([t - 1.0, t]), np.stack([q - dq, q]))
        self._pieces = (_Piece(t, here, np.zeros((3, 7)), 0.0),)

    def _spline(self, times: Array, q: Array) -> _Spline:
        _, acceleration, jerk = _ACTIONS * self._limits
        return _Spline(times, q, acceleration=acceleration, jerk=jerk)

    def take(self, times: Array, q: Array, *, now: float) -> TakenChunk:
        """Replace what is left of the chunks before, from the first action of a chunk on that is not late.

        Args:
            times: of the actions, ascending, shape (n,) [s].
            q: joint positions, shape (n, 7) [rad].
            now: the earliest time at which the path may change [s].

        Raises:
            LimitError: all actions are late; or the joints cannot follow them, not even smoothed.
        """
        late = int(np.searchsorted(times, now, side="left"))
        if late == len(times):
            raise LimitError(
                f"at must have actions after {now:.3f} s, got the last one at {times[-1]:.3f} s",
                code=2,
                parameter="at",
                value=float(times[-1]),
                allowed=f"after {now:.3f} s",
                hint="chunks have to be longer than their inference takes; the arm brakes at the end of the last one",
            )
        spline, moved = self._feasible(times, q)
        begin = max(now, float(times[0]))
        before, after = self._at(begin), spline(np.array([begin]))
        offset = np.stack([old[0] - new[0] for old, new in zip(before[:3], after[:3], strict=True)])
        new = self._blended(begin, spline, offset)
        kept = [piece for piece in self._pieces if piece.begin < begin] or [self._pieces[0]]
        current = [index for index, piece in enumerate(kept) if piece.begin <= now]
        self._pieces = (*kept[current[-1] if current else 0 :], new)
        return TakenChunk(begin, late, moved, new.blending)

    def _feasible(self, times: Array, q: Array) -> tuple[_Spline, float]:
        """A spline through the actions that the joints can follow, smoothed as little as possible (Whittaker 1923)."""
        spline = self._spline(times, q)
        excess = self._excess(spline, times)
        if (excess <= 1.0).all():
            return spline, 0.0
        if len(q) > 3:
            differences = np.diff(np.eye(len(q)), n=3, axis=0)
            penalty = differences.T @ differences
            found, low, high = None, 0, len(_WEIGHTS) - 1
            while low <= high:  # the smallest weight that is enough
                middle = (low + high) // 2 if found is not None or low else high
                smooth = np.linalg.solve(np.eye(len(q)) + _WEIGHTS[middle] * penalty, q)
                spline = self._spline(times, smooth)
                excess = self._excess(spline, times)
                if (excess <= 1.0).all():
                    found, high = (spline, float(np.abs(smooth - q).max())), middle - 1
                else:
                    low = middle + 1
            if found is not None:
                return found
        order, joint = np.unravel_index(int(excess.argmax()), excess.shape)
        allowed = float(_ACTIONS * self._limits[order, joint])
        unit = _NAMES[int(order) + 1]
        raise LimitError(
            f"the chunk needs {excess.max() * allowed:.3g} {unit} of A{int(joint) + 1}, also smoothed; "
            f"at most {allowed:.3g} {unit} are allowed",
            code=2,
            parameter="chunk",
            value=round(float(excess.max() * allowed), 4),
            allowed=f"up to {allowed:.4g} {unit}",
            hint="speed= and acceleration= of the servo motion raise the limits; or give the actions more time",
        )

    def _excess(self, spline: _Spline, times: Array) -> Array:
        """Largest velocity, acceleration and jerk of each joint as multiples of what is allowed, shape (3, 7)."""
        if len(times) == 1:
            return np.zeros((3, 7))
        speed = np.abs(spline(np.concatenate([times, 0.5 * (times[1:] + times[:-1])]))[1]).max(axis=0)
        jerk, bend = (np.abs(values).max(axis=0) for values in spline.knots)
        return np.stack([speed, bend, jerk]) / (_ACTIONS * self._limits)

    def _blended(self, begin: float, spline: _Spline, offset: Array) -> _Piece:
        """The chunk with the shortest time for its offset that keeps the limits; else with that which exceeds least."""
        if np.abs(offset).max() < _ROUNDING:
            return _Piece(begin, spline, offset, 0.0)
        best, least = None, np.inf
        for length in np.geomspace(_SHORTEST, _LONGEST, _TRIED).tolist():
            piece = _Piece(begin, spline, offset, length)
            rows = piece(begin + np.linspace(0.0, length, _LOOKS))
            excess = max(
                float((np.abs(row) / limit).max()) for row, limit in zip(rows[1:], self._limits, strict=True)
            )
            if excess < least:
                best, least = piece, excess
            if excess <= _WHOLE:
                break
        assert best is not None
        return best

    def _at(self, t: float) -> tuple[Array, Array, Array, Array]:
        piece = self._pieces[0]
        for other in self._pieces[1:]:
            if other.begin <= t:
                piece = other
        return piece(np.array([max(t, piece.begin)]))

    def at(self, t: float) -> tuple[Array, Array]:
        """Position and velocity at a time [s], shape (7,) each [rad, rad/s]."""
        q, dq, _, _ = self._at(t)
        return q[0], dq[0]


class ActionStream:
    """A thread that sends a target of the path in every period, whatever the program does.

    Args:
        path: that it follows.
        send: sends joint positions and their velocities.
        time: this machine's time since the motion began [s].
        clock: its clock.
        period: time between two targets [s].
        ahead: targets are of the path so far ahead [s]: they are where the arm is to be then.
    """

    def __init__(
        self,
        path: ActionPath,
        send: Callable[[Array, Array], object],
        *,
        time: Callable[[], float],
        clock: Clock,
        period: float,
        ahead: float,
    ) -> None:
        self.path, self._send, self._time, self._clock = path, send, time, clock
        self._period, self.ahead = period, ahead
        self._is_on = True
        self._good: Array | None = None  # the last target that was sent
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="heptarm-actions", daemon=True)

    def take(self, times: Array, q: Array, *, last: tuple[Array, Array]) -> TakenChunk:
        """Follow a chunk; see `ActionPath.take`.

        Args:
            times: of the actions, shape (n,) [s].
            q: joint positions, shape (n, 7) [rad].
            last: position and velocity of the last target, from which the path goes on if it was left meanwhile.

        Raises:
            LimitError: as `ActionPath.take`.
            HeptarmError: what kept a target of the last chunk from being sent; the arm rests there.
        """
        self.raise_failure()
        with self._lock:
            now = self._time() + self.ahead
            if not self._is_on or not self._thread.is_alive():
                self.path.restart(now, *last)
            taken = self.path.take(times, q, now=now + self._period)
            self._go_on()
        return taken

    def brake(self, q: Array, dq: Array) -> None:
        """Brake from a target with a velocity, and rest there until the next chunk, shape (7,) each [rad, rad/s]."""
        self.raise_failure()
        with self._lock:
            self.path.restart(self._time() + self.ahead, q, dq)
            self._go_on()

    def _go_on(self) -> None:
        self._is_on = True
        if not self._thread.is_alive() and not self._ending.is_set():
            self._thread.start()

    def leave(self) -> None:
        """Send nothing more until the next chunk: the program sets targets itself."""
        with self._lock:
            self._is_on = False

    def raise_failure(self) -> None:
        """Raise what kept a target from being sent, once."""
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def close(self) -> None:
        """End the thread."""
        self._ending.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(_PATIENCE)

    def _run(self) -> None:
        due, period = self._clock.nanos(), round(self._period * 1e9)
        while not self._ending.is_set():
            with self._lock:
                if self._is_on:
                    self._step()
            due = max(due + period, self._clock.nanos())
            self._ending.wait((due - self._clock.nanos()) * 1e-9)

    def _step(self) -> None:
        now = self._time() + self.ahead
        q, dq = self.path.at(now)
        try:
            self._send(q, dq)
            self._good = q
        except HeptarmError as error:  # bodies or a wall are in the way: it rests at the last good target
            self._failure = error
            if self._good is None:
                self._is_on = False
            else:
                self.path.restart(now, self._good, np.zeros(7))
        except Exception as error:  # a defect must not pass unnoticed: no more targets, so the arm stops
            self._failure = error
            self._ending.set()


def actions(chunk: npt.ArrayLike) -> Array:
    """Joint positions of a chunk, shape (n, 7) [rad].

    Raises:
        ShapeError: another shape, or too many.
        LimitError: a number that is not finite.
    """
    given = numbers(chunk, "chunk")
    if given.ndim != 2 or given.shape[1] != 7 or not 1 <= len(given) <= MOST_ACTIONS:
        raise ShapeError(
            f"chunk must have shape (n, 7) with n from 1 to {MOST_ACTIONS}, got {given.shape}",
            parameter="chunk",
        )
    return finite_entries(given, "chunk")
