"""Layout of the shared memory of the loop and the user's process, and the guards' reports in it.

schema/generate.py writes the same layout for the loop in C.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from heptarm.fri.guard.joint_guard import AXES, JointReport
from heptarm.fri.guard.pose_guard import PARTS, PoseReport
from heptarm.fri.protocol.messages import JOINTS, MAX_IO, MAX_TRANSFORMATIONS, MONITORED
from heptarm.fri.session.statistics import BINS, COUNTERS
from heptarm.io.shared import MemoryBlock, Note, Ring
from heptarm.values.condition.collision import Collision

# words of the header
STATES, COMMANDS, PARAMS, EVENTS, STOP, STATUS, PID, BEAT, PORT, RELEASE, HISTORY, SIZE = range(12)
# of the law: number of words of its memory, heads of the rings of its memory, calls that took longer than their budget
MEMORY_SIZE, MEMORY, MEMORY_SET, OVERRUNS = range(12, 16)
COUNTS = 16
LIMITED_COUNTS, LIMITED_WORST, LIMITED_ALLOWED = 32, 81, 130
#: Since when a law in Python runs, monotonic clock [ns]; 0: none runs.
LAW_SINCE = 180
#: Number of the session in which commands count, as of the newest state; commands of an older one, not executed.
EPOCH, STALE = 181, 182
LATENCY = 192
JITTER = LATENCY + BINS + 1
POSE_COUNTS = JITTER + BINS + 1
POSE_WORST, POSE_ALLOWED = POSE_COUNTS + 12, POSE_COUNTS + 24
#: The first collision: 1 + joint (0: none), torque and allowed deviation [Nm].
COLLIDED, COLLISION_TORQUE, COLLISION_ALLOWED = range(POSE_COUNTS + 36, POSE_COUNTS + 39)
HEADER_WORDS = POSE_COUNTS + 39

assert COUNTS + len(COUNTERS) <= LIMITED_COUNTS

# words of a state: integers first, then floats
(
    S_SEQ,
    S_RECEIVED,
    S_SEQUENCE,
    S_STAMP,
    S_SESSION,
    S_QUALITY,
    S_MODE,
    S_OVERLAY,
    S_SAFETY,
    S_OPERATION,
    S_CONTROL,
    S_DRIVE,
    S_PERIOD,
    S_MULTIPLIER,
    S_LATENCY,
    S_FLAGS,
    S_REFLECTED,
    S_SENT,
    S_TICKS,
    S_STRATEGY,
) = range(20)
S_TRACKING = 20
#: The joint arrays: those that FRI monitors, then the interpolator's position.
S_ARRAYS = S_TRACKING + 1
ARRAYS = {
    name: slice(S_ARRAYS + JOINTS * i, S_ARRAYS + JOINTS * (i + 1))
    for i, name in enumerate((*MONITORED, "q_ipo"))
}
S_WRENCH = S_ARRAYS + JOINTS * len(ARRAYS)
S_POSE = S_WRENCH + 6
S_E1 = S_POSE + 7
S_Q_SENT = S_E1 + 1
S_TAU_SENT = S_Q_SENT + 7
S_WRENCH_SENT = S_TAU_SENT + 7
S_POSE_IPO = S_WRENCH_SENT + 6
S_POSE_SENT = S_POSE_IPO + 7
S_E1_IPO = S_POSE_SENT + 7
S_E1_SENT = S_E1_IPO + 1
S_IO = S_E1_SENT + 1
STATE_WORDS = S_IO + MAX_IO
#: Value of an enumeration that the controller did not send.
ABSENT = -1

# bits of the flags; ESTIMATED: of the wrench
ANSWERED, FILLED, LIMITED, BRAKING, ESTIMATED = 1, 2, 4, 8, 16

# words of a command: sequence, time [ns], bits of the parts that it has, then the numbers
# the last one is the number of the session that the sender had seen
C_AT, C_GIVEN, C_Q, C_TAU, C_WRENCH, C_POSE, C_E1, C_EPOCH = 1, 2, 3, 10, 17, 23, 30, 31
COMMAND_WORDS, COMMAND_SLOTS = 32, 8
GIVEN_Q, GIVEN_TAU, GIVEN_WRENCH, GIVEN_POSE, GIVEN_E1 = 1, 2, 4, 8, 16

PARAM_SLOTS = MEMORY_SLOTS = 8
# words of an event: sequence, time [ns], kind, then its text
EVENT_WORDS, EVENT_SLOTS = 48, 128
EVENT_TEXT = 8 * (EVENT_WORDS - 3)
NOTE_WORDS = 1024
#: A name in a note: its size, then room for 63 characters in UTF-8.
NAME_BYTES = 256
NAME_WORDS = 1 + NAME_BYTES // 8


class Status(enum.IntEnum):
    """Status of the loop's process."""

    STARTING = 0
    RUNNING = 1
    ENDED = 2
    FAILED = 3
    NO_PORT = 4
    BAD_LAW = 5


