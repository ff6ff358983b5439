"""Files of users: read without trusting their lengths or their kind, and never replaced unasked.

A reader that is given any file ends in an error that names the file and the place; nothing waits for a pipe, and
nothing is as large as a number in a file states.
"""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any, BinaryIO
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, shortage
from heptarm.values.checks import instance, shown

#: Largest text that is read [bytes].
LARGEST_TEXT = 64 * 2**20
#: Most bytes of all arrays of a file together.
_LARGEST_ARRAYS = 2**31
#: Longest description of an array in a file [characters].
_LONGEST_HEADER = 4096


def path_of(value: str | Path, name: str = "path") -> Path:
    """A path that a user gives.

    Raises:
        ShapeError: it is no path.
        CommandRejected: no file can have this name.
    """
    path = Path(instance(value, (str, Path), name))
    try:
        encoded = os.fsencode(path)
    except UnicodeEncodeError:  # half of a surrogate pair
        encoded = b""
    if not encoded or b"\0" in encoded or not str(value):
        raise CommandRejected(
            f"{name} must be the name of a file, got {str(path)[:300]!a}",
            parameter=name,
            value=str(path),
            hint="a name has at least one character, no NUL, and no half of a surrogate pair",
        )
    return path


def unreadable(
    path: Path, why: str, *, what: str = "", name: str = "path", hint: str = ""
) -> CommandRejected:
    """The error of a file that cannot be read, or is not what it should be.

    Args:
        path: the file.
        why: the reason, and the place in the file where there is one.
        what: it should be, such as "a trajectory"; "": only reading failed.
        name: of the parameter.
        hint: what to do.
    """
    text = f"{path} is not {what}: {why}" if what else f"{path} cannot be read: {why}"
    return CommandRejected(text, parameter=name, value=str(path), hint=hint)


def unwritable(path: Path, error: OSError, *, name: str = "path") -> CommandRejected:
    """The error of a file that cannot be written."""
    return CommandRejected(
        f"{path} cannot be written: {(error.strerror or str(error)).lower()}",
        parameter=name,
        value=str(path),
        hint=shortage(error) or "choose a folder in which this user may write, on a disk that has space",
    )


@contextmanager
def open_regular(path: Path, *, name: str = "path") -> Iterator[BinaryIO]:
    """Open a file to read its bytes; of a pipe or a device nothing is awaited.

    Raises:
        CommandRejected: it cannot be opened or read, or is no regular file.
    """
    path_of(path, name)
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise unreadable(
                    path, "it is a pipe, a device or a socket", name=name, hint="give a regular file"
                )
            yield file
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        hint = shortage(error) or "give a file that exists and that you may read"
        raise unreadable(path, why, name=name, hint=hint) from error


def read_bytes(path: Path, *, largest: int = LARGEST_TEXT, name: str = "path") -> bytes:
    """The content of a file; of a pipe or a device nothing is awaited.

    Raises:
        CommandRejected: it cannot be read, is no regular file, or is larger than `largest` [bytes].
    """
    with open_regular(path, name=name) as file:
        data = file.read(largest + 1)
    if len(data) > largest:
        raise unreadable(path, f"it has more than {largest} bytes", name=name, hint="is it the right file?")
    return data


