"""Delay of FRI commands, from the recording of a session whose client moves the arm.

A command answers a message. The virtual cabinet goes straight from command to command and smooths that over a receive
period, so that its set-points are one and a half receive periods behind, and half a cycle more until a message shows
them (docs/explanation/fidelity.md). What a robot needs beyond that is its delay. It is found by the shift of the
commands that makes the squares of their distances from the set-points least; where FRI sends no set-points, from the
measured positions, which friction and the delay of the states hold back as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.record.fri_commands import FriCommands
from heptarm.values.checks import Array, Value
from heptarm.values.fitted_arm import FittedNumbers
from heptarm.values.text import lines

#: Name of the quantity of a fitted arm.
_NAME = "fri_command_delay"
#: Set-points are so many receive periods and so much time [s] behind the messages that the commands answer.
_PERIODS, _CYCLE = 1.5, 0.5e-3
#: An axis that moves less than this shows no delay [rad]; a session is used from this duration on [s].
_SHOWS, _SHORTEST = 2e-3, 0.3
#: Longest delay that is looked for, and the steps of the search [s]; then so many of Gauss and Newton.
_LONGEST, _STEP, _STEPS = 0.15, 5e-3, 6
#: Behind lost answers the controller returns to the commands in this time [s].
_LOST = 0.1
#: Distances that count, by the median one, and those that do in any case [rad].
_USUAL, _EXACT = 8.0, 1e-7
#: Speed below which friction of a joint turns round [rad/s].
_TURNS = 0.03
#: Duration of a part of the session whose residuals may depend on each other [s].
_PART = 0.25
#: Least standard deviation of a delay in set-points, and in measured positions, whose joints are wound [s].
_SURE, _SURE_MEASURED = 2e-5, 1e-4
#: A motion is that of its commands if no more than this part of it is left.
_LEFT = 0.05
#: Sessions agree within so many standard deviations, and this [s].
_AGREE, _CLOSE = 4.0, 2e-4


@dataclass(frozen=True, slots=True, eq=False)
class FriDelay(Value):
    """How late FRI commands act.

    Attributes:
        commanded: time from a message until the set-points are where its answer commands [s].
        measured: time until a message shows the arm there [s].
        sigma: standard deviation of both [s].
        period: time between two answers [s].
        source: what it comes from, such as the name of a file and its duration.
        date: of the recording, ISO 8601.
        contradictions: what the sessions show that one delay does not explain, in sentences.
    """

    commanded: float
    measured: float
    sigma: float
    period: float
    source: str = ""
    date: str = ""
    contradictions: tuple[str, ...] = ()

    @property
    def cycles(self) -> float:
        """Cycles of the client from a command to the measured answer."""
        return self.measured / self.period

    @property
    def delay(self) -> float:
        """What comes on top of the interpolation between commands [s]; not below 0."""
        return max(0.0, self.commanded - interpolation(self.period))

    @property
    def numbers(self) -> FittedNumbers:
        """The delay, for a fitted arm."""
        return FittedNumbers(_NAME, np.array([self.delay]), np.array([self.sigma]), self.source, self.date)

    def __str__(self) -> str:
        """The delay, and how many cycles a command takes until it is measured."""
        spread = f"± {1e3 * self.sigma:.2g} ms"
        rows = {
            "set-points": f"{1e3 * self.commanded:.2f} {spread} behind the message that a command answers",
            "measured": f"{self.cycles:.2f} cycles of {1e3 * self.period:g} ms from a command to the measured answer",
            "delay": f"{1e3 * self.delay:.2f} {spread} beyond the interpolation between commands",
        }
        return lines(f"FRI commands of {self.source or 'samples'}", rows)


def interpolation(period: float) -> float:
    """Time by which the set-points of the virtual cabinet are behind commands with this period, both [s]."""
    return _PERIODS * period + _CYCLE


@dataclass(frozen=True, slots=True)
class _Found:
    """The delay of one session: time behind the commands, standard deviation, period, duration [s]."""

    late: float
    sigma: float
    period: float
    seconds: float
    is_measured: bool


def delay_of(
    sessions: Iterable[FriCommands], *, state_delay: float = 0.0, source: str = "", date: str = ""
) -> FriDelay | None:
    """The delay that FRI sessions show; None: in none of them the arm follows a client that moves it.

    Args:
        sessions: commands and what they did.
        state_delay: by which measured values come later than commanded ones [s].
        source: of the sessions.
        date: of the sessions, ISO 8601.
    """
    found = [one for one in map(_found, sessions) if one is not None]
    if not found:
        return None
    # without their interpolation the delays of sessions with different periods can be compared
    extra = np.array(
        [one.late - interpolation(one.period) - (state_delay if one.is_measured else 0.0) for one in found]
    )
    sigma = np.array([one.sigma for one in found])
    weights = sigma**-2.0 / float((sigma**-2.0).sum())
    mean, spread = float(weights @ extra), float((sigma**-2.0).sum()) ** -0.5
    period = float(np.average([one.period for one in found], weights=weights))
    commanded = mean + interpolation(period)
    seconds = sum(one.seconds for one in found)
    return FriDelay(
        commanded,
        commanded + state_delay,
        spread,
        period,
        f"{source or 'samples'}: {seconds:.1f} s of FRI at {1e3 * period:g} ms",
        date,
        tuple(_contradictions(found, extra, mean, spread)),
    )


def _contradictions(found: list[_Found], extra: Array, mean: float, spread: float) -> Iterator[str]:
    if mean < -2.0 * spread:
        yield (
            f"FRI commands act {-1e3 * mean:.2f} ms sooner than the simulator's interpolation of one and a half "
            "receive periods, which is simulated without a delay"
        )
    for one, delay in zip(found, extra.tolist(), strict=True):
        if abs(delay - mean) > _AGREE * math.hypot(one.sigma, spread) + _CLOSE:
            yield (
                f"FRI commands at a period of {1e3 * one.period:g} ms are {1e3 * delay:.2f} ms late beyond their "
                f"interpolation, those of all sessions {1e3 * mean:.2f} ms"
            )


# ----------------------------------------------------------------------------------------------- one session


def _found(one: FriCommands) -> _Found | None:
    """The delay of a session; None: it shows none."""
    is_knot = one.is_answered & np.isfinite(one.q_sent).all(axis=1)
    at, sent = one.t[is_knot], one.q_sent[is_knot]
    if len(at) < 2:
        return None
    moving = np.flatnonzero(np.ptp(sent, axis=0) > _SHOWS)
    has_set_points = bool(np.isfinite(one.q_cmd).all())
    reported = one.q_cmd if has_set_points else one.q
    period = float(np.median(np.diff(at)))
    rows = _is_whole(one.t, at, period) & np.isfinite(reported).all(axis=1)
    t, seen, sent = one.t[rows], reported[rows][:, moving], sent[:, moving]
    seconds = len(t) * one.period
    if not len(moving) or seconds < _SHORTEST:
        return None

    def fit(late: float) -> _Fit:
        return _fit(t - late, seen, at, sent, is_wound=not has_set_points)

    late = min(np.arange(0.0, _LONGEST, _STEP).tolist(), key=lambda late: float((fit(late).left ** 2).sum()))
    for _ in range(_STEPS):
        best = fit(late)
        # an answer that came too late for the controller moves the set-points for a moment
        size = np.abs(best.left)
        is_usual = (size <= np.maximum(_USUAL * np.median(size, axis=0), _EXACT)).all(axis=1)
        t, seen = t[is_usual], seen[is_usual]
        late = min(max(late + fit(late).step, 0.0), _LONGEST)
    best = fit(late)
    if (np.sqrt((best.left**2).mean(axis=0)) > _LEFT * np.ptp(seen, axis=0)).any():
        return None
    least = _SURE if has_set_points else _SURE_MEASURED
    return _Found(late, math.hypot(best.sigma(t), least), period, seconds, not has_set_points)


def _is_whole(t: Array, at: Array, period: float) -> npt.NDArray[np.bool_]:
    """Which times, shape (n,), are behind no lost answer, of answers at times of shape (k,) [s]."""
    lost = np.diff(at) > 1.5 * period
    begins = np.concatenate([at[:1], at[1:][lost] + _LOST]) + _LONGEST
    ends = np.concatenate([at[:-1][lost], at[-1:]])
    return np.asarray(((t[:, None] >= begins) & (t[:, None] <= ends)).any(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """Positions minus commands that are shifted.

    Attributes:
        left: what no constant explains, nor friction of a wound joint, shape (m, a) [rad].
        slope: speed of the commands likewise, shape (m, a) [rad/s].
    """

    left: Array
    slope: Array

    @property
    def step(self) -> float:
        """By how much longer the shift has to be [s]."""
        return -float((self.slope * self.left).sum() / (self.slope**2).sum())

    def sigma(self, t: Array) -> float:
        """Standard deviation of the shift [s]: by the scatter of parts of the session, at least that of white noise."""
        starts = np.flatnonzero(np.r_[True, np.diff(np.floor((t - t[0]) / _PART)) > 0.0])
        sums = np.add.reduceat((self.slope * self.left).sum(axis=1), starts)
        information = float((self.slope**2).sum())
        many = len(sums) / max(1, len(sums) - 1)
        white = float((self.left**2).mean()) / information
        return math.sqrt(max(many * float((sums**2).sum()) / information**2, white))


def _fit(t: Array, seen: Array, at: Array, sent: Array, *, is_wound: bool) -> _Fit:
    """Compare positions with commands.

    Args:
        t: shifted times of the positions, shape (m,) [s].
        seen: positions, shape (m, a) [rad].
        at: times of the commands, shape (k,) [s].
        sent: commands, shape (k, a) [rad].
        is_wound: the positions are measured, of joints that friction winds.
    """
    left, slope = np.empty_like(seen), np.empty_like(seen)
    middle, speed = 0.5 * (at[1:] + at[:-1]), np.diff(sent, axis=0) / np.diff(at)[:, None]
    for axis in range(seen.shape[1]):
        fast = np.interp(t, middle, speed[:, axis])
        rows = np.column_stack([np.ones(len(t)), *([np.sign(fast)] if is_wound else [])])
        both = np.column_stack([seen[:, axis] - np.interp(t, at, sent[:, axis]), fast])
        if is_wound:  # what friction does where it turns round is not known here
            is_slow = np.abs(fast) < _TURNS
            rows[is_slow], both[is_slow] = 0.0, 0.0
        both -= rows @ np.linalg.lstsq(rows, both, rcond=None)[0]
        left[:, axis], slope[:, axis] = both.T
    return _Fit(left, slope)
