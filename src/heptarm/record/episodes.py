"""Episodes: demonstrations and trials of a task, each a recording of its own with a label, for learning.

An episode is a recording of the arm as any other, and beside it what cameras, sensors and the program gave, each at
its own time and rate. Nothing is aligned here: `heptarm.record.demonstration` does so when an episode is read, so that
nothing is lost, and another rate can be chosen afterwards.
"""

from __future__ import annotations

import io
import logging
import re
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, HeptarmError, LocalProtocolError, ShapeError, StaleState, require
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.recorder import Recorder, RecordSource
from heptarm.values.camera import Picture
from heptarm.values.checks import finite_entries, instance, integer, numbers, shown, within
from heptarm.values.files import make_folder
from heptarm.values.frames import check_printable
from heptarm.values.sealed import Sealed
from heptarm.values.text import counted, printable

_log = logging.getLogger("heptarm.record")

Label: TypeAlias = Literal["success", "failure", "unlabelled", "unfinished"]
#: Labels of an episode; an unfinished one was cut off.
LABELS: tuple[Label, ...] = ("success", "failure", "unlabelled", "unfinished")
#: What is recorded of a sensor: a function that returns numbers, or None where there is nothing new.
NumberSource: TypeAlias = Callable[[], Any]
_Shape: TypeAlias = tuple[int, ...]
#: Name of the stream of what the program commands; see `Episode.act`.
ACTION = "action"
#: Facts at the beginning of an episode's file, and at its end.
TASK, RATE, NUMBER, LABEL, REASON = "episode_task", "episode_rate", "episode_number", "label", "reason"
#: A stream or camera that is silent for so long during an episode has stalled [s].
STALL = 2.0
#: Fastest steps [Hz], quality of the pictures as JPEG files, most numbers of a stream, longest text.
FASTEST, _QUALITY, _MOST, _LONGEST = 500.0, 92, 1000, 1000
#: Highest number of an episode.
_LAST = 10**9
#: After a failure a function is called again so much later [s].
_RETRY = 0.1
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_FILE = re.compile(r"episode-(\d{5,})\.mcap")


class PictureStream(Protocol):
    """Live pictures; a `CameraStream` is one."""

    def read(self, *, timeout: float = ...) -> Picture:
        """The next picture; raises Timeout."""
        ...

    def close(self) -> None:
        """End it."""
        ...


def episode_files(folder: Path) -> list[tuple[int, Path]]:
    """Numbers and files of the episodes in a folder, in order."""
    found = [(match, path) for path in folder.glob("episode-*.mcap") if (match := _FILE.fullmatch(path.name))]
    return sorted((int(match.group(1)), path) for match, path in found)


def next_number(folder: Path) -> int:
    """Number of the next episode in a folder."""
    files = episode_files(folder)
    return files[-1][0] + 1 if files else 0