class Offer:
    """Names of the signals and requested frames of a session; the loop writes them, the user's process reads them.

    Args:
        block: the memory.
        start: first word.
    """

    def __init__(self, block: MemoryBlock, *, start: int) -> None:
        self._words = block.ints[start : start + NOTE_WORDS]

    @property
    def tick(self) -> int:
        """Counter that changes with every offer."""
        return int(self._words[0])

    def read(self) -> tuple[tuple[tuple[str, int, int], ...], tuple[str, ...]] | None:
        """Name, type and direction of each signal, and names of the frames; None while they are being written."""
        words = self._words.copy()
        if words[0] & 1 or words[0] != self._words[0]:
            return None
        at, signals = 3, []
        for _ in range(int(words[1])):
            signals.append((_name(words[at + 2 :]), int(words[at]), int(words[at + 1])))
            at += 2 + NAME_WORDS
        frames = tuple(_name(words[at + k * NAME_WORDS :]) for k in range(int(words[2])))
        return tuple(signals), frames


class Writes:
    """Outputs and frames that the user's process writes, and the loop reads.

    Args:
        block: the memory.
        start: first word.
    """

    def __init__(self, block: MemoryBlock, *, start: int) -> None:
        self._words = block.ints[start : start + NOTE_WORDS]

    def write(
        self, outputs: Mapping[str, tuple[int, int | float]], frames: Mapping[str, Sequence[float]]
    ) -> None:
        """Write them all; they replace the previous ones.

        Args:
            outputs: by full name the count of the write, which grows with each, and the value, a float if analog.
            frames: by name x y z [m] and quaternion x y z w.
        """
        rows = [np.array([len(outputs), len(frames)])]
        for name, (count, value) in list(outputs.items())[:MAX_IO]:
            is_analog = isinstance(value, float)
            bits = np.array([value], dtype=np.float64 if is_analog else np.uint64).view(np.int64)
            rows += [np.array([count, is_analog]), bits, _name_words(name)]
        for name, pose in list(frames.items())[:MAX_TRANSFORMATIONS]:
            rows += [_name_words(name), np.array(pose, dtype=np.float64).view(np.int64)]
        words = np.concatenate(rows).astype(np.int64)
        self._words[0] |= 1
        self._words[1 : 1 + len(words)] = words
        self._words[0] += 1


def _name(words: npt.NDArray[np.int64]) -> str:
    return words[1:NAME_WORDS].tobytes()[: int(words[0])].decode()


def _name_words(name: str) -> npt.NDArray[np.int64]:
    encoded = name.encode()
    return np.frombuffer(struct.pack("<q", len(encoded)) + encoded.ljust(NAME_BYTES, b"\0"), dtype=np.int64)


