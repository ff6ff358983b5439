"""The black box: the last 30 s of a connection, written to a file when something goes wrong.

Nothing is encoded before: the connection keeps the bodies of the states that it received and the entries of its
journal. A thread waits half a second, so that the file shows how the arm comes to rest, and writes the file. It is one
thread for all connections of the process, and it stays: the system's allocator keeps what a thread has freed for the
next one in the same arena, so that a new thread for each file leaves some 3 MB in each of up to eight arenas per core.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import count
from pathlib import Path

from heptarm.errors import HeptarmError, MissingExtra
from heptarm.fri.loop.telemetry import Reader
from heptarm.io.folders import private_folder, state_folder
from heptarm.record.mcap_file import RecordingFile
from heptarm.record.recorder import CycleTap, RecordSource, chunk_size, epoch_of

_log = logging.getLogger("heptarm.record")

#: Environment variable: "off", or the folder of the files.
VARIABLE = "HEPTARM_BLACK_BOX"
#: Files that are kept; older ones are deleted.
MOST_FILES = 20
#: Time before the error, and time after it [s].
BEFORE, AFTER = 30.0, 0.5
#: Errors within this time have one file [s].
_SAME = 1.0
#: Longest wait for a file [s].
_PATIENCE = 30.0
#: States that are encoded at once.
_BATCH = 64
_numbers = count(1)


def folder() -> Path | None:
    """Folder of the files: HEPTARM_BLACK_BOX, or heptarm/black-box in XDG_STATE_HOME (~/.local/state); None: off."""
    given = os.environ.get(VARIABLE, "").strip()
    if given.lower() in ("off", "0", "no"):
        return None
    if given:
        return Path(given).expanduser()
    return state_folder() / "black-box"


class BlackBoxFile:
    """A file that is being written; calling it waits for it.

    Args:
        path: the file.
        at: our clock at the error [ns].
    """

    def __init__(self, path: Path, at: int) -> None:
        self.at = at
        self._path: Path | None = path
        self._is_done = threading.Event()

    def __call__(self) -> Path | None:
        """The path, when it is written; None if it could not be."""
        return self._path if self._is_done.wait(_PATIENCE) else None

    def finish(self, *, is_written: bool) -> None:
        """Note that it is written, or that it could not be."""
        if not is_written:
            self._path = None
        self._is_done.set()

    def __reduce__(self) -> tuple[type[WrittenBlackBox], tuple[Path | None]]:
        """An error goes to another process with the path alone."""
        return WrittenBlackBox, (self(),)


class WrittenBlackBox:
    """The path of a file that is written."""

    def __init__(self, path: Path | None) -> None:
        self._path = path

    def __call__(self) -> Path | None:
        """The path."""
        return self._path


class BlackBox:
    """Writes the last 30 s of a connection on request.

    Args:
        source: the connection.
        is_on: whether it writes at all.
    """

    def __init__(self, source: RecordSource, *, is_on: bool = True) -> None:
        self._source = source
        self._is_on = is_on
        self._lock = threading.Lock()
        self._hurry = threading.Event()
        self._last: BlackBoxFile | None = None

    @property
    def last(self) -> BlackBoxFile | None:
        """The newest file; None: there is none."""
        return self._last

    def capture(self, reason: str) -> BlackBoxFile | None:
        """Begin to write a file; returns at once. Errors of the same second have the same file.

        Args:
            reason: a few words, for its name.
        """
        where = folder() if self._is_on else None
        if where is None:
            return None
        with self._lock:
            now = self._source.nanos()
            if self._last is not None and now - self._last.at < _SAME * 1e9:
                return self._last
            stamp = time.strftime("%Y%m%d-%H%M%S")
            name = re.sub(r"[^a-z0-9]+", "-", reason.lower()).strip("-")[:40]
            number = f"{os.getpid()}-{next(_numbers)}"  # connections of a process may see the same stop
            path = where / f"{stamp}-{now // 1_000_000 % 1000:03d}-{number}-{name}.mcap"
            self._last = file = BlackBoxFile(path, now)
        try:
            _scribe().submit(self._write, path, file, reason, self._source.journal.sessions)
        except RuntimeError:  # the interpreter ends
            file.finish(is_written=False)
        return file

    def hurry(self) -> None:
        """Do not wait for what happens after an error: the connection closes."""
        self._hurry.set()

    def abandon(self) -> None:
        """Give up in a fork of the process."""
        self._is_on, self._last, self._lock = False, None, threading.Lock()

    def _write(self, path: Path, file: BlackBoxFile, reason: str, sessions: tuple[Reader, ...]) -> None:
        is_written = False
        try:
            waited = (self._source.nanos() - file.at) * 1e-9  # for its turn
            self._hurry.wait(AFTER - waited)
            self._save(path, file.at, reason, sessions)
            is_written = True
        except MissingExtra as error:
            _log.info("no black box was written: %s", error)
        except (HeptarmError, OSError) as error:
            _log.warning("no black box was written: %s", error)
        except Exception:
            _log.exception("no black box was written")
        finally:
            file.finish(is_written=is_written)

    def _save(self, path: Path, at: int, reason: str, sessions: tuple[Reader, ...]) -> None:
        source = self._source
        begin = at - round(BEFORE * 1e9)
        samples = [sample for sample in source.kept_samples() if sample.received >= begin]
        entries = source.journal.since(begin)
        if state_folder() in path.parents:
            private_folder(path.parent)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _make_room(path.parent)
        unfinished = path.with_suffix(".part")
        facts = {**source.facts, "black_box": reason}
        out = RecordingFile(unfinished, facts, epoch=epoch_of(source), chunk=chunk_size(1000.0))
        try:
            for start in range(0, len(samples), _BATCH):
                batch = samples[start : start + _BATCH]
                out.states(batch, to_ours=source.to_ours, signals=source.signal_names)
            for entry in entries:
                out.entry(entry)
            CycleTap().write(sessions, out, whole=True)
            out.finish({"states": str(len(samples)), "lost": "0"})
            unfinished.chmod(0o600)
            unfinished.replace(path)
        except BaseException:
            out.abandon()
            with contextlib.suppress(OSError):
                unfinished.unlink()
            raise


@cache
def _scribe() -> ThreadPoolExecutor:
    """The thread that writes; it begins with the first file, and the interpreter ends after the last one."""
    return ThreadPoolExecutor(1, thread_name_prefix="heptarm-black-box")


if hasattr(os, "register_at_fork"):  # not on Windows, where no process forks
    os.register_at_fork(after_in_child=_scribe.cache_clear)  # a fork has no copy of the thread


def _make_room(where: Path) -> None:
    """Delete the oldest files so that one more may be written."""
    files = sorted(where.glob("*.mcap"))
    for old in files[: max(0, len(files) - MOST_FILES + 1)]:
        with contextlib.suppress(OSError):
            old.unlink()
