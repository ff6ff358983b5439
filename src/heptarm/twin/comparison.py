"""Two recordings over one time line: how far they deviate, signal by signal, and where they part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.record.fri_commands import FriCommands
from heptarm.record.mcap_file import merge
from heptarm.record.plot.chart import Chart
from heptarm.record.plot.content import Mark
from heptarm.record.plot.signals import compare
from heptarm.record.recorded import RecordedMotion
from heptarm.record.recording import Recording
from heptarm.record.samples import labels
from heptarm.values.checks import Array, Value, choice, flag, shown, within
from heptarm.values.files import path_of, refuse_existing
from heptarm.values.text import aligned, fixed, lines

if TYPE_CHECKING:
    from heptarm.twin.commands import Section

#: Units of the signals that are compared, and how far both recordings may deviate without a difference in behaviour.
#: Set-points are computed by the same rules on both sides; positions differ by tracking errors, torques by friction and
#: load data.
SIGNALS: dict[str, tuple[str, float]] = {
    "q_cmd": ("rad", 0.003),
    "q": ("rad", 0.005),
    "dq": ("rad/s", 0.1),
    "xyz": ("m", 0.003),
    "tau": ("Nm", 8.0),
    "tau_ext": ("Nm", 5.0),
    "force": ("N", 15.0),
    "torque": ("Nm", 5.0),
}
BANDS: dict[str, float] = {name: band for name, (_, band) in SIGNALS.items()}
#: Both part where a deviation is outside its band for so long: shorter ones are noise [s].
_LASTING = 0.02
#: So much of a motion decides when it began [s], found within this time of its event [s], by such steps and
#: then so many of Gauss and Newton.
_ONSET, _NEAR, _STEP, _STEPS = 1.0, 0.3, 0.005, 12
#: A set-point that moves less than this in the onset does not show when it began [rad].
_SHOWS = 1e-3
#: Time after a motion in which the arm comes to rest, which is compared as well [s].
SETTLE = 0.5
#: Between two states of the twin that are farther apart nothing is compared: a busy machine has missed some [s].
_GAP = 0.01
#: So late the event of an end may come at most, to be that of a motion which took no longer than the recorded one [s].
_LATE = 0.3
#: Shortest stretch of the time line [s].
_SHORTEST = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Deviation(Value):
    """How far one signal of the twin deviates from the recording.

    Attributes:
        signal: its name, such as "q".
        unit: of the numbers.
        band: the largest deviation that is no difference.
        largest: the largest deviation of any of its entries.
        entry: the entry with it, such as "A2".
        t: its time [s].
        rms: root mean square over all entries and times.
        parts: when it left its band for the first time, for 20 ms at least [s]; NaN: it stays inside.
    """

    signal: str
    unit: str
    band: float
    largest: float
    entry: str
    t: float
    rms: float
    parts: float = nan

    @property
    def is_inside(self) -> bool:
        """Whether it stays inside its band."""
        return isnan(self.parts)


@dataclass(frozen=True, slots=True, eq=False)
class RepeatedMotion(Value):
    """A program of the recording, and what became of it in the twin.

    Attributes:
        recorded: as it was.
        simulated: in the twin, its times on the recording's time line; None: the twin's cabinet refused it.
        refusal: why; empty: it did not.
    """

    recorded: RecordedMotion
    simulated: RecordedMotion | None
    refusal: str = ""

    @property
    def ends_alike(self) -> bool:
        """Whether it ended by the same cause, as far as the recording knows the cause."""
        if self.simulated is None:
            return False
        return not self.recorded.cause or self.recorded.cause == self.simulated.cause


@dataclass(frozen=True, slots=True, eq=False)
class Twin(Value):
    """A recording and its repetition in the simulator, over one time line; made by `replay_in_sim`.

    Each motion of the twin begins when the recorded one began; pauses between motions are those of the recording.

    Attributes:
        recorded: the recording.
        simulated: the recording of the twin; its times are those of `recorded`.
        deviations: of each signal that both have.
        motions: what became of each program.
        notes: what could not be repeated.
    """

    recorded: Recording
    simulated: Recording
    deviations: tuple[Deviation, ...]
    motions: tuple[RepeatedMotion, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, signal: str) -> Deviation:
        """The deviation of a signal, such as "q".

        Raises:
            CommandRejected: it was not compared; the text lists those that were.
        """
        return choice(signal, "signal", {deviation.signal: deviation for deviation in self.deviations})

    @property
    def parts(self) -> float:
        """First time at which a signal leaves its band or a motion ends by another cause [s]; NaN: never."""
        found = [deviation.parts for deviation in self.deviations if not deviation.is_inside]
        for motion in self.motions:
            if not motion.ends_alike:
                ends = [motion.recorded.end, nan if motion.simulated is None else motion.simulated.end]
                found.append(min((end for end in ends if not isnan(end)), default=motion.recorded.begin))
        return min(found, default=nan)

    @property
    def is_alike(self) -> bool:
        """Whether no signal leaves its band, and every motion ended by the same cause."""
        return isnan(self.parts)

    def chart(self, *signals: str) -> Chart:
        """A chart of both: the recording solid, the twin dashed, from the begin of the first motion on.

        Args:
            signals: names as in `Recording.names`, or "path"; none: the usual ones that both have.

        Raises:
            CommandRejected: no such signal, or nothing to draw.
        """
        chart = compare([self.recorded, self.simulated], signals=signals)
        if isnan(self.parts):
            return chart
        zero = self.recorded.motions[0].begin
        return Chart(
            chart.title, chart.rows, marks=(*chart.marks, Mark(self.parts - zero, "parts", is_alarm=True))
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write a recording with both: `heptarm.load(path, arm="recorded")` and `arm="simulated"`.

        Args:
            path: the file, MCAP.
            overwrite: replace a file that exists.

        Raises:
            CommandRejected: the file exists, or cannot be written.
        """
        where = refuse_existing(path_of(path), overwrite=flag(overwrite, "overwrite"))
        simulated = self.simulated.between(
            float(self.recorded.t[0]), "end"
        )  # time zero is the first state of both
        return merge(where, {"recorded": self.recorded, "simulated": simulated})

    def __str__(self) -> str:
        """A few lines: whether both are alike, how far they deviate, what became of the motions."""
        if self.is_alike:
            title = f"{self.recorded.path.name} and its twin are alike"
        else:
            title = f"{self.recorded.path.name} and its twin part at {self.parts:.3f} s: {self._why()}"
        rows: dict[str, str] = {"signal": aligned(["largest", "band", "rms", "", "at", "parts"], 11)}
        for deviation in self.deviations:
            numbers = [f"{value:.4g}" for value in (deviation.largest, deviation.band, deviation.rms)]
            times = [
                f"{deviation.entry}",
                f"{fixed(deviation.t, 3)} s",
                "-" if deviation.is_inside else f"{deviation.parts:.3f} s",
            ]
            rows[f"{deviation.signal} [{deviation.unit}]"] = aligned([*numbers, *times], 11)
        for motion in self.motions:
            if not motion.ends_alike:
                rows[f"motion {motion.recorded.id}"] = self._ending(motion)
        for index, note in enumerate(self.notes, 1):
            rows[f"note {index}"] = note
        return lines(title, rows)

    def _why(self) -> str:
        first = min(
            (deviation for deviation in self.deviations if not deviation.is_inside),
            key=lambda deviation: deviation.parts,
            default=None,
        )
        if first is not None and first.parts <= self.parts:
            return f"{first.signal} deviates by more than {first.band:g} {first.unit}"
        return next(
            f"motion {motion.recorded.id}: {self._ending(motion)}"
            for motion in self.motions
            if not motion.ends_alike
        )

    @staticmethod
    def _ending(motion: RepeatedMotion) -> str:
        if motion.simulated is None:
            return f"{motion.recorded.cause or 'it ran'}; the simulator refuses it: {motion.refusal}"
        twin = motion.simulated
        return f"{motion.recorded.cause}, in the simulator {twin.cause or 'no end'} {twin.detail}".rstrip()


