"""What a recording shows of an arm, reduced to short windows: positions with their derivatives, torques, noise.

One smooth kernel filters every signal, and its derivatives give velocities and accelerations. So an equation between
signals holds between the filtered ones, too, whatever the jerk of a motion is.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.model.dynamics import inverse_dynamics_rows
from heptarm.record.recorded import FRI, RecordedData
from heptarm.values.checks import Array, Value, finite_entries, frozen, instance, numbers
from heptarm.values.robot import Body, RobotModel

_AXES = 7
#: Names of the arrays, here and in a recording.
_NAMES = ("q", "q_cmd", "tau", "tau_ext", "tau_cmd")
#: Those that are measured, and so late by the delay of the states.
_MEASURED = ("q", "tau", "tau_ext")
#: Length of a window [s], and the fewest samples in one. Of the kernel's weight, half is within a sixth of it.
_WINDOW, _FEWEST = 0.1, 15
#: Least rate of a recording [Hz].
SLOWEST = 190.0
#: Least duration of the parts in which an axis moves [s], and the speed from which on it does [rad/s].
_MOVED, MOVING = 3.0, 1e-3
#: Shift by which the skew of the torques is found, and the largest skew [s].
_SHIFT, _MOST_SKEW = 1e-3, 5e-3
#: FRI cycles are taken in place of pushed states if they cover this part of their time.
_FOLLOWED = 0.8
#: Time for which an axis must have moved in one direction, so that its joint is wound [s].
WOUND = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class ArmSamples(Value):
    """States of an arm in a row, as a recording has them; `of` takes them from one.

    Attributes:
        t: times, ascending, shape (n,) [s].
        q: measured positions, shape (n, 7) [rad].
        q_cmd: commanded positions, shape (n, 7) [rad].
        tau: torques of the sensors, shape (n, 7) [Nm].
        tau_ext: external torques as the cabinet has them, shape (n, 7) [Nm].
        tau_cmd: torques that the motors are commanded, shape (n, 7) [Nm].
        source: where they come from, such as the name of a file.
        date: of the recording, ISO 8601.

    Raises:
        ShapeError: wrong shapes.
        LimitError: a number that is not finite.
        CommandRejected: times that do not ascend.
    """

    t: Array
    q: Array
    q_cmd: Array
    tau: Array
    tau_ext: Array
    tau_cmd: Array
    source: str = ""
    date: str = ""

    def __post_init__(self) -> None:
        times = finite_entries(numbers(self.t, "t"), "t")
        if times.ndim != 1 or len(times) < 2:
            raise ShapeError(f"t must have shape (n,) with n >= 2, got {times.shape}", parameter="t")
        if not (np.diff(times) > 0.0).all():
            raise CommandRejected("t must ascend strictly", parameter="t", hint="leave repeated states out")
        object.__setattr__(self, "t", frozen(times))
        for name in _NAMES:
            given = numbers(getattr(self, name), name)
            if given.shape != (len(times), _AXES):
                raise ShapeError(
                    f"{name} must have shape (n, {_AXES}) with the n of t, got {given.shape}", parameter=name
                )
            object.__setattr__(self, name, frozen(finite_entries(given, name)))
        for text in ("source", "date"):
            instance(getattr(self, text), str, text)

    @staticmethod
    def of(run: RecordedData) -> ArmSamples:
        """Those of a recording: its FRI cycles, or its pushed states where these are more.

        Raises:
            CommandRejected: it lacks positions or torques, or the robot reports no commanded torques.
        """
        instance(run, RecordedData, "run")
        prefix = FRI if _is_followed(run) else ""
        lacking = [name for name in _NAMES if f"{prefix}{name}" not in run]
        if lacking or not len(run[f"{prefix}t"]):
            raise CommandRejected(
                f"the recording must have {', '.join(_NAMES)}, it lacks {', '.join(lacking) or 'all states'}",
                parameter="run",
                hint='subscribe the groups "joints" and "torques": arm.record(path, rate=500)',
            )
        # the controller's clock; the times of FRI cycles are those of their receipt
        stamps = np.asarray(run[f"{prefix}stamp"], dtype=np.float64)
        times = (stamps - stamps[0]) * 1e-9
        rows = [np.asarray(run[f"{prefix}{name}"], dtype=np.float64) for name in _NAMES]
        good = np.isfinite(times) & np.logical_and.reduce([np.isfinite(row).all(axis=1) for row in rows])
        good &= np.r_[True, np.diff(np.maximum.accumulate(times)) > 0.0]
        if good.sum() < 2 or not np.any(rows[-1][good]):
            raise CommandRejected(
                "the recording has no commanded torques: friction cannot be separated from the sensors' errors",
                parameter="run",
                hint="record an FRI session, whose cycles have them",
            )
        q, q_cmd, tau, tau_ext, tau_cmd = (row[good] for row in rows)
        return ArmSamples(
            times[good], q, q_cmd, tau, tau_ext, tau_cmd, source=run.path.name, date=written(run.path)
        )

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1.0 / float(np.median(np.diff(self.t)))


def _is_followed(run: RecordedData) -> bool:
    """Whether FRI cycles show more of a recording than its pushed states: more of them, over most of its time."""
    if f"{FRI}q_cmd" not in run or np.isnan(run[f"{FRI}q_cmd"]).all():  # FRI 2 sends no set-points
        return False
    times = [run[f"{prefix}t"] for prefix in (FRI, "")]
    spans = [len(t) * float(np.median(np.diff(t))) if len(t) > 1 else 0.0 for t in times]
    return len(times[0]) > len(times[1]) and spans[0] > _FOLLOWED * spans[1]


def written(path: Path) -> str:
    """When a file was written, ISO 8601; empty: it is gone."""
    try:
        seconds = path.stat().st_mtime
    except OSError:
        return ""
    return datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc).isoformat(timespec="seconds")


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Samples filtered over windows of 100 ms that overlap by half; arrays of shape (m, 7) unless said otherwise.

    Attributes:
        t: middle of each window, shape (m,) [s].
        offsets: of the samples of a window from its middle, shape (w,) [s].
        centre: weights of the samples, their sum is 1, shape (w,).
        q: positions in the middle [rad].
        dq: velocities [rad/s].
        ddq: accelerations [rad/s²].
        error: commanded minus measured positions [rad].
        tau: torques of the sensors [Nm].
        tau_ext: external torques [Nm].
        excess: commanded torques minus those that the controller's model expects [Nm].
        commanded: commanded torques [Nm].
        is_wound: the axis has moved in one direction for a while.
        q_noise: standard deviation of a single position, shape (7,) [rad].
        tau_noise: of a single torque, shape (7,) [Nm].
    """

    t: Array
    offsets: Array
    centre: Array
    q: Array
    dq: Array
    ddq: Array
    error: Array
    tau: Array
    tau_ext: Array
    excess: Array
    commanded: Array
    is_wound: npt.NDArray[np.bool_]
    q_noise: Array
    tau_noise: Array

    def some(self, chosen: npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> Windows:
        """Some of the windows."""
        rows = {name: getattr(self, name) for name in self.__slots__}
        kept = ("offsets", "centre", "q_noise", "tau_noise")
        return Windows(**{name: row if name in kept else row[chosen] for name, row in rows.items()})

    def thinned(self, most: int) -> Windows:
        """At most so many windows, evenly over time."""
        if len(self.t) <= most:
            return self
        return self.some(np.linspace(0, len(self.t) - 1, most).astype(np.intp))

    @property
    def seconds(self) -> float:
        """Time that the windows cover [s]."""
        return 0.5 * len(self.t) * float(self.offsets[-1] - self.offsets[0])


def windows_of(samples: ArmSamples, *, delay: float = 0.0, skew: float = 0.0) -> Windows:
    """Reduce samples to windows.

    Args:
        samples: what was recorded.
        delay: by which measured values come later than commanded ones [s].
        skew: by which the torques of a state belong to an earlier moment than its positions [s].

    Raises:
        CommandRejected: the recording is too slow, or has too few states in a row.
    """
    if samples.rate < SLOWEST:
        raise CommandRejected(
            f"the recording must have at least 200 states per second, got {samples.rate:.0f}",
            parameter="run",
            value=samples.rate,
            hint="arm.record(path, rate=500)",
        )
    period = 1.0 / samples.rate
    count = max(_FEWEST, round(_WINDOW / period) // 2 * 2 + 1)
    starts = _in_a_row(samples.t, period, count)
    if len(starts) < 10:
        raise CommandRejected(
            f"the recording must have at least {10 * count} states in a row, got {len(starts) * count}",
            parameter="run",
            hint="record for longer, on a machine that loses no states",
        )
    arrays = {name: getattr(samples, name) for name in _NAMES}
    if delay:
        for name in set(_NAMES) - set(_MEASURED):
            late = [np.interp(samples.t - delay, samples.t, column) for column in arrays[name].T]
            arrays[name] = np.column_stack(late)
    index = starts[:, None] + np.arange(count)
    offsets: Array = frozen(period * (np.arange(count) - count // 2))
    weights = _kernels(offsets)
    middle = starts + count // 2

    later = _kernels(offsets - skew)[0] if skew else weights[0]

    def fitted(values: Array, order: int) -> Array:
        return np.asarray(np.einsum("k,mkj->mj", weights[order], values[index]))

    def torque(name: str) -> Array:
        return np.asarray(np.einsum("k,mkj->mj", later, arrays[name][index]))

    tau, tau_ext, tau_cmd = torque("tau"), torque("tau_ext"), torque("tau_cmd")
    dq = fitted(arrays["q"], 1)
    return Windows(
        samples.t[middle],
        offsets,
        weights[0],
        fitted(arrays["q"], 0),
        dq,
        fitted(arrays["q"], 2),
        fitted(arrays["q_cmd"], 0) - fitted(arrays["q"], 0),
        tau,
        tau_ext,
        tau_cmd - tau - tau_ext,
        tau_cmd,
        _wound(samples.t[middle], dq),
        _noise(arrays["q"][index]),
        _noise(arrays["tau"][index]),
    )


def _kernels(offsets: Array) -> tuple[Array, Array, Array]:
    """Weights of the samples of a window for the filtered value and its first and second derivative.

    The kernel is (1 - x²)³; its derivatives are exact for a parabola.
    """
    x = 2.0 * offsets / (offsets[-1] - offsets[0] + 2.0 * (offsets[1] - offsets[0]))
    bell = np.maximum(1.0 - x**2, 0.0)
    centre = bell**3 / (bell**3).sum()
    slope = x * bell**2
    bend = 4.0 * x**2 * bell - bell**2
    bend -= bend.sum() * centre
    return centre, slope / (slope @ offsets), 2.0 * bend / (bend @ offsets**2)


def aligned_windows(
    samples: ArmSamples,
    model: RobotModel,
    *,
    delay: float = 0.0,
    load: Body | None = None,
    acceleration: npt.ArrayLike,
) -> Windows:
    """Reduce samples to windows, with the torques shifted to the positions that they belong to.

    What the controller expects, measured plus external torques, is ahead of the torques of the rigid arm at the
    positions, or behind them, by a part of a cycle, which differs between robots and rates.

    Args:
        samples: what was recorded.
        model: the robot.
        delay: by which measured values come later than commanded ones [s].
        load: load data that the cabinet used; None: none.
        acceleration: of gravity in the base frame, shape (3,) [m/s²].
    """
    first, later = windows_of(samples, delay=delay), windows_of(samples, delay=delay, skew=_SHIFT)
    moments = (first.q, first.dq, first.ddq)
    rigid = inverse_dynamics_rows(model, *moments, load=load, acceleration=acceleration)
    slope = (later.tau + later.tau_ext - first.tau - first.tau_ext) / _SHIFT
    missed = rigid - first.tau - first.tau_ext
    # masses that are not heptarm's leave torques, too, but these do not go along with the slope
    skew = float((slope * missed).sum()) / max(float((slope**2).sum()), 1e-9)
    return windows_of(samples, delay=delay, skew=min(max(skew, -_MOST_SKEW), _MOST_SKEW))


def _in_a_row(t: Array, period: float, count: int) -> npt.NDArray[np.intp]:
    """First samples of windows in which no state is missing, shape (m,)."""
    breaks = np.flatnonzero(np.abs(np.diff(t) - period) > 0.5 * period) + 1
    edges = np.r_[0, breaks, len(t)]
    found = [np.arange(a, b - count + 1, count // 2) for a, b in pairwise(edges)]
    return np.concatenate(found).astype(np.intp)


def _wound(t: Array, dq: Array) -> npt.NDArray[np.bool_]:
    """Whether each axis has moved in one direction for `WOUND`, shape (m, 7)."""
    turned = np.where(np.abs(dq) > MOVING, np.sign(dq), 0.0)
    result = np.zeros(dq.shape, dtype=bool)
    for axis in range(_AXES):
        changed = np.r_[True, turned[1:, axis] != turned[:-1, axis]] | np.r_[True, np.diff(t) > 2.0 * _WINDOW]
        since = np.maximum.accumulate(np.where(changed, t, -math.inf))
        result[:, axis] = (turned[:, axis] != 0.0) & (t - since >= WOUND)
    return result


def _noise(values: Array) -> Array:
    """Standard deviation of single samples about parabolas in the middle of their windows, shape (7,).

    That of the median window, so that jerks of the motion do not count; of a chi-square distribution its median is
    about 1 - 2 / 9 n, cubed (Wilson, Hilferty, 1931).

    Args:
        values: of the samples of each window, shape (m, w, 7).
    """
    count = values.shape[1]
    some = values[:: max(1, len(values) // 2000), count // 4 : count - count // 4]
    powers = np.vander(np.linspace(-1.0, 1.0, some.shape[1]), 3)
    left = some - np.einsum("kl,mlj->mkj", powers @ np.linalg.pinv(powers), some)
    freedom = some.shape[1] - 3
    square = (left**2).sum(axis=1) / freedom
    return np.asarray(np.sqrt(np.median(square, axis=0) / (1.0 - 2.0 / (9.0 * freedom)) ** 3))


def check_moved(windows: Windows) -> None:
    """Refuse a recording in which an axis hardly moves.

    Raises:
        CommandRejected: it is; the text names the axis.
    """
    moving = (np.abs(windows.dq) > MOVING).mean(axis=0) * windows.seconds
    axis = int(moving.argmin())
    if moving[axis] < _MOVED:
        raise CommandRejected(
            f"every axis must move for at least {_MOVED:g} s, got {moving[axis]:.1f} s of A{axis + 1}",
            parameter="run",
            value=float(moving[axis]),
            hint="record the motions of calibration.excitation(arm)",
        )
