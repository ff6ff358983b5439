"""What a recording holds: arrays by signal name, motions, events; parts of it and tables of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.record.journal import CORRECTION, NOTE
from heptarm.record.pictures import Pictures
from heptarm.record.samples import to_frame
from heptarm.values.checks import Array, choice, finite, flag, shown
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.notebook import as_html
from heptarm.values.robot import RobotModel, known_robot
from heptarm.values.text import lines


@dataclass(frozen=True, eq=False)
class RecordedNumbers:
    """Numbers that a program has recorded beside the states; `heptarm.load(...).streams`.

    Attributes:
        t: times of the recording, shape (n,) [s].
        values: shape (n, m).
    """

    t: Array
    values: Array

    def __len__(self) -> int:
        """How many there are."""
        return len(self.t)

    def between(self, begin: float, end: float) -> RecordedNumbers:
        """Those of a time of the recording [s]."""
        inside = _within(self.t, begin, end)
        return RecordedNumbers(self.t[inside], self.values[inside])


_Data = TypeVar("_Data", bound="RecordedData")
#: Before the names of signals of FRI cycles, which have their own times: "fri.t".
FRI = "fri."


@dataclass(frozen=True)
class RecordedEvent:
    """Something that happened.

    Attributes:
        t: when, on the time line of the recording [s].
        kind: "request", "refusal", "event", "error", "note", "fri", "signals" or "correction".
        name: of the message, such as "MotionFinished".
        text: one line for people.
        content: everything, as plain data.
        id: of the program that a request began; 0 elsewhere.
    """

    t: float
    kind: str
    name: str
    text: str
    content: Mapping[str, Any] = field(default_factory=dict, compare=False)
    id: int = 0

    def __str__(self) -> str:
        """One line."""
        return f"{self.t:9.3f} s  {self.kind:8}  {self.text}"


@dataclass(frozen=True)
class RecordedMotion:
    """A program of motions.

    Attributes:
        id: the cabinet's number of it.
        text: its motions in a few words; that of another client is described by its number only.
        begin: when it began [s].
        end: when it ended [s]; NaN: it did not in this recording.
        cause: why it ended, such as "finished"; empty: unknown.
        detail: the cabinet's explanation.
    """

    id: int
    text: str
    begin: float
    end: float
    cause: str = ""
    detail: str = ""

    def __str__(self) -> str:
        """One line."""
        why = f"{self.cause}{': ' + self.detail if self.detail else ''}"
        return f"{self.begin:9.3f} to {self.end:9.3f} s  motion {self.id}: {self.text}  {why}".rstrip()


@dataclass(frozen=True, eq=False)
class RecordedData:
    """What a recording holds, apart from figures of it; see `heptarm.record.recording.Recording`.

    Attributes:
        path: the file.
        facts: texts about robot and connection: "robot", "software", "cabinet", "rate", ...
        signals: arrays by name; those of pushed states have as many rows as `t`, those that begin with "fri." as many
            as "fri.t".
        motions: programs in the order of their beginning.
        events: what happened, in order.
        complete: the file has its end; otherwise it was cut off, and what is here is all up to its last whole chunk.
        lost: states and FRI cycles that could not be recorded; only known of a complete file.
        damage: where and how the file is damaged; what is here is all before that. Empty: it is not.
        pictures: of a simulated camera, if there was one.
        views: pictures of the cameras of an episode, by their names.
        streams: numbers of the streams of an episode, by their names.
        outcome: texts of the end of a complete file.
    """

    path: Path
    facts: Mapping[str, str]
    signals: Mapping[str, npt.NDArray[Any]]
    motions: tuple[RecordedMotion, ...]
    events: tuple[RecordedEvent, ...]
    complete: bool
    lost: int = 0
    pictures: Pictures = field(default_factory=Pictures)
    damage: str = ""
    views: Mapping[str, Pictures] = field(default_factory=dict)
    streams: Mapping[str, RecordedNumbers] = field(default_factory=dict)
    outcome: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """Array of a signal, such as "q", "fri.tau" or "t".

        Raises:
            CommandRejected: there is none of that name; the text lists them.
        """
        return choice(name, "name", self.signals)

    def __contains__(self, name: object) -> bool:
        """Whether there is a signal of that name."""
        return name in self.signals

    def __len__(self) -> int:
        """Number of pushed states."""
        return len(self.t)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the signals."""
        return tuple(self.signals)

    @property
    def t(self) -> Array:
        """Times of the pushed states, shape (n,) [s]."""
        return self.signals["t"]

    @property
    def duration(self) -> float:
        """From the first to the last pushed state, or FRI cycle if there are no states [s]."""
        t = self.t if len(self.t) else self.signals.get(f"{FRI}t", self.t)
        return float(t[-1] - t[0]) if len(t) else 0.0

    @property
    def robot(self) -> RobotModel | None:
        """The robot, with its limits; None: unknown to this version."""
        return known_robot(self.facts.get("robot", ""))

    @property
    def notes(self) -> tuple[RecordedEvent, ...]:
        """The marks that `Recorder.note` has put."""
        return tuple(event for event in self.events if event.kind == NOTE)

    @property
    def corrections(self) -> Array:
        """Times in which a person corrected a policy, from begin to end, shape (n, 2) [s]; see `JointServo.correct`."""
        found: list[tuple[float, float]] = []
        begin: float | None = None
        for event in self.events:
            if event.kind == CORRECTION and event.text == "begins":
                begin = event.t
            elif event.kind == CORRECTION and begin is not None:
                found.append((begin, event.t))
                begin = None
        if begin is not None:
            found.append((begin, float(self.t[-1]) if len(self) else begin))
        return np.array(found, dtype=np.float64).reshape(-1, 2)

    def between(self: _Data, begin: float | str, end: float | str) -> _Data:
        """A part of the recording; its times stay those of the whole.

        Args:
            begin: time [s], text of a note, or "begin".
            end: likewise, or "end".

        Raises:
            CommandRejected: there is no note with that text, or the end is before the beginning.
        """
        first, last = self._moment(begin, "begin"), self._moment(end, "end")
        if last < first:
            raise CommandRejected(
                f"end must not be before begin at {first:.3f} s, got {last:.3f} s",
                parameter="end",
                value=end,
                allowed=f"from {first:.3f} s on",
                hint="exchange them; of notes with the same text the first one counts",
            )
        masks = {prefix: _within(self.signals.get(f"{prefix}t"), first, last) for prefix in ("", FRI)}
        signals = {
            name: values[masks[FRI if name.startswith(FRI) else ""]] for name, values in self.signals.items()
        }
        return replace(
            self,
            signals=signals,
            motions=tuple(
                motion for motion in self.motions if motion.begin <= last and not motion.end < first
            ),
            events=tuple(event for event in self.events if first <= event.t <= last),
            pictures=self.pictures.between(first, last),
            views={name: view.between(first, last) for name, view in self.views.items()},
            streams={name: stream.between(first, last) for name, stream in self.streams.items()},
        )

    def _moment(self, when: float | str, name: str) -> float:
        """Time of a mark [s]."""
        if not isinstance(when, str):
            return finite(when, name, unit="s")
        for note in self.notes:
            if note.text == when:
                return note.t
        if when in ("begin", "end"):
            return -np.inf if when == "begin" else np.inf
        known = ", ".join(repr(note.text) for note in self.notes) or "none"
        raise CommandRejected(
            f"there is no note {shown(when)}; there are {known}", parameter=name, value=when, allowed=known
        )

    def trajectory(self) -> Trajectory:
        """The measured joint positions over time, to be trimmed, thinned and replayed; see `Arm.replay`.

        Without pushed states those of the FRI cycles.

        Raises:
            CommandRejected: fewer than two positions were recorded.
        """
        for prefix in ("", FRI):
            t, q = self.signals.get(f"{prefix}t"), self.signals.get(f"{prefix}q")
            if t is None or q is None:
                continue
            known = ~np.isnan(q).any(axis=1)
            times, rows = np.unique(t[known], return_index=True)
            if len(times) > 1:
                return Trajectory.of(times, q[known][rows], robot=self.facts.get("robot", ""))
        raise CommandRejected(
            f"{self.path.name} has fewer than 2 joint positions, so that there is no trajectory",
            parameter="path",
            value=str(self.path),
            hint='record the state group "joints", and while the arm moves',
        )

    def to_pandas(self, *, fri: bool = False) -> Any:
        """The signals of the pushed states as a `pandas.DataFrame` over `t`, a column per number, such as "q.A1".

        Args:
            fri: those of the FRI cycles instead.

        Raises:
            MissingExtra: pandas is not installed.
        """
        prefix = FRI if flag(fri, "fri") else ""
        chosen = {
            name.removeprefix(prefix): values
            for name, values in self.signals.items()
            if name.startswith(FRI) == fri
        }
        return to_frame(chosen, require("pandas", extra="record").DataFrame)

    def __str__(self) -> str:
        """A few lines: what is in it."""
        rate = (len(self) - 1) / self.duration if self.duration else 0.0
        ending = (
            f", damaged {self.damage}" if self.damage else "" if self.complete else ", cut off at its end"
        )
        title = f"{self.path.name}: {self.facts.get('title', 'robot unknown')}, {self.duration:.2f} s{ending}"
        rows = {
            "states": f"{len(self)} at {rate:.0f} Hz, {self.lost} lost",
            "FRI": f"{len(self.signals[f'{FRI}t'])} cycles" if f"{FRI}t" in self.signals else "",
            "pictures": f"{len(self.pictures)}, {self.pictures.dropped} dropped"
            if len(self.pictures)
            else "",
            "motions": str(len(self.motions)),
            "events": f"{len(self.events)}, {len(self.notes)} notes",
        }
        return lines(title, rows)

    def _repr_html_(self) -> str:
        """The same as a table for a notebook."""
        return as_html(str(self))

    def __repr__(self) -> str:
        """Short form."""
        return f"<Recording {self.path.name}, {len(self)} states, {self.duration:.2f} s>"


def _within(t: npt.NDArray[Any] | None, first: float, last: float) -> npt.NDArray[np.bool_]:
    return np.zeros(0, bool) if t is None else (t >= first) & (t <= last)
