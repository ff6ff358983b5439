"""Native part of the loop in C: build, load, and synchronise its state with the Python cycle.

The Python cycle is the reference. The native part answers messages that differ from the previous one in numbers only
and hands back any other; the Python cycle then continues from the state of the native part.
"""

from __future__ import annotations

import ctypes
import functools
import socket
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from heptarm.fri.guard.fallback import Missing
from heptarm.fri.guard.joint_guard import AXES, Limited
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import Cycle
from heptarm.fri.protocol.messages import CommandMode, SessionState
from heptarm.fri.protocol.protobuf import fields
from heptarm.fri.protocol.version import unwrap
from heptarm.fri.session.statistics import BINS
from heptarm.io.compiled import Unavailable, compiled_library

HANDBACK, LAW = -1, -2
TIMEOUT, HANDED_BACK, CHECK, SOCKET_ERROR, CALL_LAW = range(5)
BUFFER = 2048
#: Largest size of robot and connection info in messages for the native part.
MAX_PLAIN = 64

_SOURCE = Path(__file__).with_name("native.c")
_HEADER = _SOURCE.with_name("native_layout.h")
_WORD, _POINTER = ctypes.c_int64, ctypes.c_void_p
#: Fallbacks for missing commands, in the numbering of the native part.
MISSING = tuple(Missing)
_JOINT_MODES = (CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH)


#: `struct loop` of native.c, whose header schema/generate.py writes from this table: type, size (1: no array), names.
STRUCT: tuple[tuple[str, int, str], ...] = (
    ("pointer", 1, "header latency jitter states commands outputs"),
    ("word", 1, "history bins sock address port"),
    # session
    ("word", 1, "hot framed echoes state quality mode sequence received period"),
    ("word", 1, "multiplier waiting sent reflected"),
    ("word", 1, "overlay safety operation control drive receive_multiplier"),
    ("word", 1, "robot_size connection_size"),
    ("char", MAX_PLAIN, "robot connection"),
    # commanding
    ("word", 1, "is_started is_ending has_law ticks commands_seen outputs_seen started"),
    ("word", 1, "ipo_known ipo_sequence"),
    ("real", AXES, "ipo slope"),
    # guard
    ("real", AXES, "q v a r tau"),
    ("real", 6, "wrench"),
    ("real", AXES, "low high top_v top_a top_j near dq_max ddq_max dddq_max tau_max tau_step"),
    ("real", 6, "wrench_max wrench_step"),
    ("real", 1, "reach step"),
    # plausible positions
    ("real", AXES, "plausible_low plausible_high"),
    # fallback for missing commands
    ("word", 1, "f_at f_has_q f_has_slope f_has_tau f_has_wrench f_missing"),
    ("real", AXES, "f_q f_slope f_tau"),
    ("real", 6, "f_wrench"),
    ("real", 1, "patience over"),
    # output of the user's law
    ("real", AXES, "out_q out_tau"),
    ("real", 6, "out_wrench"),
    # this cycle; t_known has one bit for each array of t_arrays, which are those of a state from S_ARRAYS on
    ("word", 1, "t_flags t_received t_answer t_size t_stamp t_known"),
    ("real", 1, "t_tracking"),
    ("real", at.S_WRENCH - at.S_ARRAYS, "t_arrays"),
    ("real", 6, "t_wrench"),
    ("real", AXES, "t_pose"),
    ("real", 1, "t_e1"),
    ("byte", BUFFER, "t_datagram t_reply"),
)
_INFO = ("overlay", "safety", "operation", "control", "drive", "receive_multiplier")
_TYPES: dict[str, Any] = {
    "pointer": ctypes.c_void_p,
    "word": _WORD,
    "real": ctypes.c_double,
    "char": ctypes.c_char,
    "byte": ctypes.c_uint8,
}


class _Memory(ctypes.Structure):
    """`struct loop` of native.c."""

    _fields_ = tuple(
        (name, _TYPES[kind] if size == 1 else _TYPES[kind] * size)
        for kind, size, names in STRUCT
        for name in names.split()
    )


