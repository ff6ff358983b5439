"""The recorder: a thread that writes what arrives to a file, beside the link's thread and never in its place."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, HeptarmError, LocalProtocolError
from heptarm.fri.loop.telemetry import Reader
from heptarm.record.camera import CameraFeed
from heptarm.record.journal import NOTE, Journal, JournalEntry, Record
from heptarm.record.layout import STATE
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.samples import SampleQueue, StateSample, state_rows
from heptarm.values.checks import flag, instance, within
from heptarm.values.files import refuse_existing
from heptarm.values.frames import check_printable
from heptarm.values.sealed import Sealed

_log = logging.getLogger("heptarm.record")

#: Time between two looks at what has arrived [s].
_PERIOD = 0.05
#: States that are encoded at once.
_BATCH = 64
#: States that may wait for a slow disk: a minute of them at 1 kHz.
_WAITING = 60_000
#: Size of a chunk in time [s] and in bytes: what a file that is cut off loses at its end.
_CHUNK_TIME, _CHUNK_LEAST, _CHUNK_MOST = 0.5, 16_384, 524_288
#: Longest note [characters].
_LONGEST_NOTE = 1000
#: Fastest pushed states [Hz].
_FASTEST = 1000.0


class RecordSource(Protocol):
    """What is recorded; a connection is one."""

    @property
    def journal(self) -> Journal:
        """What happened besides pushed states."""
        ...

    @property
    def facts(self) -> Mapping[str, str]:
        """Texts about robot and connection."""
        ...

    @property
    def signal_names(self) -> Sequence[str]:
        """Names of the cabinet's signals."""
        ...

    @property
    def state_rate(self) -> float:
        """Pushed states per second [Hz]."""
        ...

    def raise_rate(self, rate: float) -> Callable[[], None]:
        """Have at least so many states pushed per second [Hz]; returns what restores the rate before."""
        ...

    def nanos(self) -> int:
        """Our clock [ns]."""
        ...

    def to_ours(self, stamp: int) -> int:
        """Our clock at a time of the cabinet's [ns]."""
        ...

    def open_samples(self, size: int) -> SampleQueue:
        """A queue that receives every pushed state from now on."""
        ...

    def close_samples(self, queue: SampleQueue) -> None:
        """End such a queue."""
        ...

    def kept_samples(self) -> list[StateSample]:
        """The pushed states of the last 30 s."""
        ...


class RecordSink(Protocol):
    """What is written to, one for each arm; a `RecordingFile` is one. Only the recorder's thread calls it."""

    def states(
        self, samples: Sequence[StateSample], *, to_ours: Callable[[int], int], signals: Sequence[str] = ()
    ) -> None:
        """Write pushed states; `to_ours` makes a time of our clock of one of the cabinet's [ns]."""
        ...

    def cycles(self, words: npt.NDArray[np.float64]) -> None:
        """Write FRI cycles, shape (n, 123)."""
        ...

    def entry(self, entry: JournalEntry) -> None:
        """Write what happened."""
        ...

    def flush(self) -> None:
        """Hand on what was written; called on the first sink only, as are the next two."""
        ...

    def finish(self, facts: Mapping[str, str]) -> None:
        """Write the end and close."""
        ...

    def abandon(self) -> None:
        """Close without an end, after an error."""
        ...


def epoch_of(source: RecordSource) -> int:
    """Nanoseconds since 1970 at our clock's zero."""
    return time.time_ns() - source.nanos()


def chunk_size(rate: float) -> int:
    """Size of a chunk for so many states per second [bytes]."""
    return int(min(max(rate * STATE.dtype.itemsize * _CHUNK_TIME, _CHUNK_LEAST), _CHUNK_MOST))


class RecordFeed(Protocol):
    """Something else that is written to the file, as numbers of a sensor are; called by the recorder's thread alone."""

    def write(self, file: RecordingFile) -> None:
        """Write what has arrived."""
        ...


class CycleTap:
    """Takes the cycles of FRI sessions out of their rings, none twice.

    Attributes:
        lost: cycles that were overwritten before they were taken.
    """

    def __init__(self) -> None:
        self._next: dict[Reader, int] = {}
        self.lost = 0

    def write(self, sessions: Iterable[Reader], file: RecordSink, *, whole: bool = False) -> None:
        """Write the new cycles of all sessions, and once more those of sessions that have ended.

        Args:
            sessions: that are open.
            file: where to.
            whole: take also what is in the ring of a session that is new here.
        """
        for reader in {*sessions, *self._next}:
            start = self._next.get(reader)
            if start is None:
                start = 0 if whole else max(0, reader.count - 1)
            words, after, lost = reader.since(start)
            self._next[reader] = after
            self.lost += 0 if whole else lost
            if len(words):
                file.cycles(words)
        for reader in set(self._next) - set(sessions):
            del self._next[reader]


