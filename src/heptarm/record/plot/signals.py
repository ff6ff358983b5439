"""Charts of recordings: one recording, or several on each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.record.journal import NOTE
from heptarm.record.plot.chart import Chart
from heptarm.record.plot.content import Band, ChartRow, Line, Mark, extremes
from heptarm.record.recorded import FRI, RecordedData
from heptarm.record.samples import labels
from heptarm.values.checks import instance, shown, word
from heptarm.values.robot import RobotModel

Kind = Literal["time", "histogram", "spectrum"]
KINDS: tuple[Kind, ...] = ("time", "histogram", "spectrum")
#: What is drawn if no signals are named; "path" is the path in space.
USUAL = ("q", "dq", "tau", "wrench", "path")
PATH = "path"
#: Requests and events that are marked on the time line.
_MARKED = ("Stop", "SafetyChanged", "ControlChanged", "ConditionFired", "TriggerFired", "Pause", "Resume")
#: Recordings that a chart can tell apart by the patterns of their lines.
_MOST_COMPARED = 4
#: Bins of a histogram.
_BINS = 60
#: Longest segment of Welch's method, in samples, and the fewest samples that have a spectrum.
_SEGMENT, _FEWEST = 1024, 16
#: Smallest amplitude of a spectrum, as a fraction of the least span of the signal: below it is rounding.
_FLOOR = 1e-6


@dataclass(frozen=True)
class _Quantity:
    """How a signal is drawn: title, factor, unit, least span in that unit, name of its limit in the model."""

    title: str
    factor: float = 1.0
    unit: str = ""
    least: float = 0.0
    limit: str = ""


_DEG = 180.0 / np.pi
_QUANTITIES = {
    "q": _Quantity("joint position", _DEG, "deg", 1.0),
    "q_cmd": _Quantity("commanded position", _DEG, "deg", 1.0),
    "q_sent": _Quantity("position sent", _DEG, "deg", 1.0),
    "q_ipo": _Quantity("interpolator's position", _DEG, "deg", 1.0),
    "dq": _Quantity("joint speed", _DEG, "deg/s", 2.0, "dq_max"),
    "tau": _Quantity("joint torque", 1.0, "Nm", 2.0, "tau_max"),
    "tau_ext": _Quantity("external torque", 1.0, "Nm", 2.0),
    "tau_cmd": _Quantity("commanded torque", 1.0, "Nm", 2.0),
    "tau_sent": _Quantity("torque sent", 1.0, "Nm", 2.0),
    "xyz": _Quantity("position of the motion frame", 1e3, "mm", 2.0),
    "xyz_cmd": _Quantity("commanded position of the motion frame", 1e3, "mm", 2.0),
    "force": _Quantity("external force", 1.0, "N", 5.0),
    "torque": _Quantity("external torque at the frame", 1.0, "Nm", 2.0),
    "wrench": _Quantity("external force and torque", 1.0, "N, Nm", 5.0),
    "e1": _Quantity("redundancy angle", _DEG, "deg", 1.0),
    "latency": _Quantity("time from receipt to answer", 1e-3, "us", 10.0),
    "progress": _Quantity("progress", 100.0, "%", 1.0),
    "override": _Quantity("override", 100.0, "%", 1.0),
}


def chart_of(recording: RecordedData, *, signals: Sequence[str] = (), kind: Kind = "time") -> Chart:
    """A chart of a recording: a row for each signal, with motions as bands and events as lines.

    Over time joint speeds and torques are drawn as fractions of their limits. An axis spans at least 1 deg, 2 deg/s,
    2 mm, 5 N or 2 Nm, so that the noise of a resting signal does not fill it.

    Args:
        recording: what is drawn.
        signals: names as in `recording.names`, or "path"; none: positions, speeds and torques by their limits, wrench
            and path, as far as they were recorded.
        kind: "time"; "histogram": fraction of the samples at each value; "spectrum": amplitude spectral density over
            frequency, by Welch's method (1967) with Hann windows that overlap by half.

    Raises:
        CommandRejected: no such signal, nothing to draw, a histogram or a spectrum of the path, or a spectrum of fewer
            than 16 samples.
    """
    word(kind, "kind", KINDS)
    names = _chosen((recording,), signals, kind)
    rows = tuple(_row(name, (recording,), (0.0,), kind) for name in names)
    is_time = kind == "time"
    chart = Chart(_title(recording), rows, marks=_marks(recording) if is_time else ())
    return Chart(chart.title, rows, _bands(recording, *chart.times), chart.marks) if is_time else chart


def compare(
    recordings: Sequence[RecordedData], *, signals: Sequence[str] = (), kind: Kind = "time", at: str = ""
) -> Chart:
    """Recordings on each other, from the same event on.

    Args:
        recordings: two to four; the first is drawn solid, the others dashed, dotted and dash-dotted.
        signals: as in `chart_of`, which all of them have.
        kind: as in `chart_of`.
        at: the event at which the times of all are zero: the text of a note or the name of an event, such as
            "ConditionFired"; the first of it counts. Empty: the begin of the first motion.

    Raises:
        CommandRejected: another number of recordings, no such signal or event in one of them, or nothing to draw.
    """
    if not 2 <= len(recordings) <= _MOST_COMPARED:
        raise CommandRejected(
            f"recordings must be 2 to {_MOST_COMPARED}, got {len(recordings)}",
            parameter="recordings",
            value=len(recordings),
            allowed=f"2 to {_MOST_COMPARED}",
        )
    word(kind, "kind", KINDS)
    names = _chosen(recordings, signals, kind)
    zeros = [_zero(recording, at) for recording in recordings]
    rows = tuple(_row(name, recordings, zeros, kind) for name in names)
    patterns = ("solid", "dashed", "dotted", "dash-dotted")
    files = ", ".join(
        f"{recording.path.name} ({pattern})" for recording, pattern in zip(recordings, patterns, strict=False)
    )
    if kind != "time":
        return Chart(files, rows)
    return Chart(
        f"{files}, aligned at {at or 'their first motions'}", rows, marks=(Mark(0.0, at or "first motion"),)
    )


# --------------------------------------------------------------------------------------------------- parts


def _chosen(recordings: Sequence[RecordedData], signals: Sequence[str], kind: Kind) -> list[str]:
    """Names to draw, checked."""
    if signals:
        for name in signals:
            instance(name, str, "signals")
            if name == PATH and kind != "time":
                raise CommandRejected(
                    f"a {kind} must be of signals, got {PATH!r}",
                    parameter="signals",
                    value=name,
                    hint="draw xyz, the position of the motion frame",
                )
            for recording in recordings:
                array = recording["xyz" if name == PATH else name]
                if array.dtype.kind not in "fiu":
                    raise CommandRejected(
                        f"signal {name!r} has no numbers to draw", parameter="signals", value=name
                    )
        return list(signals)
    found = [
        name
        for name in (USUAL if kind == "time" else USUAL[:-1])
        if all(_has_numbers(recording, "xyz" if name == PATH else name) for recording in recordings)
    ]
    if not found:
        raise CommandRejected(
            "there is nothing to draw: the recording has no states",
            parameter="signals",
            hint="record with a state rate above 0",
        )
    return found


def _has_numbers(recording: RecordedData, name: str) -> bool:
    return name in recording and len(recording[name]) > 1 and not bool(np.isnan(recording[name]).all())


def _title(recording: RecordedData) -> str:
    facts = recording.facts
    where = facts.get("title", "") + (" (virtual)" if facts.get("virtual") == "true" else "")
    reason = f", black box: {facts['black_box']}" if "black_box" in facts else ""
    return f"{recording.path.name}: {where}, {recording.duration:.1f} s{reason}"


def _zero(recording: RecordedData, at: str) -> float:
    """The time of the event at which recordings are aligned [s]."""
    if not at:
        return recording.motions[0].begin if recording.motions else 0.0
    for event in recording.events:
        if at in ((event.text, event.name) if event.kind == NOTE else (event.name,)):
            return event.t
    known = ", ".join(
        dict.fromkeys(repr(event.text if event.kind == NOTE else event.name) for event in recording.events)
    )
    raise CommandRejected(
        f"{recording.path.name} has no event {shown(at)}; it has {known or 'none'}",
        parameter="at",
        value=at,
        allowed=known or "none",
    )


def _row(name: str, recordings: Sequence[RecordedData], zeros: Sequence[float], kind: Kind) -> ChartRow:
    if name == PATH:
        lines = tuple(
            path_line(recording["xyz"], recording.path.name, index)
            for index, recording in enumerate(recordings)
        )
        return path_row("motion frame", lines)
    short = name.removeprefix(FRI)
    quantity = _QUANTITIES.get(short, _Quantity(short))
    by_limit = _by_limit(recordings[0].robot, quantity) if kind == "time" else None
    factor = quantity.factor if by_limit is None else 1.0 / by_limit
    columns = [
        (recording[name][:, None] if recording[name].ndim == 1 else recording[name]) * factor
        for recording in recordings
    ]
    times = [
        recording[f"{FRI}t" if name.startswith(FRI) else "t"] - zero
        for recording, zero in zip(recordings, zeros, strict=True)
    ]
    label = labels(name, columns[0].shape[1]) if columns[0].shape[1] > 1 else ("",)
    least, unit = (quantity.least, quantity.unit) if by_limit is None else (0.0, "fraction of limit")

    def lines_of(
        points: Callable[[int, int], tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]],
    ) -> tuple[Line, ...]:
        return tuple(
            Line(*points(run, column), label=label[column] if run == 0 else "", colour=column, dash=run)
            for run, values in enumerate(columns)
            for column in range(values.shape[1])
        )

    if kind == "time":
        lines = lines_of(lambda run, column: (times[run], columns[run][:, column]))
        return ChartRow(
            quantity.title, unit, lines, least=least, edges=() if by_limit is None else (-1.0, 1.0)
        )
    if kind == "histogram":
        low, high = extremes(columns)
        room = max(0.0, least - (high - low)) / 2 or (0.5 if high == low else 0.0)
        bins = np.linspace(low - room, high + room, _BINS + 1)
        lines = lines_of(lambda run, column: _histogram(columns[run][:, column], bins))
        return ChartRow("samples", "%", lines, f"{quantity.title} [{unit}]", is_time=False)
    lines = lines_of(lambda run, column: _spectrum(name, times[run], columns[run][:, column], least))
    return ChartRow(quantity.title, f"{unit}/√Hz", lines, "frequency [Hz]", is_time=False, is_log=True)


def path_line(xyz: npt.NDArray[np.float64], label: str, index: int = 0) -> Line:
    """A path in space, shape (n, 3) [m], as the line of that number."""
    known = xyz[~np.isnan(xyz).any(axis=1)] * 1e3
    x, y, z = known.T
    return Line(x, y, z, label, index, index)


def path_row(frame: str, lines: tuple[Line, ...], crosses: npt.NDArray[np.float64] | None = None) -> ChartRow:
    """A row with paths of that frame."""
    return ChartRow(
        f"path of the {frame} (circle: begin, square: end)",
        "mm",
        lines,
        is_time=False,
        is_path=True,
        crosses=crosses,
    )


def _by_limit(robot: RobotModel | None, quantity: _Quantity) -> npt.NDArray[np.float64] | None:
    """What speeds and torques are divided by, shape (7,)."""
    return np.asarray(getattr(robot, quantity.limit), float) if robot and quantity.limit else None


def _histogram(
    values: npt.NDArray[np.float64], bins: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Steps: the fraction of the samples in each bin [%]."""
    known = values[np.isfinite(values)]
    counts = np.histogram(known, bins)[0] * (100.0 / max(1, len(known)))
    return np.repeat(bins, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])