@functools.cache
def library() -> ctypes.CDLL:
    """Load the native part; compile it at the first use and keep it in the user's cache.

    Raises:
        Unavailable: this system is not supported, or has no compiler.
    """
    layout = f'#include "{_HEADER.name}"'.encode()
    made = compiled_library("fri", _SOURCE.read_bytes().replace(layout, _HEADER.read_bytes()))
    made.hf_size.restype = _WORD
    made.hf_turn.argtypes = (_POINTER, ctypes.c_char_p, ctypes.c_int, _WORD)
    made.hf_answer.argtypes = (_POINTER,)
    made.hf_finish.argtypes = (_POINTER, _WORD)
    made.hf_send.argtypes = (_POINTER,)
    made.hf_run.argtypes = (_POINTER, _WORD, _POINTER)
    if made.hf_size() != ctypes.sizeof(_Memory):
        raise Unavailable(f"`struct loop` must have {ctypes.sizeof(_Memory)} bytes, got {made.hf_size()}")
    return made


class Native:
    """Native part of one loop.

    Args:
        cycle: the Python cycle with which it alternates.

    Attributes:
        memory: `struct loop`.

    Raises:
        Unavailable: the native part is not available.
    """

    def __init__(self, cycle: Cycle) -> None:
        self.library = library()
        self._cycle = cycle
        self.memory = memory = _Memory()
        self.reference = ctypes.byref(memory)
        self.sender = (_WORD * 2)()
        self._is_newer = False
        layout, base = cycle.layout, cycle.layout.block.ints.ctypes.data
        memory.header, memory.latency, memory.jitter = base, base + 8 * at.LATENCY, base + 8 * at.JITTER
        memory.states, memory.commands = base + 8 * layout.states_at, base + 8 * layout.commands_at
        memory.outputs = base + 8 * layout.outputs_at
        memory.history, memory.bins = len(layout.states.ints), BINS
        memory.has_law = cycle.law is not None
        limits, policy = cycle.guard.limits, cycle.fallback.policy
        for name in ("dq_max", "ddq_max", "dddq_max", "tau_max", "wrench_max"):
            getattr(memory, name)[:] = getattr(limits, name)
        memory.reach = limits.reach
        memory.plausible_low[:], memory.plausible_high[:] = cycle.session.low, cycle.session.high
        memory.f_missing = MISSING.index(policy.missing)
        memory.patience, memory.over = policy.patience, policy.over

    def listen(self, sock: socket.socket, peer: tuple[str, int] | None) -> None:
        """Set the socket, and the address of the controller."""
        self.memory.sock = sock.fileno()
        if peer is not None:
            self.memory.address = int.from_bytes(socket.inet_aton(peer[0]), "little")
            self.memory.port = peer[1]

    @property
    def datagram(self) -> bytes:
        """Datagram that was handed back."""
        return bytes(memoryview(self.memory.t_datagram)[: self.memory.t_size])

    @property
    def sender_address(self) -> tuple[str, int]:
        """Sender of the datagram that was handed back."""
        return socket.inet_ntoa(int(self.sender[0]).to_bytes(4, "little")), int(self.sender[1])

    def sync_from_python(self, datagram: bytes) -> None:
        """Copy the state of the Python cycle to the native part, which continues from it.

        The native part stays inactive in sessions with signals, frames or poses.

        Args:
            datagram: the last message, with which it compares the next one.
        """
        cycle, memory = self._cycle, self.memory
        session, guard, fallback = cycle.session, cycle.guard, cycle.fallback
        sample, version, state, mode = session.sample, session.version, session.state, session.mode
        commanding = state in (SessionState.COMMANDING_WAIT, SessionState.COMMANDING_ACTIVE)
        memory.hot = 0
        if sample is None or version is None or state is SessionState.IDLE or sample.connection is None:
            return
        if session.trouble:  # the next message of this session has to clear it
            return
        if commanding and (mode not in _JOINT_MODES or sample.q_ipo is None):
            return
        if not cycle.exchange.is_idle:  # Python handles signals and frames
            return
        if state is SessionState.COMMANDING_ACTIVE and not guard.is_started:
            return
        parts = {
            tag: value for tag, _, value in fields(unwrap(datagram, version)) if isinstance(value, bytes)
        }
        robot, connection = parts.get(2), parts.get(4, b"")
        if max(len(robot or b""), len(connection)) > MAX_PLAIN or set(parts) - {1, 2, 3, 4, 5}:
            return
        memory.robot_size = -1 if robot is None else len(robot)
        memory.connection_size = len(connection)
        ctypes.memmove(_address(memory, "robot"), robot or b"", len(robot or b""))
        ctypes.memmove(_address(memory, "connection"), connection, len(connection))
        memory.framed, memory.echoes = version.traits.framed, not version.traits.quaternions
        memory.state, memory.quality, memory.mode = state, session.quality, mode
        memory.sequence, memory.received = sample.sequence, session.received
        memory.period, memory.multiplier = session.period, session.multiplier
        memory.waiting, memory.sent, memory.reflected = session.waiting, session.sent, session.reflected
        for name, number in zip(_INFO, cycle.record.info[2], strict=True):
            setattr(memory, name, number)
        memory.is_started, memory.is_ending = guard.is_started, cycle.is_ending
        memory.ticks, memory.started = cycle.record.ticks, cycle.started
        memory.commands_seen, memory.outputs_seen = cycle.commands_seen, cycle.exchange.outputs_seen
        memory.ipo_known = cycle.mirrored is not None
        if cycle.mirrored is not None:
            memory.ipo[:], memory.ipo_sequence = cycle.mirrored
        memory.slope[:] = cycle.slope
        for name in ("q", "v", "a", "r", "tau", "wrench", "low", "high", "near"):
            getattr(memory, name)[:] = getattr(guard, name)
        memory.top_v[:], memory.top_a[:], memory.top_j[:] = guard.V, guard.A, guard.J
        memory.step = guard.period
        memory.tau_step[:] = [rate * guard.period for rate in guard.limits.dtau_max]
        memory.wrench_step[:] = [rate * guard.period for rate in guard.limits.dwrench_max]
        memory.f_at = fallback.at
        for name in ("q", "slope", "tau", "wrench"):
            value: Sequence[float] | None = getattr(fallback, name)
            setattr(memory, f"f_has_{name}", value is not None)
            if value is not None:
                getattr(memory, f"f_{name}")[:] = value
        memory.hot = 1
        self._is_newer = True

    def sync_to_python(self) -> None:
        """Copy the state of the native part to the Python cycle, which continues from it."""
        cycle, memory = self._cycle, self.memory
        if not self._is_newer:
            return
        self._is_newer = False
        session, guard, fallback = cycle.session, cycle.guard, cycle.fallback
        assert session.sample is not None
        header = cycle.layout.header
        session.counters.load(header, at.COUNTS)
        session.sample.sequence, session.received = memory.sequence, memory.received
        session.waiting, session.sent, session.reflected = memory.waiting, memory.sent, memory.reflected
        cycle.record.ticks, cycle.commands_seen = memory.ticks, memory.commands_seen
        if cycle.mirrored is not None:
            cycle.mirrored = (tuple(memory.ipo), memory.ipo_sequence)
            cycle.slope = list(memory.slope)
        for name in ("q", "v", "a", "r", "tau", "wrench"):
            setattr(guard, name, list(getattr(memory, name)))
        fallback.at = memory.f_at
        for name in ("q", "slope", "tau", "wrench"):
            if getattr(memory, f"f_has_{name}"):
                setattr(fallback, name, list(getattr(memory, f"f_{name}")))
            elif name == "slope":
                fallback.slope = None
        ints, floats = cycle.layout.block.ints, cycle.layout.block.floats
        report = guard.report
        for kind in Limited:
            axes = slice(AXES * kind, AXES * (kind + 1))
            report.counts[kind] = ints[at.LIMITED_COUNTS :][axes].tolist()
            report.worst[kind] = floats[at.LIMITED_WORST :][axes].tolist()
            report.allowed[kind] = floats[at.LIMITED_ALLOWED :][axes].tolist()

    # one cycle without a socket, for tests

    def turn(self, datagram: bytes, received: int) -> int:
        """Process a datagram: HANDBACK, LAW, or the size of the answer."""
        return int(self.library.hf_turn(self.reference, datagram, len(datagram), received))

    def answer(self) -> int:
        """Make the answer after the law was called; return its size."""
        return int(self.library.hf_answer(self.reference))

    def finish(self, now: int) -> None:
        """Publish the cycle."""
        self.library.hf_finish(self.reference, now)

    def reply(self, size: int) -> bytes:
        """Bytes of the answer."""
        return bytes(memoryview(self.memory.t_reply)[:size])


def _address(memory: ctypes.Structure, name: str) -> int:
    return ctypes.addressof(memory) + int(getattr(type(memory), name).offset)
