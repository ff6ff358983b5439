"""The loop in C: the structures that it and Python both use, and its functions.

schema/generate.py writes native/fri_layout.h from the tables of this module.
"""

from __future__ import annotations

import ctypes
import enum
import functools
from typing import Any

from heptarm import _library
from heptarm.fri.guard.fallback import Missing
from heptarm.fri.guard.joint_guard import AXES, Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.loop import law_interface
from heptarm.fri.protocol.messages import MAX_IO

#: What a turn returns instead of a size: the law in Python is to be called.
LAW = -2
#: What a run returns.
TIMEOUT, ENDED, SOCKET_ERROR, CALL_LAW, LAW_FAILED = range(1, 6)
#: A gap in the messages of more command periods than this is bridged by an estimate of the setpoint.
GAP_PERIODS = 5
#: A gap has at least this duration [ns]; skipped cycles of a shorter one are done evenly towards the target.
MIN_GAP = 25_000_000
#: A command given up to this long before commanding starts counts [ns].
GRACE = 50_000_000
#: Largest number of answers that repeat an output until the cabinet shows it.
REPEATS = 50
#: Number of answers that repeat an analog output, which the cabinet may round; an answer may be lost.
REPEATS_ANALOG = 10
#: An arm may stop this far beyond its position limits [rad].
OVERRUN = 0.05
#: Time budget of a law, as a fraction of the command period.
LAW_FRACTION = 0.5
#: A compiled law has failed after this many calls in a row that were too slow, or gave numbers that are not finite.
LAW_PATIENCE = 10
#: A call of a compiled law that has used this much of the processor's time is ended [ns].
LAW_CUT = 20_000_000
#: Beginning of the text of the event after a collision.
COLLIDED = "collision, the arm brakes: "
#: Fallbacks for missing commands, in the numbering of the loop.
MISSING = tuple(Missing)


class LawStatus(enum.IntEnum):
    """How a call of a compiled law ended."""

    OK = 0
    REFUSED = 1
    CRASHED = 2
    ENDLESS = 3
    NOT_FINITE = 4
    SLOW = 5


#: Rows of a structure: type, size (1: no array), names.
Rows = tuple[tuple[str, int, str], ...]


def _limits(kind: type[Limits] | type[PoseLimits]) -> Rows:
    """Rows of the limits of a guard, in the order of their dataclass."""
    sizes = {"reach": 1} if kind is Limits else {}
    return tuple(
        ("real", 6 if "wrench" in name else sizes.get(name, AXES if kind is Limits else 1), name)
        for name in kind.__dataclass_fields__
    )


#: Numbers of `LoopSettings` that the loop in C reads.
SETTINGS = ("busy_poll",)
#: The structures of the loop that Python fills, by name.
STRUCTURES: dict[str, Rows] = {
    "joint_limits": _limits(Limits),
    "pose_limits": _limits(PoseLimits),
    "fri_seam": (
        # the shared memory; the loop sets the last one: where an answer is
        ("pointer", 1, "header states commands events trouble offered outputs reply"),
        ("word", 1, "history"),
        # settings; addresses are as in a socket's, 0: any; times in s
        ("word", 1, "version sock remote parent"),
        ("real", 1, " ".join(SETTINGS)),
        ("struct joint_limits", 1, "joint_limits"),
        ("struct pose_limits", 1, "pose_limits"),
        ("real", AXES, "lowest highest fastest"),
        ("word", 1, "missing"),
        ("real", 1, "patience over"),
        ("word", 1, "has_watch"),
        ("real", AXES, "watch_threshold watch_baseline watch_margin"),
        ("word", 1, "has_chain"),
        ("real", 24, "chain"),
        # the law: what it commands and sees; outputs that one in Python has written, by the place of the signal
        ("struct heptarm_command", 1, "out"),
        ("real", AXES, "dq"),
        ("word", 1, "received has_law written"),
        ("word", MAX_IO, "written_signal written_value"),
        # guard of torques, `struct torque_guard`
        ("pointer", 1, "torque_guard"),
        # a compiled law: function; parameters, what they follow and how fast; memory, counts of what the user's process
        # has written to it; a buffer
        ("pointer", 1, "law params params_target params_rates memory memory_written law_buffer"),
        ("pointer", 1, "params_ring memory_ring memory_set_ring"),
        ("word", 1, "params_size memory_size params_seen memory_seen"),
        ("word", 1, "law_success law_status law_code law_reported law_late law_not_finite"),
        # why the socket failed
        ("word", 1, "error"),
    ),
}
_WORD, _POINTER = ctypes.c_int64, ctypes.c_void_p
_TYPES: dict[str, Any] = {"pointer": _POINTER, "word": _WORD, "real": ctypes.c_double}


def _structure(name: str, rows: Rows) -> type[ctypes.Structure]:
    members = [
        (part, _TYPES[kind] if size == 1 else _TYPES[kind] * size)
        for kind, size, names in rows
        for part in names.split()
    ]
    made = type(name, (ctypes.Structure,), {"_fields_": members})
    _TYPES[f"struct {name}"] = made
    return made


_structure(
    "heptarm_command",
    tuple((kind, shape[0] if shape else 1, name) for kind, shape, name, _ in law_interface.COMMAND),
)
JointLimits, PoseGuardLimits, Seam = (_structure(name, rows) for name, rows in STRUCTURES.items())


@functools.cache
def library() -> ctypes.CDLL:
    """The functions of the loop.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """
    made = _library.library()
    made.fri_new.argtypes, made.fri_new.restype = (_POINTER,), _POINTER
    made.fri_free.argtypes = (_POINTER,)
    made.fri_turn.argtypes = (_POINTER, ctypes.c_char_p, ctypes.c_int, _WORD)
    made.fri_answer.argtypes = (_POINTER,)
    made.fri_finish.argtypes = (_POINTER, _WORD)
    made.fri_run.argtypes = (_POINTER, ctypes.c_int)
    made.fri_end.argtypes = made.fri_may_end.argtypes = made.fri_forget_controller.argtypes = (_POINTER,)
    made.fri_note.argtypes = (_POINTER, _WORD, _WORD, ctypes.c_char_p)
    made.fri_wrench.argtypes = (_POINTER,) * 4
    made.fri_echo.argtypes, made.fri_echo.restype = (ctypes.c_int, _WORD, _POINTER), _WORD
    return made
