"""Recordings as files of other programs: Parquet, CSV, NumPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from heptarm.errors import CommandRejected, require
from heptarm.record.recording import FRI, Recording


def convert(recording: Recording, out: str | Path) -> list[Path]:
    """Write the signals of a recording to a file; its suffix chooses the format: .parquet, .csv or .npz.

    A table has a column per number; FRI cycles, which have times of their own, go to a second file beside it. A .npz
    has all arrays by name.

    Returns:
        The files.

    Raises:
        CommandRejected: another suffix, or the file cannot be written.
        MissingExtra: pandas or pyarrow is not installed.
    """
    path = Path(out)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        allowed = ", ".join(_WRITERS)
        raise CommandRejected(
            f"the suffix must be one of {allowed}, got {path.suffix!r}",
            parameter="out",
            value=str(out),
            allowed=allowed,
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return write(recording, path)
    except OSError as error:
        raise CommandRejected(
            f"{path} cannot be written: {error.strerror}", parameter="out", value=str(out)
        ) from error


def _npz(recording: Recording, path: Path) -> list[Path]:
    np.savez_compressed(path, **recording.signals)  # type: ignore[arg-type]
    return [path]


def _parquet(recording: Recording, path: Path) -> list[Path]:
    require("pyarrow", extra="record")
    found = []
    for is_fri, one in _tables(recording, path):
        recording.to_pandas(fri=is_fri).to_parquet(one, engine="pyarrow")
        found.append(one)
    return found


def _csv(recording: Recording, path: Path) -> list[Path]:
    found = []
    for is_fri, one in _tables(recording, path):
        recording.to_pandas(fri=is_fri).to_csv(one)
        found.append(one)
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