class _Film:
    """The pictures of one source in the file.

    Args:
        feed: draws them.
        file: where to.

    Attributes:
        pictures: number of those that were written.
    """

    def __init__(self, feed: CameraFeed, file: RecordingFile) -> None:
        self._feed, self._file = feed, file
        self.pictures = 0

    def offer(self, sample: StateSample) -> None:
        """Show the state that was written last, if a picture is due."""
        if self._feed.is_due(sample.received):
            q = state_rows([sample.body])["q"][0].tolist()
            self._feed.offer(sample.number, sample.received, self._file.sampled, q)

    def write(self) -> None:
        """Write what is finished."""
        for picture in self._feed.take():
            self._file.picture(self._feed.camera, picture)
            self.pictures += 1

    def close(self) -> None:
        """Write the last picture, and end the camera."""
        self._feed.settle()
        self.write()
        self._feed.close()


class _Tap:
    """What is recorded of one source: its states, its journal, its FRI cycles, its pictures.

    Args:
        source: what is recorded.
        file: where to.
        film: its pictures; None: there are none.
    """

    def __init__(self, source: RecordSource, file: RecordSink, film: _Film | None) -> None:
        self._source, self._file, self._film = source, file, film
        self._entries: deque[Record] = source.journal.open()
        self._samples = source.open_samples(_WAITING)
        self._cycles = CycleTap()

    @property
    def lost(self) -> int:
        """States and FRI cycles that could not be recorded."""
        return self._samples.lost + self._cycles.lost

    def write(self) -> int:
        """Write what has arrived; returns the number of states."""
        source, count = self._source, 0
        journal = source.journal  # read first: an FRI client's takes over the events of its loop then
        while batch := self._samples.take(_BATCH):
            self._file.states(batch, to_ours=source.to_ours, signals=source.signal_names)
            count += len(batch)
            if self._film is not None:
                self._film.offer(batch[-1])
        while self._entries:
            self._file.entry(JournalEntry(*self._entries.popleft()))
        self._cycles.write(journal.sessions, self._file)
        if self._film is not None:
            self._film.write()
        return count

    def close(self) -> None:
        """Take nothing more."""
        self._source.close_samples(self._samples)
        self._source.journal.close(self._entries)


