"""The shared ring: the plant's last 256 states in memory that Java reads without asking Python.

Eight-octet words, native order. Each slot is guarded by a sequence word (odd while it is written), so a
reader knows a torn slot. The layout here and in heptarm.doubles.Ring (Java) is the same.
"""

from __future__ import annotations

import numpy as np

SLOTS = 256
WORDS = 64
HEADER_WORDS = 8
SIZE = 8 * (HEADER_WORDS + SLOTS * WORDS)

# words of the header
NEWEST, SLOT_COUNT, ANCHOR, RATE, WAKE, OVERRIDE = range(6)
# words of a slot
SEQ, TIME, Q, Q_CMD, DQ, TAU, TAU_EXT, TAU_CMD, POSE, WRENCH = 0, 1, 2, 9, 16, 23, 30, 37, 44, 51
FLAGS, MODE, ORDER, PROGRESS, REMAINING, E1, REDUNDANCY = 57, 58, 59, 60, 61, 62, 63

# bits of the flags word
READY, PAUSED, BRAKES_OPEN, MOVING, MASTERED, EMERGENCY_STOP, ENABLING_NEEDED = (1 << i for i in range(7))

NEVER = 2**63 - 1


class Ring:
    """Writes and reads the shared ring.

    Attributes:
        memory: the octets, shared with Java.
        header: header words as integers.
        reals: header words as floats, for rate and override.
        ints: slots as integers, shape (256, 64).
        floats: the same words as floats.
    """

    def __init__(self) -> None:
        self.memory = bytearray(SIZE)
        words = np.frombuffer(self.memory, dtype=np.int64)
        reals = np.frombuffer(self.memory, dtype=np.float64)
        self.header = words[:HEADER_WORDS]
        self.reals = reals[:HEADER_WORDS]
        self.ints = words[HEADER_WORDS:].reshape(SLOTS, WORDS)
        self.floats = reals[HEADER_WORDS:].reshape(SLOTS, WORDS)
        self.header[NEWEST] = -1
        self.header[SLOT_COUNT] = SLOTS
        self.header[WAKE] = NEVER
        self.reals[OVERRIDE] = 1.0

    def read(self, tick: int) -> np.ndarray | None:
        """A copy of a tick's slot as floats, shape (64,); None if it is torn or overwritten."""
        slot = tick % SLOTS
        if self.ints[slot, SEQ] != 2 * tick + 2:
            return None
        copy = self.floats[slot].copy()
        return copy if self.ints[slot, SEQ] == 2 * tick + 2 else None
