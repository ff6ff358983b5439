"""Episodes read back: everything in equal steps of the robot's clock, for learning.

At each step stands what was the newest then, of states, streams and pictures alike; what is older than a step counts as
dropped. The first step is the one at which everything has arrived once.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, overload

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.record.episodes import (
    ACTION,
    FASTEST,
    LABEL,
    LABELS,
    NUMBER,
    RATE,
    REASON,
    TASK,
    Label,
    episode_files,
    label_filter,
)
from heptarm.record.pictures import decoded, size_of
from heptarm.record.recording import Recording, load
from heptarm.values.checks import Array, frozen, instance, within
from heptarm.values.files import path_of
from heptarm.values.sealed import Sealed
from heptarm.values.text import counted, lines

_log = logging.getLogger("heptarm.record")

#: Signals of the states that steps have, with their numbers.
SIGNALS = {"q": 7, "dq": 7, "tau_ext": 7, "pose": 7, "wrench": 6}
#: Files that are named where they could not be read; the warnings name all.
_NAMED = 5
#: A sample at the end of a step still belongs to it [s].
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Demonstration:
    """An episode in equal steps; made by `load_episodes`.

    Attributes:
        path: the file.
        number: of the episode in its folder.
        task: what was done, in words.
        label: "success", "failure", "unlabelled", or "unfinished" if it was cut off.
        reason: of the label, in words.
        robot: model, such as "iiwa14".
        rate: steps per second [Hz].
        t: times of the steps, shape (n,) [s].
        signals: "q", "dq", "tau_ext", "pose" and "wrench" of the states, as far as they were recorded, and the streams,
            by name, shape (n, m) each.
        action: what was commanded at each step: by `Episode.act`, otherwise the joints' set-points of the next step,
            shape (n, m).
        corrected: whether a person corrected a policy then, shape (n,).
        views: pictures at each step as JPEG files, by the name of the camera.
        dropped: steps at which there was nothing new, by the name of the stream or camera; "state" for the states.
    """

    path: Path
    number: int
    task: str
    label: Label
    reason: str
    robot: str
    rate: float
    t: Array
    signals: Mapping[str, Array]
    action: Array
    corrected: npt.NDArray[np.bool_]
    views: Mapping[str, tuple[bytes, ...]]
    dropped: Mapping[str, int]

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        """Signal or stream by its name; raises CommandRejected, and lists them, if there is none."""
        if name in self.signals:
            return self.signals[name]
        known = ", ".join(self.signals)
        if not len(self):
            raise CommandRejected(
                f"{self.path.name} has no steps, and must have some for {name!r}; it has {known}",
                parameter="name",
                value=name,
                hint="leave out episodes without steps: if len(episode)",
            )
        raise CommandRejected(f"name must be one of {known}, got {name!r}", parameter="name", value=name)

    @property
    def duration(self) -> float:
        """From the first to the last step [s]."""
        return float(self.t[-1] - self.t[0]) if len(self.t) else 0.0

    def __str__(self) -> str:
        """One line."""
        drops = ", ".join(f"{name} {count}" for name, count in self.dropped.items() if count)
        fixes = f", {int(self.corrected.sum())} corrected" if self.corrected.any() else ""
        why = f" ({self.reason})" if self.reason else ""
        return (
            f"{self.path.name}  {self.label}{why}  {self.duration:.1f} s, {counted(len(self), 'step')}"
            f"{f', dropped: {drops}' if drops else ''}{fixes}  {self.task}"
        )

    def __repr__(self) -> str:
        """Short form."""
        return f"<Demonstration {self.path.name}, {self.label}, {counted(len(self), 'step')}>"


@dataclass(frozen=True, eq=False)
class SignalStatistics:
    """How the numbers of a signal are spread over all steps of all episodes; shape (m,) each.

    Attributes:
        min: least.
        max: largest.
        mean: mean.
        std: standard deviation.
    """

    min: Array
    max: Array
    mean: Array
    std: Array


class Demonstrations(Sealed, Sequence[Demonstration]):
    """Episodes of a folder; made by `load_episodes`.

    Attributes:
        folder: where they are.
        unreadable: files of the folder that could not be read, and were left out.
    """

    folder: Final[Path]
    unreadable: Final[tuple[Path, ...]]

    def __init__(
        self, folder: Path, episodes: Iterable[Demonstration], *, unreadable: Iterable[Path] = ()
    ) -> None:
        self.folder, self._episodes = folder, tuple(episodes)
        self.unreadable = tuple(unreadable)

    def __len__(self) -> int:
        """Number of episodes."""
        return len(self._episodes)

    @overload
    def __getitem__(self, index: int) -> Demonstration: ...
    @overload
    def __getitem__(self, index: slice) -> Demonstrations: ...
    def __getitem__(self, index: int | slice) -> Demonstration | Demonstrations:
        """An episode by its place, or several."""
        if isinstance(index, slice):
            return Demonstrations(self.folder, self._episodes[index], unreadable=self.unreadable)
        return self._episodes[index]

    @property
    def labels(self) -> dict[str, int]:
        """Number of episodes by label."""
        counts = Counter(episode.label for episode in self._episodes)
        return {label: counts[label] for label in LABELS if counts[label]}

    @property
    def _left_out(self) -> str:
        """How many files could not be read, and the first of them; "": none."""
        names = [path.name for path in self.unreadable]
        more = ", ..." if len(names) > _NAMED else ""
        return f"{counted(len(names), 'file')}: {', '.join(names[:_NAMED])}{more}" if names else ""

    def statistics(self) -> dict[str, SignalStatistics]:
        """Least, largest, mean and standard deviation of each signal, stream and the action, by name.

        A number that never changes, or is far outside of the others, shows here before a policy learns from it.

        Raises:
            CommandRejected: the episodes have different numbers of a signal.
        """
        found = {}
        for name in dict.fromkeys(name for episode in self for name in (*episode.signals, ACTION)):
            parts = [episode.action if name == ACTION else episode.signals.get(name) for episode in self]
            rows = [part for part in parts if part is not None and len(part)]
            sizes = sorted({part.shape[1] for part in rows})
            if len(sizes) > 1:
                raise CommandRejected(
                    f"all episodes must have the same numbers of {name}, got {' and '.join(map(str, sizes))}",
                    parameter="episodes",
                    hint="choose episodes of one kind: load_episodes(folder)[first:last]",
                )
            if rows:
                whole = np.concatenate(rows)
                spread = (whole.min(axis=0), whole.max(axis=0), whole.mean(axis=0), whole.std(axis=0))
                found[name] = SignalStatistics(*map(frozen, spread))
        return found

    def __str__(self) -> str:
        """A few lines: how many of which label, how long, what was dropped."""
        steps, dropped = sum(map(len, self._episodes)), Counter[str]()
        for episode in self._episodes:
            dropped.update(episode.dropped)
        durations = [episode.duration for episode in self._episodes]
        rows = {
            "episodes": ", ".join(f"{count} {label}" for label, count in self.labels.items()),
            "duration": f"{sum(durations):.1f} s, median {np.median(durations):.1f} s" if durations else "",
            "steps": str(steps),
            "dropped": ", ".join(f"{name} {count}" for name, count in dropped.items() if count),
            "corrected": str(sum(int(episode.corrected.sum()) for episode in self._episodes) or ""),
            "unreadable": self._left_out,
            "tasks": "; ".join(dict.fromkeys(episode.task for episode in self._episodes if episode.task)),
        }
        return lines(f"{counted(len(self), 'episode')} in {self.folder}", rows)

    def __repr__(self) -> str:
        """Short form."""
        return f"<Demonstrations {self.folder}, {counted(len(self), 'episode')}>"


def load_episodes(
    folder: str | Path, *, labels: Iterable[str] = LABELS, rate: float | None = None
) -> Demonstrations:
    """Read the episodes that `Arm.episodes` has recorded to a folder.

    A file that cannot be read is left out with a warning that names it, and is in `Demonstrations.unreadable`.

    Args:
        folder: of the files.
        labels: which ones: "success", "failure", "unlabelled", "unfinished".
        rate: steps per second [Hz]; None: that with which each was recorded.

    Raises:
        CommandRejected: there is no such folder, it has no episodes, or none that can be read; or no such label.
        LimitError: a rate outside its range.
        MissingExtra: the package mcap is not installed.
    """
    where, chosen = path_of(folder, "folder"), label_filter(labels)
    steps = None if rate is None else within(rate, "rate", 0.0, FASTEST, above=True, unit="Hz")
    files = episode_files(where)
    if not files:
        raise CommandRejected(
            f"{where} has no episodes",
            parameter="folder",
            value=str(where),
            hint="arm.episodes(folder) records them as episode-00000.mcap and so on",
        )
    found: list[Demonstration] = []
    failures: dict[Path, ValueError] = {}
    for _, path in files:
        try:
            found.append(in_steps(load(path), rate=steps))
        except ValueError as error:  # of this file alone, CommandRejected above all: the others are read
            failures[path] = error
    if not found:
        path, first = next(iter(failures.items()))
        if len(failures) == 1 and isinstance(first, CommandRejected):
            raise first
        raise CommandRejected(
            f"{where} must have episodes that can be read, got none among {counted(len(failures), 'file')}; "
            f"{path.name}: {first}",
            parameter="folder",
            value=str(where),
            hint="record them again, or choose another folder",
        ) from first
    for path, failure in failures.items():
        _log.warning("%s cannot be read and is left out: %s", path.name, failure)
    chosen_ones = (episode for episode in found if episode.label in chosen)
    return Demonstrations(where, chosen_ones, unreadable=failures)


def in_steps(recording: Recording, *, rate: float | None = None) -> Demonstration:
    """The equal steps of an episode.

    Args:
        recording: of the episode.
        rate: steps per second [Hz]; None: that with which it was recorded.

    Raises:
        CommandRejected: it is no episode.
    """
    run = instance(recording, Recording, "recording")
    facts = run.facts
    if RATE not in facts:
        raise CommandRejected(
            f"{run.path} must be an episode, it is another recording",
            parameter="recording",
            value=str(run.path),
            hint="arm.episodes(folder) records episodes",
        )
    steps = float(facts[RATE]) if rate is None else rate
    times = {"state": run.t[np.isfinite(run["q"]).all(axis=1)] if "q" in run and len(run) else np.zeros(0)}
    times |= {name: stream.t for name, stream in run.streams.items() if name != ACTION}
    times |= {name: view.t for name, view in run.views.items()}
    grid = _grid(times, steps)
    places = {name: newest(t, grid, period=1.0 / steps) for name, t in times.items()}
    rows = (
        np.flatnonzero(np.isfinite(run["q"]).all(axis=1))[places["state"][0]]
        if len(grid)
        else np.zeros(0, int)
    )
    signals = {
        name: frozen(run[name][rows])
        for name, size in SIGNALS.items()
        if name in run and run[name].shape[1:] == (size,) and np.isfinite(run[name][rows]).any()
    }
    if not len(grid):  # of those, everything of the states is empty
        signals = {name: frozen(np.zeros((0, size))) for name, size in SIGNALS.items()}
    for name, stream in run.streams.items():
        if name != ACTION:
            signals[name] = frozen(stream.values[places[name][0]] if len(grid) else stream.values[:0])
    corrected = np.zeros(len(grid), bool)
    for begin, end in run.corrections:
        corrected |= (grid >= begin) & (grid <= end)
    label: Label = "unfinished"
    for known in LABELS:
        if run.complete and run.outcome.get(LABEL) == known:
            label = known
    return Demonstration(
        run.path,
        int(facts.get(NUMBER, "0")),
        facts.get(TASK, ""),
        label,
        run.outcome.get(REASON, ""),
        facts.get("robot", ""),
        steps,
        frozen(grid),
        signals,
        frozen(_actions(run, rows, grid)),
        corrected,
        {
            name: tuple(view.files[index] for index in places[name][0]) if len(grid) else ()
            for name, view in run.views.items()
        },
        {name: count for name, (_, count) in places.items()},
    )


def of_one_kind(episodes: Iterable[Demonstration]) -> list[Demonstration]:
    """The episodes that have steps, for a data set.

    Raises:
        CommandRejected: there are none, or they differ in signals, streams, cameras, actions or rate; or a camera has
            pictures of several sizes.
    """
    used = [episode for episode in episodes if len(episode)]
    if not used:
        raise CommandRejected(
            "there must be episodes with steps, got none",
            parameter="episodes",
            hint="choose other labels, or record some with arm.episodes(...)",
        )
    for episode in used:
        _check_pictures(episode)
    first, kind = used[0], _kind(used[0])
    for episode in used[1:]:
        other = _kind(episode)
        if other != kind:
            names = sorted(set(other.items()) ^ set(kind.items()), key=str)
            raise CommandRejected(
                f"all episodes must have the same streams, cameras and rate; {episode.path.name} and "
                f"{first.path.name} differ in {', '.join(dict.fromkeys(name for name, _ in names))}",
                parameter="episodes",
                value=str(episode.path),
                hint="delete the episode, or convert a folder for each kind",
            )
    return used


def _check_pictures(episode: Demonstration) -> None:
    """Refuse an episode in which a camera has changed the size of its pictures.

    Raises:
        CommandRejected: one has.
    """
    for name, files in episode.views.items():
        sizes = dict.fromkeys(size_of(file) for file in dict.fromkeys(files))
        if len(sizes) > 1:
            found = " and ".join(f"{width} x {height}" for width, height in sizes)
            raise CommandRejected(
                f"the camera {name} must have pictures of one size in an episode, "
                f"got {found} pixels (width x height) in {episode.path.name}",
                parameter="episodes",
                value=str(episode.path),
                hint="delete the episode, or leave it out",
            )


def _kind(episode: Demonstration) -> dict[str, object]:
    """What the episodes of a data set have in common."""
    kind: dict[str, object] = {name: values.shape[1] for name, values in episode.signals.items()}
    kind |= {f"the camera {name}": decoded(files[0]).shape for name, files in episode.views.items()}
    return kind | {"action": episode.action.shape[1], "rate": episode.rate}


def _grid(times: Mapping[str, Array], rate: float) -> Array:
    """Times of the steps: from when everything has arrived once to the last state [s]."""
    if not all(len(t) for t in times.values()):
        return np.zeros(0)
    begin, end = max(float(t[0]) for t in times.values()), float(times["state"][-1])
    return begin + np.arange(max(0, int((end - begin) * rate + _ROUNDING) + 1)) / rate


def newest(t: Array, grid: Array, *, period: float) -> tuple[npt.NDArray[np.intp], int]:
    """Index of the newest sample at each step, and at how many steps it is older than a period.

    Args:
        t: times of the samples, ascending, shape (n,) [s].
        grid: times of the steps, shape (m,) [s].
        period: time between two steps [s].
    """
    index = np.maximum(np.searchsorted(t, grid + _ROUNDING, side="right") - 1, 0)
    if not len(grid):
        return index, 0
    return index, int((grid - t[index] > period + _ROUNDING).sum())


def _actions(run: Recording, rows: npt.NDArray[np.intp], grid: Array) -> Array:
    """What was commanded at each step, shape (n, m)."""
    given = run.streams.get(ACTION)
    if not len(grid):
        return np.zeros((0, 7 if given is None else given.values.shape[1]))
    if given is not None:
        return np.asarray(given.values[newest(given.t, grid, period=1.0)[0]])
    commanded = run["q_cmd"][rows] if "q_cmd" in run else run["q"][rows]
    commanded = np.where(np.isfinite(commanded), commanded, run["q"][rows])
    return np.vstack([commanded[1:], commanded[-1:]])