class Recorder(Sealed):
    """Records one arm or several to a file while a `with` block runs; made by `Arm.record` and `Arms.record`.

    Args:
        sources: what is recorded, by the name of the arm; a single one may have the name "".
        path: the file, MCAP.
        rate: have at least so many states pushed per second meanwhile [Hz]; None: as many as are.
        sinks: makes what is written to, one for each arm in their order; None: the file.
        period: time between two looks at what has arrived [s].
        cameras: what draws pictures for the file, by the name of the arm.
        overwrite: replace a file that exists.
        feeds: what else is written to the file.
        facts: texts of the beginning, beside those of the sources.

    Attributes:
        path: the file.

    Raises:
        LimitError: a rate outside its range.
        CommandRejected: the file exists.
    """

    path: Final[Path]

    def __init__(
        self,
        sources: Mapping[str, RecordSource],
        path: Path,
        *,
        rate: float | None = None,
        sinks: Callable[[Mapping[str, RecordSource]], Sequence[RecordSink]] | None = None,
        period: float = _PERIOD,
        cameras: Mapping[str, CameraFeed] | None = None,
        overwrite: bool = False,
        feeds: Sequence[RecordFeed] = (),
        facts: Mapping[str, str] | None = None,
    ) -> None:
        self._sources = dict(sources)
        self._feeds, self._facts = tuple(feeds), dict(facts or {})
        self._recording: RecordingFile | None = None
        self._outcome: dict[str, str] = {}
        self._overwrite = flag(overwrite, "overwrite") or sinks is not None
        self._rate = None if rate is None else within(rate, "rate", 0.0, _FASTEST, above=True, unit="Hz")
        self.path = refuse_existing(path, overwrite=self._overwrite)
        self._states = 0
        self._open_sinks = self._open_files if sinks is None else sinks
        self._period = period
        self._cameras = dict(cameras or {})
        self._films: dict[str, _Film] = {}
        self._file: RecordSink | None = None
        self._taps: list[_Tap] = []
        self._failure: OSError | None = None
        self._ended = threading.Event()
        self._restore: list[Callable[[], None]] = []
        self._thread = threading.Thread(target=self._run, name="heptarm-record", daemon=True)
        self._is_closed = False

    def start(self) -> Recorder:
        """Begin; a `with` block does this.

        Raises:
            CommandRejected: the file cannot be written.
            LimitError: the cabinet does not push so many states.
            CommandRejected: this machine cannot draw the pictures of a camera, or there is no such scene.
            MissingExtra: the package mcap is not installed, or those that a camera needs.
        """
        if self._file is not None:
            raise LocalProtocolError("a recorder is used once", hint="make another one with arm.record(...)")
        try:
            if self._rate is not None:
                for source in self._sources.values():
                    self._restore.append(source.raise_rate(self._rate))
            for camera in self._cameras.values():
                camera.start()
            sinks = self._open_sinks(self._sources)
        except BaseException:
            for camera in self._cameras.values():
                camera.close()
            for restore in self._restore:
                restore()
            raise
        self._file = sinks[0]
        self._taps = [
            _Tap(source, sink, self._films.get(name))
            for (name, source), sink in zip(self._sources.items(), sinks, strict=True)
        ]
        self._thread.start()
        return self

    def _open_files(self, sources: Mapping[str, RecordSource]) -> list[RecordingFile]:
        """The file, and its writer for each arm."""
        (name, first), *others = sources.items()
        refuse_existing(self.path, overwrite=self._overwrite)  # it may have appeared meanwhile
        size = chunk_size(sum(source.state_rate for source in sources.values()))
        about = {**first.facts, **self._facts}
        file = RecordingFile(self.path, about, epoch=epoch_of(first), chunk=size, arm=name)
        self._recording = file
        files = [file, *(file.beside(source.facts, name) for name, source in others)]
        for name, writer in zip(sources, files, strict=True):
            if name in self._cameras:
                self._films[name] = _Film(self._cameras[name], writer)
        return files

    @property
    def states(self) -> int:
        """Pushed states written so far, of all arms."""
        return self._states

    def note(self, text: str) -> None:
        """Put a mark on the time line; `Recording.between` finds it by its text.

        Raises:
            ShapeError: not a text, or one with characters that cannot be printed.
            CommandRejected: it is empty or longer than 1000 characters.
        """
        if not 1 <= len(instance(text, str, "text")) <= _LONGEST_NOTE:
            raise CommandRejected(
                f"text must have 1 to {_LONGEST_NOTE} characters, got {len(text)}",
                parameter="text",
                value=text,
            )
        check_printable(text.replace("\t", " "), "text", lines=True)
        for source in self._sources.values():
            source.journal.add(NOTE, text)

    def conclude(self, facts: Mapping[str, str]) -> None:
        """Have texts written at the end of the file; without them the file was cut off."""
        self._outcome = dict(facts)

    @property
    def lost(self) -> int:
        """States and FRI cycles that could not be recorded, because the disk was too slow for too long."""
        return sum(tap.lost for tap in self._taps)

    @property
    def pictures(self) -> int:
        """Pictures of the camera written so far, of all arms."""
        return sum(film.pictures for film in self._films.values())

    @property
    def pictures_dropped(self) -> int:
        """Pictures that were due while the camera still drew the one before: it never holds up the states."""
        return sum(camera.dropped for camera in self._cameras.values())

    @property
    def is_running(self) -> bool:
        """Whether it records; False also after an error of the disk."""
        return self._file is not None and self._failure is None and not self._is_closed

    def close(self) -> None:
        """Write what has arrived and end the file; calling it again has no effect.

        Raises:
            HeptarmError: the file could not be written to its end; what was written before can be read.
        """
        if self._is_closed or self._file is None:
            return
        self._is_closed = True
        try:
            for restore in self._restore:
                try:
                    restore()
                except HeptarmError as error:
                    _log.info("the rate of the states stays as it was for the recording: %s", error)
        finally:
            self._ended.set()
        self._thread.join()
        if self._failure is not None:
            raise HeptarmError(
                f"the recording {self.path} ends early: {self._failure.strerror or self._failure}",
                hint="free some space; heptarm.load reads what was written before",
            )

    def __enter__(self) -> Recorder:
        """Begin; see `start`."""
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End the file; its own error is only logged if the block ends with another one."""
        try:
            self.close()
        except HeptarmError as failure:
            if error is None:
                raise
            _log.warning("%s", failure)

    def __repr__(self) -> str:
        """Short form."""
        state = "recording" if self.is_running else "closed" if self._is_closed else "not begun"
        return f"<Recorder {self.path}, {state}, {self.states} states, {self.lost} lost>"

    # -------------------------------------------------------------------------------------- its own thread

    def _run(self) -> None:
        file = self._file
        assert file is not None
        try:
            while True:
                is_last = self._ended.wait(self._period)
                for tap in self._taps:
                    self._states += tap.write()
                for feed in self._feeds:
                    assert self._recording is not None
                    feed.write(self._recording)
                file.flush()
                if is_last:
                    break
            for film in self._films.values():
                film.close()
            counts = {"states": self.states, "lost": self.lost}
            if self._films:
                counts |= {"pictures": self.pictures, "pictures_dropped": self.pictures_dropped}
            file.finish({name: str(count) for name, count in counts.items()} | self._outcome)
        except OSError as error:
            self._failure = error
            file.abandon()
            _log.error("the recording %s ends early: %s", self.path, error)
        except Exception as error:  # a defect here must not pass unnoticed, nor end the program
            self._failure = OSError(f"{type(error).__name__}: {error}")
            file.abandon()
            _log.exception("the recording %s ends early", self.path)
        finally:
            for tap in self._taps:
                tap.close()
            for camera in self._cameras.values():
                camera.close()
