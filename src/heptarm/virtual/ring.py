"""The shared ring: the plant's last 256 states in memory that Java reads without asking Python.

Eight-octet words, native order. Each slot is guarded by a sequence word (odd while it is written), so a
reader knows a torn slot. Behind the slots lies a box for the other direction: the newest servo target, guarded in
the same way. Then comes the IO image, one real a signal, which both sides read and write. The layout here and in
heptarm.doubles.Ring (Java) is the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

SLOTS = 256
WORDS = 64
HEADER_WORDS = 8
BOX_WORDS = 32
SIGNALS = 512
SIZE = 8 * (HEADER_WORDS + SLOTS * WORDS + BOX_WORDS + SIGNALS)

# words of the header
NEWEST, SLOT_COUNT, ANCHOR, RATE, WAKE, OVERRIDE = range(6)
# words of a slot
SEQ, TIME, Q, Q_CMD, DQ, TAU, TAU_EXT, TAU_CMD, POSE, WRENCH = 0, 1, 2, 9, 16, 23, 30, 37, 44, 51
FLAGS, MODE, ORDER, PROGRESS, REMAINING, E1, REDUNDANCY = 57, 58, 59, 60, 61, 62, 63

# words of the box behind the slots, in which Java leaves the newest servo target; kinds of targets
BOX_SEQ, BOX_ORDER, BOX_KIND, BOX_Q, BOX_DQ = 0, 1, 2, 3, 10
TO_JOINTS, TO_JOINTS_WITH_VELOCITY = 1, 2  # a straight servo motion takes a pose in the place of joints

# bits of the flags word
READY, PAUSED, BRAKES_OPEN, MOVING, MASTERED, EMERGENCY_STOP, ENABLED = (1 << i for i in range(7))
EXTERNAL_STOP, SAFEGUARD_OPEN, PROTECTIVE_STOP, DRIVE_ERROR, HAND_GUIDING = (1 << i for i in range(7, 12))

NEVER = 2**63 - 1


class Target(NamedTuple):
    """A servo target as Java left it.

    Attributes:
        order: id of the servo motion that it is for.
        q: joint positions, shape (7,) [rad]; of a straight servo motion x y z [m] and quaternion of the moved frame.
        dq: velocity to pass them at, shape (7,) [rad/s], or None.
    """

    order: int
    q: np.ndarray
    dq: np.ndarray | None


class Ring:
    """Writes and reads the shared ring.

    Attributes:
        memory: the octets, shared with Java.
        header: header words as integers.
        reals: header words as floats, for rate and override.
        ints: slots as integers, shape (256, 64).
        floats: the same words as floats.
        signals: values of the IO image, shape (512,).
    """

    def __init__(self) -> None:
        self.memory = bytearray(SIZE)
        words = np.frombuffer(self.memory, dtype=np.int64)
        reals = np.frombuffer(self.memory, dtype=np.float64)
        self.header = words[:HEADER_WORDS]
        self.reals = reals[:HEADER_WORDS]
        box = HEADER_WORDS + SLOTS * WORDS
        self.ints = words[HEADER_WORDS:box].reshape(SLOTS, WORDS)
        self.floats = reals[HEADER_WORDS:box].reshape(SLOTS, WORDS)
        self._box, self._box_reals = words[box : box + BOX_WORDS], reals[box : box + BOX_WORDS]
        self.signals = reals[box + BOX_WORDS :]
        self._box_seen = 0
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

    def post(self, order: int, q: np.ndarray, dq: np.ndarray | None = None) -> None:
        """Leave a servo target, as Java does; for those who drive the plant without Java."""
        box, reals = self._box, self._box_reals
        box[BOX_SEQ] += 1
        box[BOX_ORDER] = order
        box[BOX_KIND] = TO_JOINTS if dq is None else TO_JOINTS_WITH_VELOCITY
        reals[BOX_Q : BOX_Q + 7] = q
        reals[BOX_DQ : BOX_DQ + 7] = 0.0 if dq is None else dq
        box[BOX_SEQ] += 1

    def target(self) -> Target | None:
        """The newest servo target; None if there is none that was not taken before, or it is just being left."""
        box = self._box
        seq = int(box[BOX_SEQ])
        if seq == self._box_seen or seq & 1:
            return None
        reals = self._box_reals
        q, dq = reals[BOX_Q : BOX_Q + 7].copy(), reals[BOX_DQ : BOX_DQ + 7].copy()
        order, kind = int(box[BOX_ORDER]), int(box[BOX_KIND])
        if int(box[BOX_SEQ]) != seq:
            return None
        self._box_seen = seq
        return Target(order, q, dq if kind == TO_JOINTS_WITH_VELOCITY else None)