def bands_of(given: Mapping[str, float] | None) -> dict[str, float]:
    """The bands of all signals, some of which a user gave.

    Raises:
        ShapeError: no mapping. CommandRejected: no such signal. LimitError: a band that is negative or no number.
    """
    bands = dict(BANDS)
    if given is None:
        return bands
    if not isinstance(given, Mapping):
        raise ShapeError(
            f"bands must be a dictionary such as {{'q': 0.01}}, got {shown(given)}",
            parameter="bands",
            value=given,
        )
    for name, band in given.items():
        if name not in SIGNALS:
            known = ", ".join(SIGNALS)
            raise CommandRejected(
                f"bands must be of {known}, got {shown(name)}", parameter="bands", value=name, allowed=known
            )
        bands[name] = within(band, f"bands[{name!r}]", 0.0, 1e6, unit=SIGNALS[name][0])
    return bands


# ---------------------------------------------------------------------------------------- one time line


@dataclass(frozen=True, slots=True)
class Repetition:
    """When a section ran in the twin, on the twin's own time line.

    Attributes:
        section: of the recording.
        number: the twin cabinet's number of it; 0: it refused it.
        refusal: why.
    """

    section: Section
    number: int
    refusal: str = ""


def aligned_twin(
    recorded: Recording, simulated: Recording, repetitions: Sequence[Repetition], *, same_speed: bool
) -> tuple[Recording, tuple[RepeatedMotion, ...], Array]:
    """The twin's recording on the time line of the recorded one.

    A motion of the twin begins when the recorded one began. Where their set-points show it, the begin is found to a
    fraction of a state's period: by the shift that makes the squares of their differences least in the first second.

    Args:
        recorded: the recording.
        simulated: the twin's, on its own time line.
        repetitions: what ran.
        same_speed: whether the twin's set-points are those of the recording.

    Returns:
        The twin's recording on the other time line, what became of the motions, and the times at which both are
        compared, shape (m,) [s].
    """
    by_id = {motion.id: motion for motion in simulated.motions}
    ran = [repetition for repetition in repetitions if repetition.number in by_id]
    last = float(simulated.t[-1])
    onsets = [
        _onset(recorded, simulated, by_id[repetition.number], repetition.section, same_speed=same_speed)
        for repetition in ran
    ]
    begins, wanted = [begin for begin, _ in onsets], [there for _, there in onsets]
    sources: list[float] = []
    targets: list[float] = []
    spans: list[tuple[float, float]] = []
    for index, (repetition, begin) in enumerate(zip(ran, begins, strict=True)):
        end = by_id[repetition.number].end
        moves = (last if isnan(end) else end) - begin
        # the one before may have taken longer than it was recorded
        there = max([wanted[index], *targets[-1:]])
        length = min(moves + SETTLE, last - begin)
        if repetition.section.session is not None:  # both clients close after it, each in its own time
            length = min(length, float(repetition.section.session.commands.t[-1]) - _LASTING)
        if index + 1 < len(ran):  # the event of an end may come after the next begin
            length = min(length, begins[index + 1] - begin)
            if wanted[index + 1] > there:
                length = min(length, max(moves - _LATE, wanted[index + 1] - there))
        length = max(length, _SHORTEST)
        sources += [begin, begin + length]
        targets += [there, there + length]
        spans.append((there, there + length))
    line = _TimeLine(np.array(sources), np.array(targets))
    # behind a motion that the recording does not follow to its end there is nothing to compare
    times = recorded.t
    inside = np.zeros(len(times), bool)
    for first, final in spans:
        inside |= (times >= first) & (times <= final)
    signals = {**simulated.signals, "t": line(simulated.t)}
    moved = {
        motion.id: replace(motion, begin=float(line(motion.begin)), end=float(line(motion.end)))
        for motion in simulated.motions
    }
    repeated = {repetition.number for repetition in repetitions}
    aligned_recording = replace(
        simulated,
        signals=signals,
        motions=tuple(motion for number, motion in moved.items() if number in repeated),
        events=tuple(replace(event, t=float(line(event.t))) for event in simulated.events),
    )
    motions = tuple(
        RepeatedMotion(repetition.section.motion, moved.get(repetition.number), repetition.refusal)
        for repetition in repetitions
    )
    return aligned_recording, motions, times[inside]


