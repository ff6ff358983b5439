"""Layout of the shared memory of the loop and the user's process, and the guards' reports in it.

schema/generate.py writes the same layout for the native loop.
"""

from __future__ import annotations

import enum

from heptarm.fri.guard.joint_guard import AXES, JointReport
from heptarm.fri.guard.pose_guard import PARTS, PoseReport
from heptarm.fri.protocol.messages import JOINTS, MAX_IO, MONITORED
from heptarm.fri.session.statistics import BINS, COUNTERS
from heptarm.io.shared import MemoryBlock, Note, Ring

# words of the header
STATES, COMMANDS, PARAMS, EVENTS, STOP, STATUS, PID, BEAT, PORT, NATIVE, HISTORY, SIZE = range(12)
# of the law: number of words of its memory, heads of the rings of its memory, calls that took longer than their budget
MEMORY_SIZE, MEMORY, MEMORY_SET, OVERRUNS = range(12, 16)
COUNTS = 16
LIMITED_COUNTS, LIMITED_WORST, LIMITED_ALLOWED = 32, 81, 130
LATENCY = 192
JITTER = LATENCY + BINS + 1
POSE_COUNTS = JITTER + BINS + 1
POSE_WORST, POSE_ALLOWED = POSE_COUNTS + 12, POSE_COUNTS + 24
HEADER_WORDS = POSE_COUNTS + 36

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
C_AT, C_GIVEN, C_Q, C_TAU, C_WRENCH, C_POSE, C_E1 = 1, 2, 3, 10, 17, 23, 30
COMMAND_WORDS, COMMAND_SLOTS = 31, 8
GIVEN_Q, GIVEN_TAU, GIVEN_WRENCH, GIVEN_POSE, GIVEN_E1 = 1, 2, 4, 8, 16

PARAM_SLOTS = MEMORY_SLOTS = 8
# words of an event: sequence, time [ns], kind, then its text
EVENT_WORDS, EVENT_SLOTS = 48, 128
EVENT_TEXT = 8 * (EVENT_WORDS - 3)
NOTE_WORDS = 1024


class Status(enum.IntEnum):
    """Status of the loop's process."""

    STARTING = 0
    RUNNING = 1
    ENDED = 2
    FAILED = 3
    NO_PORT = 4
    BAD_LAW = 5


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
        self.events = Ring(block, head=EVENTS, start=at, slots=EVENT_SLOTS, width=EVENT_WORDS)
        at += EVENT_SLOTS * EVENT_WORDS
        notes = []
        for _ in range(5):
            notes.append(Note(block, start=at, words=NOTE_WORDS))
            at += NOTE_WORDS
        self.config, self.trouble, self.refused, self.offered, self.outputs = notes
        self.outputs_at = at - NOTE_WORDS
        self.header = block.view(0, LATENCY)
        self.latency = block.view(LATENCY, BINS + 1)
        self.jitter = block.view(JITTER, BINS + 1)

    @staticmethod
    def words(*, history: int, params: int, memory: int = 0) -> int:
        """Size of a block in words."""
        rings = history * STATE_WORDS + COMMAND_SLOTS * COMMAND_WORDS + PARAM_SLOTS * (1 + params)
        rings += MEMORY_SLOTS * (2 + 3 * memory)
        return HEADER_WORDS + rings + EVENT_SLOTS * EVENT_WORDS + 5 * NOTE_WORDS


def write_report(layout: Layout, report: JointReport | PoseReport) -> None:
    """Write the report of a guard."""
    ints, floats = layout.block.ints, layout.block.floats
    size, (counts, worst, allowed) = _places(report)
    for kind in range(len(report.counts)):
        start, end = size * kind, size * (kind + 1)
        ints[counts + start : counts + end] = report.counts[kind]
        floats[worst + start : worst + end] = report.worst[kind]
        floats[allowed + start : allowed + end] = report.allowed[kind]


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
