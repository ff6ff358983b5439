"""Lock-free shared memory of two processes: rings of slots, each with a sequence word.

One process writes a ring and any process may read it. The first word of a slot is odd while the slot is written, and
then holds twice its tick plus two; so a reader detects a slot that is incomplete or overwritten, and nobody ever waits.
Words have eight bytes in native order.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.errors import HeptarmError, shortage, system_errors

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

#: File system in memory, on Linux.
_MEMORY = Path("/dev/shm")


class MemoryBlock:
    """File that both processes map into their memory.

    Args:
        words: size in words of eight bytes; 0 maps an existing file.
        path: the file; None creates one, in memory where the system has a file system for that.

    Raises:
        HeptarmError: there is not so much memory; the hint names remedies.

    Attributes:
        path: the file.
        ints: the words as integers.
        floats: the same words as floats.
    """

    def __init__(self, words: int = 0, *, path: str | None = None) -> None:
        with system_errors("shared memory cannot be opened"):
            if path is None:
                folder = _MEMORY if os.access(_MEMORY, os.W_OK) else None
                handle, path = tempfile.mkstemp(prefix="heptarm-", dir=folder)
            else:
                handle = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
        try:
            if words:
                _reserve(handle, 8 * words)
            self._map = mmap.mmap(handle, 0)
        except OSError as error:
            if words:
                with contextlib.suppress(OSError):
                    os.unlink(path)
            raise HeptarmError(
                f"{8 * words / 1024:.0f} KiB of shared memory cannot be reserved in {os.path.dirname(path)}: "
                f"{(error.strerror or str(error)).lower()}",
                hint=shortage(error)
                or f"free some space there (df -h {os.path.dirname(path)}), or give it more: "
                "mount -o remount,size=256M /dev/shm, docker run --shm-size=256m",
            ) from error
        finally:
            os.close(handle)
        self.path = path
        self.ints: Ints = np.frombuffer(self._map, dtype=np.int64)
        self.floats: Floats = np.frombuffer(self._map, dtype=np.float64)

    def view(self, start: int, size: int) -> memoryview:
        """View words as integers; faster than numpy for single words."""
        return memoryview(self._map)[8 * start : 8 * (start + size)].cast("q")

    def unlink(self) -> None:
        """Delete the file; processes that have mapped it keep the memory."""
        # Windows keeps files that are in use, and the other process may have deleted it already
        with contextlib.suppress(OSError):
            os.unlink(self.path)


def _reserve(handle: int, size: int) -> None:
    """Give a file a size, and reserve all of it: where the memory is full, writing a mapped file kills the process.

    Raises:
        OSError: there is not so much.
    """
    os.truncate(handle, size)
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(handle, 0, size)


class Ring:
    """Ring of slots in a block.

    Args:
        block: the memory.
        head: word that counts the slots written so far.
        start: first word of the slots.
        slots: number of slots.
        width: words of a slot, including its sequence word.

    Attributes:
        ints: shape (slots, width).
        floats: the same words.
    """

    def __init__(self, block: MemoryBlock, *, head: int, start: int, slots: int, width: int) -> None:
        self._head = block.view(head, 1)
        self._marks = block.view(start, slots * width)
        self._slots, self._width = slots, width
        end = start + slots * width
        self.ints = block.ints[start:end].reshape(slots, width)
        self.floats = block.floats[start:end].reshape(slots, width)

    @property
    def count(self) -> int:
        """Number of slots written so far; the newest tick is one less."""
        return self._head[0]

    def begin(self) -> int:
        """Open the next slot for writing and return its index."""
        tick = self._head[0]
        slot = tick % self._slots
        self._marks[slot * self._width] = 2 * tick + 1
        return slot

    def end(self) -> None:
        """Mark the open slot as complete."""
        tick = self._head[0]
        self._marks[tick % self._slots * self._width] = 2 * tick + 2
        self._head[0] = tick + 1

    def write(self, floats: Sequence[float] | Floats, *, at: int = 1) -> None:
        """Write a slot of floats, starting at word `at`."""
        slot = self.begin()
        self.floats[slot, at : at + len(floats)] = floats
        self.end()

    def read(self, tick: int) -> Floats | None:
        """Copy the slot of a tick, shape (width,); None if it is missing, incomplete or overwritten."""
        slot = tick % self._slots
        mark = slot * self._width
        if self._marks[mark] != 2 * tick + 2:
            return None
        copy: Floats = self.floats[slot].copy()
        return copy if self._marks[mark] == 2 * tick + 2 else None

    def since(self, tick: int) -> tuple[Floats, int, int]:
        """Copy all slots from a tick on.

        Returns:
            Those that are complete, shape (n, width); the tick after the last one; how many were overwritten before.
        """
        count = self._head[0]
        first = max(tick, count - self._slots, 0)
        ticks = np.arange(first, count)
        places, marks = ticks % self._slots, 2 * ticks + 2
        before = self.ints[places, 0] == marks
        copies: Floats = self.floats[places]
        whole = before & (self.ints[places, 0] == marks)
        return copies[whole], count, first - tick + int((~whole).sum())

    def newest(self) -> Floats | None:
        """Copy the newest slot; None if there is none. Retry while the writer overtakes the reader."""
        for _ in range(16):
            count = self._head[0]
            if count == 0:
                return None
            copy = self.read(count - 1)
            if copy is not None:
                return copy
        return None


class Note:
    """Text that one process writes and another reads; a new text replaces the old one.

    Args:
        block: the memory.
        start: first word.
        words: size, including two words for sequence and length.
    """

    def __init__(self, block: MemoryBlock, *, start: int, words: int) -> None:
        self._words = block.view(start, 2)
        self._text = block.ints[start + 2 : start + words].view(np.uint8)

    @property
    def tick(self) -> int:
        """Counter that changes with every text."""
        return self._words[0]

    def write(self, text: str) -> None:
        """Write a text.

        Raises:
            ValueError: the text does not fit.
        """
        encoded = text.encode()
        if len(encoded) > len(self._text):
            raise ValueError(f"text must have at most {len(self._text)} bytes, got {len(encoded)}")
        self._words[0] |= 1
        self._text[: len(encoded)] = np.frombuffer(encoded, dtype=np.uint8)
        self._words[1] = len(encoded)
        self._words[0] += 1

    def read(self) -> str | None:
        """Read the text; None if the writer keeps interrupting."""
        for _ in range(16):
            tick = self._words[0]
            encoded = self._text[: self._words[1]].tobytes()
            if not tick & 1 and self._words[0] == tick:
                return encoded.decode(errors="replace")
        return None
