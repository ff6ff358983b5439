"""Recordings as files of other programs: Parquet, CSV, NumPy, and pictures as a folder of JPEG files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from heptarm.errors import CommandRejected, require
from heptarm.record.recorded import FRI
from heptarm.record.recording import Recording
from heptarm.values.checks import flag
from heptarm.values.files import path_of, refuse_existing


def convert(recording: Recording, out: str | Path, *, overwrite: bool = False) -> list[Path]:
    """Write the signals of a recording to a file; its suffix chooses the format: .parquet, .csv or .npz.

    A table has a column per number; FRI cycles, which have times of their own, go to a second file beside it. A .npz
    has all arrays by name. None of them has the pictures of a camera; a path without a suffix is a folder for these.

    Args:
        recording: to convert.
        out: the file.
        overwrite: replace files that exist.

    Returns:
        The files.

    Raises:
        CommandRejected: another suffix, the file exists or cannot be written, or there are no pictures for a folder.
        MissingExtra: pandas or pyarrow is not installed.
    """
    path = path_of(out, "out")
    if not path.suffix:
        return _pictures(recording, path, overwrite=overwrite)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        allowed = ", ".join(_WRITERS)
        raise CommandRejected(
            f"the suffix must be one of {allowed}, got {path.suffix!r}",
            parameter="out",
            value=str(out),
            allowed=allowed,
            hint="a folder for the pictures of a camera has none",
        )
    for _, file in _tables(recording, path):
        refuse_existing(file, overwrite=flag(overwrite, "overwrite"), name="out")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return write(recording, path)
    except OSError as error:
        raise CommandRejected(
            f"{path} cannot be written: {error.strerror}", parameter="out", value=str(out)
        ) from error


def _pictures(recording: Recording, folder: Path, *, overwrite: bool) -> list[Path]:
    if not len(recording.pictures):
        allowed = ", ".join(_WRITERS)
        raise CommandRejected(
            f"out must end in {allowed}, got {str(folder)!r}: the recording has no pictures for a folder",
            parameter="out",
            value=str(folder),
            allowed=allowed,
        )
    return recording.pictures.save(folder, overwrite=overwrite)


def _npz(recording: Recording, path: Path) -> list[Path]:
    np.savez_compressed(path, **recording.signals)  # type: ignore[arg-type]
    return [path]


def _parquet(recording: Recording, path: Path) -> list[Path]:
    require("pyarrow", extra="record")
    found = []
    for is_fri, file in _tables(recording, path):
        recording.to_pandas(fri=is_fri).to_parquet(file, engine="pyarrow")
        found.append(file)
    return found


def _csv(recording: Recording, path: Path) -> list[Path]:
    found = []
    for is_fri, file in _tables(recording, path):
        recording.to_pandas(fri=is_fri).to_csv(file)
        found.append(file)
    return found


def _tables(recording: Recording, path: Path) -> list[tuple[bool, Path]]:
    files = [(False, path)]
    if f"{FRI}t" in recording:
        files.append((True, path.with_name(f"{path.stem}-fri{path.suffix}")))
    return files


_WRITERS: dict[str, Callable[[Recording, Path], list[Path]]] = {
    ".parquet": _parquet,
    ".csv": _csv,
    ".npz": _npz,
}
