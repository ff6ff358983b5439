"""Pictures of a recording: kept as the files that they are, decoded when they are asked for."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.values.checks import Array, finite, flag, frozen, integer, scalar
from heptarm.values.files import path_of, refuse_existing


def decoded(file: bytes) -> npt.NDArray[np.uint8]:
    """The picture of a JPEG file: red, green, blue, shape (height, width, 3).

    Raises:
        MissingExtra: the package Pillow is not installed.
    """
    image = require("PIL.Image", extra="record")
    with image.open(io.BytesIO(file)) as opened:
        return np.asarray(opened.convert("RGB"))


def size_of(file: bytes) -> tuple[int, int]:
    """Width and height of the picture of a JPEG file, which is not decoded.

    Raises:
        MissingExtra: the package Pillow is not installed.
    """
    image = require("PIL.Image", extra="record")
    with image.open(io.BytesIO(file)) as opened:
        return int(opened.width), int(opened.height)


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures of a simulated camera, in order; `heptarm.load(...).pictures`.

    `len(pictures)` is their number, `pictures[i]` one of them as an array.

    Attributes:
        t: when the states that they show were sampled, on the time line of the recording, shape (n,) [s].
        files: the bytes of each as a JPEG file.
        dropped: pictures of all arms that were due and not drawn, because the camera was too slow; only known of a
            complete recording.
    """

    t: Array = field(default_factory=lambda: frozen(np.zeros(0)))
    files: tuple[bytes, ...] = ()
    dropped: int = 0

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self.files)

    def __getitem__(self, index: int) -> npt.NDArray[np.uint8]:
        """A picture: red, green, blue, shape (height, width, 3); -1 is the last one.

        Raises:
            ShapeError: not an integer.
            LimitError: there are not so many.
            MissingExtra: the package Pillow is not installed.
        """
        count = len(self)
        return self._decoded(integer(index, "index", -count, count - 1))

    def __iter__(self) -> Iterator[npt.NDArray[np.uint8]]:
        """All pictures, each decoded when its turn comes."""
        return (self._decoded(index) for index in range(len(self)))

    def _decoded(self, index: int) -> npt.NDArray[np.uint8]:
        return decoded(self.files[index])

    def at(self, t: float) -> npt.NDArray[np.uint8]:
        """The picture that is nearest to a time of the recording [s], shape (height, width, 3).

        Raises:
            CommandRejected: there are no pictures.
            MissingExtra: the package Pillow is not installed.
        """
        moment = finite(t, "t", unit="s")
        if not self.files:
            raise CommandRejected(
                "the recording has no pictures",
                parameter="t",
                value=moment,
                hint="record some with arm.record(..., camera=heptarm.Camera()) or heptarm record --camera",
            )
        return self._decoded(int(np.abs(self.t - moment).argmin()))

    def between(self, begin: float, end: float) -> Pictures:
        """Those of a time of the recording [s].

        Raises:
            ShapeError: not a number.
        """
        first, last = scalar(begin, "begin", unit="s"), scalar(end, "end", unit="s")
        inside = (self.t >= first) & (self.t <= last)
        files = tuple(file for file, is_in in zip(self.files, inside.tolist(), strict=True) if is_in)
        return Pictures(self.t[inside], files, self.dropped)

    def save(self, folder: str | Path, *, overwrite: bool = False) -> list[Path]:
        """Write each to a file named after its number and its time, such as "00012-3.400s.jpg"; returns the files.

        Args:
            folder: is made if it is not there.
            overwrite: replace files of these names that exist.

        Raises:
            CommandRejected: one of the files exists, or cannot be written.
        """
        where = path_of(folder, "folder")
        files = [where / f"{i:05d}-{t:.3f}s.jpg" for i, t in enumerate(self.t.tolist())]
        for path in files:
            refuse_existing(path, overwrite=flag(overwrite, "overwrite"), name="folder")
        try:
            where.mkdir(parents=True, exist_ok=True)
            for path, data in zip(files, self.files, strict=True):
                path.write_bytes(data)
        except OSError as error:
            raise CommandRejected(
                f"{where} cannot be written: {error.strerror}", parameter="folder", value=str(folder)
            ) from error
        return files
