"""Memory that two processes share without locks: rings of slots, each guarded by a sequence word.

One process writes a ring and any may read it. A slot's first word is odd while it is written and afterwards names the
tick it holds, so a reader knows a torn or overwritten slot and nobody ever waits. Words have eight octets, native
order.
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

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

#: Where files live in memory, on Linux.
_MEMORY = Path("/dev/shm")


class Block:
    """A piece of memory by the name of a file; both processes map the same one.

    Args:
        words: its size in eight-octet words; 0 to map an existing one.
        path: the file; None makes a new one, in memory where the system has a place for that.

    Attributes:
        path: the file.
        ints: the words as integers.
        floats: the same words as floats.
    """

    def __init__(self, words: int = 0, *, path: str | None = None) -> None:
        if path is None:
            folder = _MEMORY if os.access(_MEMORY, os.W_OK) else None
            handle, path = tempfile.mkstemp(prefix="heptarm-", dir=folder)
        else:
            handle = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
        try:
            if words:
                os.truncate(handle, 8 * words)
            self._map = mmap.mmap(handle, 0)
        finally:
            os.close(handle)
        self.path = path
        self.ints: Ints = np.frombuffer(self._map, dtype=np.int64)
        self.floats: Floats = np.frombuffer(self._map, dtype=np.float64)

    def view(self, start: int, size: int) -> memoryview:
        """Integer words that Python reads and writes one by one, faster than through numpy."""
        return memoryview(self._map)[8 * start : 8 * (start + size)].cast("q")

    def unlink(self) -> None:
        """Take the file away; the memory lives on in those who have it mapped."""
        with contextlib.suppress(
            OSError
        ):  # Windows keeps files that are in use; the other side may be faster
            os.unlink(self.path)


class Ring:
    """Slots in a block.

    Args:
        block: where.
        head: word that counts the slots written so far.
        start: first word of the slots.
        slots: how many.
        width: words of a slot, its sequence word included.

    Attributes:
        ints: shape (slots, width).
        floats: the same words.
    """

    def __init__(self, block: Block, *, head: int, start: int, slots: int, width: int) -> None:
        self._head = block.view(head, 1)
        self._marks = block.view(start, slots * width)
        self._slots, self._width = slots, width
        end = start + slots * width
        self.ints = block.ints[start:end].reshape(slots, width)
        self.floats = block.floats[start:end].reshape(slots, width)

    @property
    def count(self) -> int:
        """Slots written so far; the newest tick is one less."""
        return self._head[0]

    def begin(self) -> int:
        """Open the next slot for writing; returns its index."""
        tick = self._head[0]
        slot = tick % self._slots
        self._marks[slot * self._width] = 2 * tick + 1
        return slot

    def end(self) -> None:
        """The opened slot is complete."""
        tick = self._head[0]
        self._marks[tick % self._slots * self._width] = 2 * tick + 2
        self._head[0] = tick + 1

    def write(self, floats: Sequence[float] | Floats, *, at: int = 1) -> None:
        """Write a slot of floats from word `at` on."""
        slot = self.begin()
        self.floats[slot, at : at + len(floats)] = floats
        self.end()

    def read(self, tick: int) -> Floats | None:
        """A copy of a tick's slot, shape (width,); None if it is not written, torn or overwritten."""
        slot = tick % self._slots
        mark = slot * self._width
        if self._marks[mark] != 2 * tick + 2:
            return None
        copy: Floats = self.floats[slot].copy()
        return copy if self._marks[mark] == 2 * tick + 2 else None

    def newest(self) -> Floats | None:
        """A copy of the newest slot; None if there is none. Readers of a ring that is overrun try again."""
        for _ in range(16):
            count = self._head[0]
            if count == 0:
                return None
            copy = self.read(count - 1)
            if copy is not None:
                return copy
        return None


class Note:
    """A text that one process leaves for another; the last one stands.

    Args:
        block: where.
        start: first word.
        words: size, two words of it for sequence and length.
    """

    def __init__(self, block: Block, *, start: int, words: int) -> None:
        self._words = block.view(start, 2)
        self._text = block.ints[start + 2 : start + words].view(np.uint8)

    @property
    def tick(self) -> int:
        """Changes with every text."""
        return self._words[0]

    def write(self, text: str) -> None:
        """Leave a text.

        Raises:
            ValueError: it does not fit.
        """
        octets = text.encode()
        if len(octets) > len(self._text):
            raise ValueError(f"a text of {len(octets)} octets; {len(self._text)} fit")
        self._words[0] |= 1
        self._text[: len(octets)] = np.frombuffer(octets, dtype=np.uint8)
        self._words[1] = len(octets)
        self._words[0] += 1

    def read(self) -> str | None:
        """The text; None if it is being written all the time."""
        for _ in range(16):
            tick = self._words[0]
            octets = self._text[: self._words[1]].tobytes()
            if not tick & 1 and self._words[0] == tick:
                return octets.decode(errors="replace")
        return None