def _without_waiting(path: str, flags: int) -> int:
    """Open a file so that neither opening nor reading waits for the other end of a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_text(path: Path, *, largest: int = LARGEST_TEXT, name: str = "path") -> str:
    r"""The text of a file in UTF-8, with or without a byte order mark; its lines end with \n.

    Raises:
        CommandRejected: it cannot be read, or is not UTF-8; the text has the line.
    """
    data = read_bytes(path, largest=largest, name=name)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise unreadable(
            path,
            f"line {line} has bytes that are not UTF-8",
            name=name,
            hint="save it as UTF-8 with an editor",
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_xml(path: Path, what: str, *, name: str = "path", hint: str = "") -> ElementTree.Element:
    """The root of an XML file.

    Args:
        path: the file.
        what: it should be, for the error.
        name: of the parameter.
        hint: what to do otherwise.

    Raises:
        CommandRejected: it cannot be read, or is not XML; the text has line and column.
    """
    data = read_bytes(path, name=name)
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # an unknown encoding is a LookupError
        raise unreadable(path, str(error), what=what, name=name, hint=hint) from None


def refuse_existing(path: Path, *, overwrite: bool, name: str = "path") -> Path:
    """Refuse to write where there is a file or a folder; returns the path.

    Raises:
        CommandRejected: there is one, and it is not to be replaced.
    """
    path_of(path, name)
    if not overwrite and os.path.lexists(path):
        raise CommandRejected(
            f"{path} exists",
            parameter=name,
            value=str(path),
            hint="choose another name, or replace it: overwrite=True, on the command line --overwrite",
        )
    return path


def make_folder(folder: Path, *, name: str = "path") -> Path:
    """Make a folder, and those above it, where there is none; returns it.

    Raises:
        CommandRejected: it cannot be made.
    """
    path_of(folder, name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error, name=name) from error
    return folder


def writable_file(path: Path, *, overwrite: bool, name: str = "path") -> Path:
    """Refuse, before anything moves, a file that could not be written at the end; its folder is made.

    Raises:
        CommandRejected: it exists and is not to be replaced, or it cannot be written.
    """
    refuse_existing(path, overwrite=overwrite, name=name)
    make_folder(path.parent, name=name)
    is_new = not os.path.lexists(path)
    if is_new or path.is_file() or path.is_dir():  # a device, such as /dev/stdout, is left alone
        try:
            path.open("ab").close()
        except OSError as error:
            raise unwritable(path, error, name=name) from error
    if is_new:
        path.unlink()
    return path


def read_arrays(path: Path, what: str, *, hint: str = "") -> dict[str, npt.NDArray[Any]]:
    """The arrays of a .npz file by name; numbers and texts only, no code.

    Args:
        path: the file.
        what: it should be, for the error.
        hint: what to do otherwise.

    Raises:
        CommandRejected: it cannot be read or is no such file; the text names the array.
    """
    entry = ""
    try:
        with open_regular(path) as raw, zipfile.ZipFile(raw) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST_ARRAYS:
                raise ValueError(f"its arrays have more than {_LARGEST_ARRAYS} bytes")
            found = {}
            for member in archive.infolist():
                entry = member.filename
                found[entry.removesuffix(".npy")] = _array(archive.read(member))
            return found
    except CommandRejected:
        raise
    except (
        Exception
    ) as error:  # of zipfile, zlib and numpy over any bytes: BadZipFile, error, RuntimeError ...
        where = f"array {shown(entry)}: " if entry else ""
        raise unreadable(path, f"{where}{error or type(error).__name__}", what=what, hint=hint) from None


def _array(data: bytes) -> npt.NDArray[Any]:
    """The array of an .npy file.

    Raises:
        ValueError: it is none, or its size is not what it states.
    """
    raw = io.BytesIO(data)
    version = np.lib.format.read_magic(raw)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"version {version} of the format is unknown")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, is_fortran, dtype = read(raw, max_header_size=_LONGEST_HEADER)
    if dtype.hasobject:
        raise ValueError("it has objects, which could be code")
    rest = data[raw.tell() :]
    if any(length < 0 for length in shape) or prod(shape) * dtype.itemsize != len(rest):
        raise ValueError(f"shape {shape} of {dtype} needs another number of bytes than {len(rest)}")
    if not dtype.itemsize:  # texts of no length, of which a file may claim any number
        if prod(shape) > 1:
            raise ValueError("its entries have no length")
        return np.zeros(shape, dtype)
    flat = np.frombuffer(rest, dtype)
    return flat.reshape(shape, order="F" if is_fortran else "C")