@dataclass(frozen=True, slots=True)
class _TimeLine:
    """Times of the twin as times of the recording [s]; linear between knots, and of the same rate outside."""

    sources: Array
    targets: Array

    def __call__(self, t: Array | float) -> Array:
        given = np.asarray(t, dtype=np.float64)
        if not len(self.sources):
            return given
        inside = np.interp(given, self.sources, self.targets)
        early, late = np.minimum(given - self.sources[0], 0.0), np.maximum(given - self.sources[-1], 0.0)
        return np.asarray(inside + early + late)


def _onset(
    recorded: Recording, simulated: Recording, motion: RecordedMotion, section: Section, *, same_speed: bool
) -> tuple[float, float]:
    """Where both begin to do the same: time of the twin, and of the recording [s]."""
    begin, there = motion.begin, section.motion.begin
    if section.session is not None:  # when the commands became effective
        own = [one.begin for one in FriCommands.of(simulated) if one.begin >= begin]
        return (own[0], section.session.commands.begin) if own else (begin, there)
    shift = _shift(recorded, simulated, begin, section) if same_speed else 0.0
    # one that waited for the end of the one before begins with its set-points
    return begin + max(shift, 0.0), there + max(-shift, 0.0)


def _shift(recorded: Recording, simulated: Recording, begin: float, section: Section) -> float:
    """By how much later than its event states the recorded motion begins, in the twin's terms [s]."""
    there = section.motion.begin
    length = min(_ONSET, section.until - there)
    chosen = (recorded.t >= there - 0.02) & (recorded.t <= there + length)
    t, q = recorded.t[chosen], recorded["q_cmd"][chosen]
    known = ~np.isnan(q).any(axis=1)
    t, q = t[known], q[known]
    if len(t) < 3 or float(np.ptp(q, axis=0).max()) < _SHOWS:
        return 0.0
    own_t, own_q = simulated.t, simulated["q_cmd"]
    lost, slopes = _gaps(own_t), np.gradient(own_q, own_t, axis=0)

    def off(shift: float) -> tuple[Array, Array]:
        """Recorded minus own set-points where both are known, and the speed of the own ones, shape (m, 7) each."""
        at = t - there + begin + shift
        both = ~_is_lost(at, own_t, lost)
        now, speed = (
            np.stack([np.interp(at[both], own_t, column) for column in rows.T], axis=1)
            for rows in (own_q, slopes)
        )
        return q[both] - now, speed

    def square(shift: float) -> float:
        difference, _ = off(shift)
        return float((difference**2).mean()) if len(difference) > len(t) // 2 else inf

    # all of them: a motion back along the path of the one before fits that, too, and better than what is beside both
    shift = min(np.arange(-_NEAR, _NEAR, _STEP).tolist(), key=square)
    for _ in range(_STEPS):
        difference, speed = off(shift)
        weight = float((speed**2).sum())
        step = float((speed * difference).sum()) / weight if weight > 0.0 else 0.0
        shift = float(np.clip(shift + step, -_NEAR, _NEAR))
        if abs(step) < 1e-7:
            break
    return 0.0 if abs(shift) >= _NEAR else shift


