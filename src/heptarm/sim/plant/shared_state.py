"""Shared memory of the plant and Java: its last states, the newest servo target, and the IO image.

Java reads states without asking Python. Each state is guarded by a sequence word (odd while it is written), so that a
reader recognises a torn one; so is the servo target, which Java writes. The layout is that of `heptarm.planning.seam`.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from heptarm.planning.seam import (
    MEMORY_WORDS,
    SLOTS,
    HeaderWords,
    ImageWords,
    StateWords,
    TargetKind,
    TargetWords,
)

NEVER = 2**63 - 1


class NewestTarget(NamedTuple):
    """A servo target as Java wrote it.

    Attributes:
        order: id of its servo motion.
        q: joint positions, shape (7,) [rad]; of a straight servo motion x y z [m] and quaternion of the motion frame.
        dq: velocity at the positions, shape (7,) [rad/s], or None.
    """

    order: int
    q: np.ndarray
    dq: np.ndarray | None


class SharedState:
    """Writes and reads the shared memory.

    Attributes:
        memory: the bytes, shared with Java.
        header: header words as integers.
        reals: header words as floats, for rate and override.
        ints: states as integers, shape (SLOTS, StateWords.SIZE).
        floats: the same words as floats.
        signals: values of the IO image, shape (SIGNALS,).
    """

    def __init__(self) -> None:
        self.memory = bytearray(8 * MEMORY_WORDS)
        words = np.frombuffer(self.memory, dtype=np.int64)
        reals = np.frombuffer(self.memory, dtype=np.float64)
        self.header = words[HeaderWords.SECTION]
        self.reals = reals[HeaderWords.SECTION]
        self.ints = words[StateWords.SECTION].reshape(SLOTS, StateWords.SIZE)
        self.floats = reals[StateWords.SECTION].reshape(SLOTS, StateWords.SIZE)
        self._target, self._target_reals = words[TargetWords.SECTION], reals[TargetWords.SECTION]
        self.signals = reals[ImageWords.SECTION]
        self._target_seen = 0
        self.header[HeaderWords.NEWEST] = -1
        self.header[HeaderWords.WAKE] = NEVER
        self.reals[HeaderWords.OVERRIDE] = 1.0

    def read(self, tick: int) -> np.ndarray | None:
        """A copy of a tick's state as floats, shape (StateWords.SIZE,); None if it is torn or overwritten."""
        slot = tick % SLOTS
        if self.ints[slot, StateWords.SEQ] != 2 * tick + 2:
            return None
        copy = self.floats[slot].copy()
        return copy if self.ints[slot, StateWords.SEQ] == 2 * tick + 2 else None

    def post(self, order: int, q: np.ndarray, dq: np.ndarray | None = None) -> None:
        """Write a servo target, as Java does; for programs that drive the plant without Java."""
        words, reals = self._target, self._target_reals
        words[TargetWords.SEQ] += 1
        words[TargetWords.ORDER] = order
        words[TargetWords.KIND] = TargetKind.POSITION if dq is None else TargetKind.POSITION_WITH_VELOCITY
        reals[TargetWords.Q] = q
        reals[TargetWords.DQ] = 0.0 if dq is None else dq
        words[TargetWords.SEQ] += 1

    def target(self) -> NewestTarget | None:
        """The newest servo target; None if it was taken before or is being written."""
        words = self._target
        seq = int(words[TargetWords.SEQ])
        if seq == self._target_seen or seq & 1:
            return None
        reals = self._target_reals
        q, dq = reals[TargetWords.Q].copy(), reals[TargetWords.DQ].copy()
        order, kind = int(words[TargetWords.ORDER]), int(words[TargetWords.KIND])
        if int(words[TargetWords.SEQ]) != seq:
            return None
        self._target_seen = seq
        return NewestTarget(order, q, dq if kind == TargetKind.POSITION_WITH_VELOCITY else None)


class PositionsFile:
    """A file with the newest positions of the whole world, which another process maps: the view.

    Args:
        path: of the file.
        size: number of positions.
    """

    def __init__(self, path: Path, size: int) -> None:
        if not path.exists() or path.stat().st_size != 8 * (size + 2):
            path.write_bytes(bytes(8 * (size + 2)))
        self._values = np.memmap(path, dtype=np.float64, shape=(size + 2,))

    def write(self, positions: np.ndarray) -> None:
        """Replace them; shape (size,)."""
        count = self._values[0] + 1.0
        self._values[0] = count
        self._values[2:] = positions
        self._values[1] = count

    def read(self) -> np.ndarray | None:
        """The newest positions, shape (size,); None if there are none yet or they are being written."""
        end = float(self._values[1])
        copy = np.array(self._values[2:])
        return copy if end > 0.0 and self._values[0] == end else None


class Trace:
    """Writes the state after each tick to a file, with which readings of the state can be compared.

    Args:
        shared: where the states are.
        path: of the file, which is replaced.
    """

    def __init__(self, shared: SharedState, path: Path) -> None:
        self._shared = shared
        self._file = path.open("wb", buffering=0)  # readers see each tick at once

    def append(self) -> None:
        """Write the newest state; called after each tick."""
        self._file.write(self._shared.ints[int(self._shared.header[HeaderWords.NEWEST]) % SLOTS].data)

    def close(self) -> None:
        """Write what is left."""
        self._file.close()

    @staticmethod
    def read(path: Path) -> np.ndarray:
        """States of a file as floats, shape (ticks, StateWords.SIZE); a last state that is not complete is left out."""
        words = np.fromfile(path, dtype=np.float64)
        return words[: len(words) - len(words) % StateWords.SIZE].reshape(-1, StateWords.SIZE)