def _spectrum(
    name: str, t: npt.NDArray[np.float64], values: npt.NDArray[np.float64], least: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Frequencies [Hz] and amplitude spectral density [unit/√Hz] by Welch's method, one-sided, without the mean."""
    known = np.isfinite(values)
    times, rows = np.unique(t[known], return_index=True)
    if len(times) < _FEWEST:
        raise CommandRejected(
            f"a spectrum needs {_FEWEST} samples or more, {name!r} has {len(times)}",
            parameter="signals",
            value=name,
            allowed=f"{_FEWEST} samples or more",
        )
    period = float(np.median(np.diff(times)))
    # states come with jitter and gaps: the method needs equal steps
    even = np.interp(np.arange(times[0], times[-1], period), times, values[known][rows])
    size = min(_SEGMENT, len(even))
    window = np.hanning(size)
    segments = np.lib.stride_tricks.sliding_window_view(even, size)[:: max(1, size // 2)]
    parts = np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window, axis=1)
    density = 2.0 * (np.abs(parts) ** 2).mean(axis=0) * period / float((window**2).sum())
    amplitude = np.sqrt(density[1:])
    amplitude[amplitude < _FLOOR * (least or 1.0)] = np.nan
    return np.asarray(np.fft.rfftfreq(size, period)[1:], np.float64), amplitude


def _bands(recording: RecordedData, first: float, last: float) -> tuple[Band, ...]:
    """Motions; a part of a recording has motions that began before it or end behind it."""
    return tuple(
        Band(max(motion.begin, first), last if np.isnan(motion.end) else min(motion.end, last), motion.text)
        for motion in recording.motions
    )


def _marks(recording: RecordedData) -> tuple[Mark, ...]:
    """Notes and important events."""
    return tuple(
        Mark(event.t, event.text if event.kind == NOTE else event.name, is_alarm=event.kind != NOTE)
        for event in recording.events
        if event.kind in (NOTE, "error") or event.name in _MARKED
    )