# ------------------------------------------------------------------------------------------- deviations


def deviations_of(
    recorded: Recording, simulated: Recording, times: Array, bands: Mapping[str, float]
) -> tuple[Deviation, ...]:
    """How far the signals deviate at times of the recording, shape (m,) [s]."""
    found = (_deviation(name, recorded, simulated, times, bands[name]) for name in SIGNALS)
    return tuple(deviation for deviation in found if deviation is not None)


def _deviation(
    name: str, recorded: Recording, simulated: Recording, times: Array, band: float
) -> Deviation | None:
    """The deviation of a signal; None: one of the recordings does not have it."""
    if name not in recorded or name not in simulated or not len(times):
        return None
    times = times[~_is_lost(times, simulated.t, _gaps(simulated.t))]
    if not len(times):
        return None
    rows = np.searchsorted(recorded.t, times)
    own = np.stack([np.interp(times, simulated.t, column) for column in simulated[name].T], axis=1)
    difference = np.abs(recorded[name][rows] - own)
    known = ~np.isnan(difference).any(axis=1)
    if not known.any():
        return None
    t, difference = times[known], difference[known]
    row, entry = np.unravel_index(int(difference.argmax()), difference.shape)
    return Deviation(
        name,
        SIGNALS[name][0],
        band,
        float(difference[row, entry]),
        labels(name, difference.shape[1])[int(entry)],
        float(t[row]),
        float(np.sqrt((difference**2).mean())),
        _leaves(t, difference.max(axis=1) > band),
    )


def _gaps(t: Array) -> Array:
    """Whether a state is missing before each of the states at these times, and behind the last, shape (n + 1,)."""
    return np.concatenate([[0.0], np.diff(t) > _GAP, [0.0]])


def _is_lost(times: Array, t: Array, gaps: Array) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Which times, shape (m,), are where states at times of shape (n,) are missing."""
    return gaps[np.searchsorted(t, times)] > 0.0


def _leaves(t: Array, is_outside: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> float:
    """When the first excursion begins that lasts, or that the last sample is in [s]; NaN: there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_outside, [False]]).astype(int)))
    for begin, end in edges.reshape(-1, 2).tolist():
        if end == len(t) or float(t[end] - t[begin]) >= _LASTING:
            return float(t[begin])
    return nan