class _Feed:
    """What arrives beside the states, each with its time; written while an episode runs.

    Args:
        name: of the camera or the stream.
        clock: reads our clock [ns].
        write: writes one piece of it.
    """

    def __init__(
        self, name: str, clock: Callable[[], int], write: Callable[[RecordingFile, int, Any], None]
    ) -> None:
        self.name, self._clock, self._write = name, clock, write
        self._arrived: deque[tuple[int, Any]] = deque()
        self._begin: int | None = None
        self._last = 0
        self.longest = 0.0
        self.count = 0
        self.failure: Exception | None = None
        self.defect = ""
        self._shape: _Shape | None = None
        self._shape_before: _Shape | None = None

    def begin(self) -> None:
        """Begin an episode: what arrived before is not its."""
        self._arrived.clear()
        self._shape_before = self._shape
        self.defect, self.failure = "", None
        self.longest, self.count = 0.0, 0
        self._begin = self._last = self._clock()

    def end(self) -> None:
        """End the episode."""
        self.look()
        self._begin = None

    def forget(self) -> None:
        """Have a shape that came with this episode bind no other one."""
        self._shape = self._shape_before

    def misfit(self, shape: _Shape) -> _Shape | None:
        """The shape of what came before, if it is another one; None: this one fits."""
        if self._shape is None:
            self._shape = shape
        return None if shape == self._shape else self._shape

    def look(self) -> float:
        """The longest silence of this episode so far [s]."""
        if self._begin is not None:
            self.longest = max(self.longest, (self._clock() - self._last) * 1e-9)
        return self.longest

    def add(self, at: int, content: Any) -> None:
        """Take something that is of a time of our clock [ns]."""
        if self._begin is not None and at >= self._begin:
            now = self._clock()
            self.longest = max(self.longest, (now - self._last) * 1e-9)
            self._last = now
            self.count += 1
            self._arrived.append((at, content))

    def add_if_fit(
        self, at: int, content: Any, shape: _Shape, reason: Callable[[_Shape, _Shape], str]
    ) -> None:
        """Take what a thread of ours has read; in an episode another shape than before is a defect.

        Args:
            at: time of our clock [ns].
            content: what is written.
            shape: its shape.
            reason: makes words of the shape before and this one.
        """
        if self._begin is None or at < self._begin:
            return
        if (before := self.misfit(shape)) is None:
            self.add(at, content)
        elif not self.defect:
            self.defect = f"{self.name} {reason(before, shape)}"

    def write(self, file: RecordingFile) -> None:
        """Write what has arrived."""
        for _ in range(len(self._arrived)):
            at, content = self._arrived.popleft()
            self._write(file, at, content)