class Layout:
    """Rings and notes of a block.

    Args:
        block: the memory.
        history: number of slots of the ring of states.
        params: number of values of the law's parameters.
        memory: number of values of the law's memory.
    """

    def __init__(self, block: MemoryBlock, *, history: int, params: int, memory: int = 0) -> None:
        at = HEADER_WORDS
        self.block = block
        self.states_at = at
        self.states = Ring(block, head=STATES, start=at, slots=history, width=STATE_WORDS)
        at += history * STATE_WORDS
        self.commands_at = at
        self.commands = Ring(block, head=COMMANDS, start=at, slots=COMMAND_SLOTS, width=COMMAND_WORDS)
        at += COMMAND_SLOTS * COMMAND_WORDS
        self.params_at = at
        self.params = Ring(block, head=PARAMS, start=at, slots=PARAM_SLOTS, width=1 + params)
        at += PARAM_SLOTS * (1 + params)
        # the law's memory after each call; what the user's process has written to it, with a count for each value
        self.memory_at = at
        self.memory = Ring(block, head=MEMORY, start=at, slots=MEMORY_SLOTS, width=1 + memory)
        at += MEMORY_SLOTS * (1 + memory)
        self.memory_set_at = at
        self.memory_set = Ring(block, head=MEMORY_SET, start=at, slots=MEMORY_SLOTS, width=1 + 2 * memory)
        at += MEMORY_SLOTS * (1 + 2 * memory)
        self.events_at = at
        self.events = Ring(block, head=EVENTS, start=at, slots=EVENT_SLOTS, width=EVENT_WORDS)
        at += EVENT_SLOTS * EVENT_WORDS
        self.trouble_at = at
        self.trouble = Note(block, start=at, words=NOTE_WORDS)
        self.refused = Note(block, start=at + NOTE_WORDS, words=NOTE_WORDS)
        at += 2 * NOTE_WORDS
        self.offered_at, self.outputs_at = at, at + NOTE_WORDS
        self.offered = Offer(block, start=self.offered_at)
        self.outputs = Writes(block, start=self.outputs_at)
        self.header = block.view(0, LATENCY)
        self.latency = block.view(LATENCY, BINS + 1)
        self.jitter = block.view(JITTER, BINS + 1)

    @staticmethod
    def words(*, history: int, params: int, memory: int = 0) -> int:
        """Size of a block in words."""
        rings = history * STATE_WORDS + COMMAND_SLOTS * COMMAND_WORDS + PARAM_SLOTS * (1 + params)
        rings += MEMORY_SLOTS * (2 + 3 * memory)
        return HEADER_WORDS + rings + EVENT_SLOTS * EVENT_WORDS + 4 * NOTE_WORDS


def read_collision(layout: Layout) -> Collision | None:
    """Read the first collision; None: there was none."""
    ints, floats = layout.block.ints, layout.block.floats
    if not ints[COLLIDED]:
        return None
    return Collision(
        int(ints[COLLIDED]) - 1, float(floats[COLLISION_TORQUE]), float(floats[COLLISION_ALLOWED])
    )


def report_lines(layout: Layout) -> list[str]:
    """Read the reports of both guards as lines of text."""
    found: list[str] = []
    ints, floats = layout.block.ints, layout.block.floats
    for report in (JointReport(), PoseReport()):
        size, (counts, worst, allowed) = _places(report)
        for kind in range(len(report.counts)):
            start, end = size * kind, size * (kind + 1)
            report.counts[kind] = ints[counts + start : counts + end].tolist()
            report.worst[kind] = floats[worst + start : worst + end].tolist()
            report.allowed[kind] = floats[allowed + start : allowed + end].tolist()
        found += report.lines
    return found


def _places(report: JointReport | PoseReport) -> tuple[int, tuple[int, int, int]]:
    """Number of values of a kind, and places of counts, worst and allowed values."""
    if isinstance(report, JointReport):
        return AXES, (LIMITED_COUNTS, LIMITED_WORST, LIMITED_ALLOWED)
    return len(PARTS), (POSE_COUNTS, POSE_WORST, POSE_ALLOWED)