class _Watcher:
    """A thread that reads a camera or a function, from the opening of the set to its end."""

    def __init__(self, feed: _Feed, read: Callable[[], None], *, pause: float) -> None:
        self._feed, self._read, self._pause = feed, read, pause
        self._ending, self._has_begun = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="heptarm-episodes", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ending.wait(self._pause):
            try:
                self._read()
            except Exception as error:  # of a function that is yours; the episode reports it
                if not self._ending.is_set() and self._feed.failure is None:
                    self._feed.failure = error
                    _log.warning("%s failed: %s", self._feed.name, _line(str(error)))
                self._ending.wait(_RETRY)  # the next episode may succeed
            finally:
                self._has_begun.set()

    def warm_up(self) -> None:
        """Wait for the first reading; the episode reports one that does not come."""
        self._has_begun.wait(STALL)

    def close(self) -> None:
        """End it; a function that waits for its sensor is left alone."""
        self._ending.set()
        self._thread.join(1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeTerms:
    """How the episodes of a set are recorded.

    Attributes:
        rate: steps per second of the robot's clock [Hz].
        task: what is done, in words.
        cameras: opens each of them, by its name.
        streams: reads each of them, by its name; None: the program pushes it.
        reset: called before each episode.
        factor: seconds of the robot's clock per second of ours.
    """

    rate: float
    task: str
    cameras: Mapping[str, Callable[[], PictureStream]] = field(default_factory=dict)
    streams: Mapping[str, NumberSource | None] = field(default_factory=dict)
    reset: Callable[[], object] | None = None
    factor: float = 1.0

    def __post_init__(self) -> None:
        within(self.rate, "rate", 0.0, FASTEST, above=True, unit="Hz")
        _text(self.task, "task")
        for kind, names in (("cameras", self.cameras), ("streams", self.streams)):
            for name in names:
                check_stream_name(name, kind)
        twice = set(self.cameras) & set(self.streams)
        if twice:
            raise CommandRejected(
                f"streams must have other names than cameras, got {min(twice)!r} in both", parameter="streams"
            )
        for name, source in self.streams.items():
            if source is not None and not callable(source):
                raise ShapeError(
                    f"streams[{name!r}] must be a function or None, got {shown(source)}", parameter="streams"
                )
        if self.reset is not None and not callable(self.reset):
            raise ShapeError(f"reset must be a function, got {shown(self.reset)}", parameter="reset")


def check_stream_name(name: str, parameter: str) -> None:
    """Refuse a name that is no word of lower case letters, digits and underscores, or is taken.

    Raises:
        CommandRejected: it is none.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name in _TAKEN:
        raise CommandRejected(
            f"names in {parameter} must have lower case letters, digits and _, and not be one of "
            f"{', '.join(sorted(_TAKEN))}; got {shown(name)}",
            parameter=parameter,
            value=name,
        )


#: Names that the steps of an episode have already.
_TAKEN = {
    ACTION,
    "state",
    "t",
    "q",
    "dq",
    "tau_ext",
    "velocity",
    "joint_positions",
    "joint_velocities",
    "pose",
    "wrench",
    "correction",
    "task",
    "reward",
    "done",
}


def _text(value: str, name: str) -> str:
    text = instance(value, str, name)
    if len(text) > _LONGEST:
        raise CommandRejected(
            f"{name} must have at most {_LONGEST} characters, got {len(text)}", parameter=name
        )
    check_printable(text, name)
    return text


def _line(text: str) -> str:
    """Any text as a reason: one line of printable characters, not too long."""
    return printable(" ".join(text.split()))[:_LONGEST]


def _other_count(before: _Shape, now: _Shape) -> str:
    return f"must have {counted(before[0], 'number')} as before, got {now[0]}"


def _other_size(before: _Shape, now: _Shape) -> str:
    first, then = (" x ".join(map(str, shape)) for shape in (before, now))
    return f"must have pictures of {first} pixels as before (height x width), got {then}"


class EpisodeSet(Sealed):
    """Episodes of one task, each in a file of its own in a folder; made by `Arm.episodes`, used in a `with` block.

    A folder that has episodes gets more. What is complete stays, whatever happens to the program.

    Attributes:
        folder: of the files.
    """

    folder: Final[Path]

    def __init__(self, source: RecordSource, folder: Path, terms: EpisodeTerms) -> None:
        self.folder = folder
        self._source, self._terms = source, terms
        self._stack = ExitStack()
        self._feeds: dict[str, _Feed] = {}
        self._running: Episode | None = None
        self._is_open = False

    def __enter__(self) -> EpisodeSet:
        """Open folder, cameras and streams, and wait for the first picture of each camera, at most two seconds.

        Raises:
            CommandRejected: the folder cannot be written; or a camera cannot be opened.
            MissingExtra: a package that cameras or recordings need is not installed.
        """
        require("mcap.writer", extra="record")
        make_folder(self.folder)
        clock = self._source.nanos
        cameras: list[_Watcher] = []
        with ExitStack() as stack:
            for name, opened in self._terms.cameras.items():
                stream = opened()
                stack.callback(stream.close)
                feed = self._feeds[name] = _Feed(name, clock, _view_writer(name))
                cameras.append(_Watcher(feed, _picture_reader(feed, stream, self._source.to_ours), pause=0.0))
                stack.callback(cameras[-1].close)
            for name, source in (*self._terms.streams.items(), (ACTION, None)):
                feed = self._feeds[name] = _Feed(name, clock, _number_writer(name))
                if source is not None:
                    pause = 0.5 / (self._terms.rate * self._terms.factor)  # one that is late misses no step
                    stack.callback(_Watcher(feed, _number_reader(feed, source, clock), pause=pause).close)
            for camera in cameras:  # one that is slow to start would shorten the first episode
                camera.warm_up()
            self._stack = stack.pop_all()
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        """Close cameras and streams."""
        self._is_open = False
        self._stack.close()

    @property
    def count(self) -> int:
        """Number of episodes in the folder."""
        return len(episode_files(self.folder))

    def episode(self, task: str | None = None, *, number: int | None = None) -> Episode:
        """An episode, to be used in a `with` block.

        Args:
            task: what is done, in words; None: that of the set.
            number: of its file, as when several programs record parts of a set; None: the next one of the folder.

        Raises:
            ShapeError: no text, or no integer.
            LimitError: a number outside its range.
        """
        chosen = None if number is None else integer(number, "number", 0, _LAST)
        return Episode(self, self._terms.task if task is None else _text(task, "task"), chosen)

    def push(self, name: str, values: npt.ArrayLike) -> None:
        """Add numbers of a stream that the program pushes, such as a callback of ROS, at the time of the call.

        Raises:
            CommandRejected: there is no such stream, or it has a function.
            ShapeError: no numbers, or not as many as before in this set.
        """
        if self._terms.streams.get(name, name) is not None:
            known = ", ".join(key for key, source in self._terms.streams.items() if source is None) or "none"
            raise CommandRejected(
                f"name must be one of {known}, got {shown(name)}",
                parameter="name",
                value=name,
                hint="name the stream in arm.episodes(..., streams={name: None})",
            )
        self._feed(name, row_of(values, "values"))

    def _feed(self, name: str, row: list[float]) -> None:
        """Add numbers that the program gives.

        Raises:
            ShapeError: not as many as before.
        """
        feed = self._feeds.get(name)
        if feed is None:  # the set is not open
            return
        if (before := feed.misfit((len(row),))) is not None:
            what = "action" if name == ACTION else f"the stream {name}"
            raise ShapeError(
                f"{what} must have {counted(before[0], 'number')} as before in this set, got {len(row)}",
                parameter=name,
                value=row,
                hint="give as many each time; for another number of them begin another folder",
            )
        feed.add(self._source.nanos(), row)

    def __repr__(self) -> str:
        """Short form."""
        return f"<EpisodeSet {self.folder}, {counted(self.count, 'episode')}>"


def row_of(values: npt.ArrayLike, name: str) -> list[float]:
    """Numbers as a list, at most 1000.

    Raises:
        ShapeError: others.
        LimitError: one is not finite.
    """
    found = np.atleast_1d(finite_entries(numbers(values, name), name))
    if found.ndim != 1 or not 1 <= found.size <= _MOST:
        raise ShapeError(
            f"{name} must have shape (n,) with n from 1 to {_MOST}, got {found.shape}", parameter=name
        )
    return [float(value) for value in found]


def _number_writer(name: str) -> Callable[[RecordingFile, int, Any], None]:
    return lambda file, at, values: file.numbers(name, at, values)


def _view_writer(name: str) -> Callable[[RecordingFile, int, Any], None]:
    image = require("PIL.Image", extra="record")

    def write(file: RecordingFile, at: int, pixels: Any) -> None:
        data = io.BytesIO()
        image.fromarray(pixels).save(data, "JPEG", quality=_QUALITY)
        file.view(name, at, data.getvalue())

    return write


def _number_reader(feed: _Feed, source: NumberSource, clock: Callable[[], int]) -> Callable[[], None]:
    def read() -> None:
        given = source()
        if given is not None:
            row = row_of(given, feed.name)
            feed.add_if_fit(clock(), row, (len(row),), _other_count)

    return read


def _picture_reader(feed: _Feed, stream: PictureStream, to_ours: Callable[[int], int]) -> Callable[[], None]:
    def read() -> None:
        picture = stream.read(timeout=1e6)
        feed.add_if_fit(to_ours(picture.stamp), picture.pixels, picture.pixels.shape, _other_size)

    return read


class Episode(Sealed):
    """One episode; made by `EpisodeSet.episode`, recorded while its `with` block runs.

    An error that ends the block labels it a failure, with the error as the reason. So do a camera or a stream that
    gives nothing, or that changes its size. Without any label it is "unlabelled".

    Attributes:
        task: what is done, in words.
    """

    task: Final[str]

    def __init__(self, owner: EpisodeSet, task: str, number: int | None) -> None:
        self._set, self.task, self._number = owner, task, number
        self._path = owner.folder
        self._label: Label = "unlabelled"
        self._reason = ""
        self._is_discarded = self._is_over = False
        self._recorder: Recorder | None = None

    def __enter__(self) -> Episode:
        """Reset, then begin to record.

        Raises:
            LocalProtocolError: the set is not open, or another episode runs.
            HeptarmError: of the reset, or the file cannot be written. Then there is no episode.
        """
        owner, terms = self._set, self._set._terms
        if not owner._is_open or owner._running is not None or self._recorder is not None:
            raise LocalProtocolError(
                "an episode needs the with block of its set, and no other episode in it",
                hint='with arm.episodes("insert") as episodes: with episodes.episode() as episode: ...',
            )
        if terms.reset is not None:
            terms.reset()
        number = next_number(owner.folder) if self._number is None else self._number
        self._path = owner.folder / f"episode-{number:05d}.mcap"
        self._recorder = Recorder(
            {"": owner._source},
            self._path,
            rate=min(2.0 * terms.rate, 1000.0),
            feeds=tuple(owner._feeds.values()),
            facts={TASK: self.task, RATE: repr(terms.rate), NUMBER: str(number)},
        )
        for feed in owner._feeds.values():
            feed.begin()
        try:
            self._recorder.start()
        except BaseException:
            for feed in owner._feeds.values():  # otherwise they would keep what arrives
                feed.end()
            raise
        owner._running = self
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End the file with its label.

        Raises:
            StaleState: a camera or a stream has stalled or failed, gave nothing, or changed its size; the episode is a
                failure.
        """
        recorder = self._recorder
        assert recorder is not None
        try:
            terms = self._set._terms
            stalled = (
                self._missing(terms.streams, "value of the stream")
                or self._stalled()
                or self._missing(terms.cameras, "picture of the camera")
            )
            if error is not None and self._label != "failure":
                self.fail(_line(f"{type(error).__name__}: {error}"))
            elif stalled:
                self.fail(stalled)
            recorder.conclude({LABEL: self._label, REASON: self._reason})
        finally:  # whatever goes wrong, the file does not grow on
            self._close(recorder, is_failing=error is not None)
        if self._is_discarded:
            self._path.unlink(missing_ok=True)
        elif stalled and error is None:
            raise StaleState(
                f"the episode {self._path.name} is a failure: {stalled}",
                hint="look after the camera or sensor, and record the episode again; a camera that has failed is "
                "opened by the next set",
            )

    def _close(self, recorder: Recorder, *, is_failing: bool) -> None:
        """End recording and feeds.

        Raises:
            HeptarmError: the file could not be written to its end, and the block ends without another error.
        """
        self._is_over, self._set._running = True, None
        for feed in self._set._feeds.values():
            feed.end()
            if self._is_discarded or feed.defect:
                feed.forget()
        try:
            recorder.close()
        except HeptarmError as failure:
            if not is_failing:
                raise
            _log.warning("%s", failure)

    def _missing(self, names: Iterable[str], what: str) -> str:
        """Which camera or stream of these has given nothing at all; "": none."""
        for name in names:
            feed = self._set._feeds[name]
            if not feed.count and feed.failure is None and not feed.defect:
                return f"no {what} {name} arrived"
        return ""

    def _stalled(self) -> str:
        """Which camera or stream has given nothing for long, or what does not fit; "": none."""
        for name, feed in self._set._feeds.items():
            if name == ACTION:
                continue
            if feed.failure is not None:
                return _line(f"{name} failed: {feed.failure}")
            if feed.defect:
                return feed.defect
            if feed.look() > STALL:
                return f"{name} gave nothing for {feed.longest:.1f} s"
        return ""

    @property
    def path(self) -> Path:
        """The file; before the block its folder."""
        return self._path

    @property
    def label(self) -> Label:
        """Its label so far."""
        return self._label

    def check(self) -> None:
        """Raise if a camera or a stream has stalled: call it in long episodes.

        Raises:
            StaleState: one has.
        """
        if stalled := self._stalled():
            raise StaleState(stalled, hint="look after the camera or sensor, and record the episode again")

    def act(self, action: npt.ArrayLike) -> None:
        """Record what the program commands, shape (n,): joints and a gripper for example.

        Without it the actions of an episode are the joints' set-points of the next step.

        Raises:
            ShapeError: no numbers, or not as many as before in this set.
            LimitError: one is not finite.
            CommandRejected: the episode has ended.
        """
        self._check_going("act")
        self._set._feed(ACTION, row_of(action, "action"))

    def note(self, text: str) -> None:
        """Put a mark on the time line; see `Recorder.note`.

        Raises:
            CommandRejected: the episode has ended.
        """
        self._check_going("note")
        if self._recorder is None:
            raise LocalProtocolError("the episode has not begun", hint="use it in a with block")
        self._recorder.note(text)

    def succeed(self, reason: str = "") -> None:
        """Label it a success; of several labels in its block the last one counts.

        Raises:
            CommandRejected: the episode has ended.
        """
        self._check_going("succeed")
        self._reason, self._label = _text(reason, "reason"), "success"

    def fail(self, reason: str = "") -> None:
        """Label it a failure, for a reason in words; of several labels in its block the last one counts.

        Raises:
            CommandRejected: the episode has ended.
        """
        self._check_going("fail")
        self._reason, self._label = _text(reason, "reason"), "failure"

    def discard(self) -> None:
        """Delete it at the end of the block.

        Raises:
            CommandRejected: the episode has ended.
        """
        self._check_going("discard")
        self._is_discarded = True

    def _check_going(self, name: str) -> None:
        """Refuse a call after the block, which would change nothing in the file.

        Raises:
            CommandRejected: the episode has ended.
        """
        if self._is_over:
            raise CommandRejected(
                f"the episode has ended, its file {self._path.name} is closed: {name} must be called in its block",
                parameter="episode",
                value=str(self._path),
                hint=f"call episode.{name} within the with block; to remove an episode delete its file",
            )

    def __repr__(self) -> str:
        """Short form."""
        return f"<Episode {self._path.name}, {self._label}>"


def named_cameras(cameras: object) -> dict[str, Any]:
    """Cameras by their names: a mapping as it is, of a list "camera", or "camera_0", "camera_1".

    Raises:
        ShapeError: neither.
    """
    if isinstance(cameras, Mapping):
        return dict(cameras)
    if isinstance(cameras, Sequence) and not isinstance(cameras, (str, bytes)):
        if len(cameras) == 1:
            return {"camera": cameras[0]}
        return {f"camera_{index}": camera for index, camera in enumerate(cameras)}
    raise ShapeError(
        f"cameras must be a list, or a mapping from names, got {shown(cameras)}",
        parameter="cameras",
        value=cameras,
        hint='for example cameras={"wrist": heptarm.Camera(frame="flange")}',
    )


def label_filter(labels: Iterable[str]) -> tuple[str, ...]:
    """Labels that are chosen.

    Raises:
        ShapeError: no words.
        CommandRejected: there is no such label.
    """
    given: object = labels
    if not isinstance(given, Iterable):
        raise ShapeError(f"labels must be words, got {shown(given)}", parameter="labels", value=given)
    chosen = (labels,) if isinstance(labels, str) else tuple(labels)
    for label in chosen:
        if not isinstance(label, str) or label not in LABELS:
            allowed = ", ".join(LABELS)
            raise CommandRejected(
                f"labels must be among {allowed}, got {shown(label)}",
                parameter="labels",
                value=label,
                allowed=allowed,
            )
    return chosen
