"""Native part of the loop in C: build, load, and synchronise its state with the Python cycle.

The Python cycle is the reference. The native part answers messages that differ from the previous one in numbers only
and hands back any other; the Python cycle then continues from the state of the native part.
"""

from __future__ import annotations

import ctypes
import enum
import functools
import signal
import socket
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from heptarm import _library
from heptarm._library import Unavailable
from heptarm.fri.guard.fallback import Missing
from heptarm.fri.guard.joint_guard import AXES, Limited
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import LAW_FRACTION, Cycle, LawFailure
from heptarm.fri.loop.telemetry import NAN7
from heptarm.fri.loop.user_api import Output, State
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import encode_command
from heptarm.fri.protocol.messages import MAX_IO, MAX_TRANSFORMATIONS, CommandMode, SessionState
from heptarm.fri.protocol.protobuf import Raw, fields, put_double, put_varint
from heptarm.fri.protocol.version import MAX_DATAGRAM, Version, unwrap
from heptarm.fri.session.statistics import BINS

HANDBACK, LAW = -1, -2
TIMEOUT, HANDED_BACK, CHECK, SOCKET_ERROR, CALL_LAW, LAW_FAILED = range(6)
BUFFER = 2048
#: Largest size of a signal without its value, and of the name of a frame, for the native part.
HEAD = 80
#: A compiled law has failed after this many calls in a row that were too slow, or gave numbers that are not finite.
LAW_PATIENCE = 10
#: A call of a compiled law that has used this much of the processor's time is ended [ns].
LAW_CUT = 20_000_000
#: How long before a message is due the loop warms up caches [ns]; an answer takes less, however cold they are. What
#: else runs on its processor takes them again: after 100 us, a program that collects garbage has taken most.
WARM_UP = 50_000
#: Largest size of robot and connection info in messages for the native part.
MAX_PLAIN = 64

_WORD, _POINTER = ctypes.c_int64, ctypes.c_void_p
#: Fallbacks for missing commands, in the numbering of the native part.
MISSING = tuple(Missing)
_JOINT_MODES = (CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH)


class LawStatus(enum.IntEnum):
    """How a call of a compiled law ended."""

    OK = 0
    REFUSED = 1
    CRASHED = 2
    ENDLESS = 3
    NOT_FINITE = 4
    SLOW = 5


#: `struct loop` of fri_loop.c, whose header schema/generate.py writes from this table: type, size (1: no array), names.
STRUCT: tuple[tuple[str, int, str], ...] = (
    ("pointer", 1, "header latency jitter states commands outputs"),
    ("word", 1, "history bins sock address port"),
    # session; busy_poll: how long before a message is due the loop polls for it [ns]
    ("word", 1, "busy_poll"),
    ("word", 1, "hot framed echoes state quality mode sequence received period"),
    ("word", 1, "multiplier waiting sent reflected"),
    ("word", 1, "overlay safety operation control drive receive_multiplier"),
    ("word", 1, "robot_size connection_size"),
    ("char", MAX_PLAIN, "robot connection"),
    # signals: of the message without their values, of the answer likewise; those that are to be written, in their order
    ("word", 1, "io_count pending_count"),
    ("word", MAX_IO, "io_size io_is_analog put_size pending_signal pending_left pending_value"),
    ("byte", MAX_IO * HEAD, "io_head put_head"),
    # frames: names of the requested ones; encoded frames of the answer
    ("word", 1, "request_count frames_size"),
    ("word", MAX_TRANSFORMATIONS, "request_size"),
    ("byte", MAX_TRANSFORMATIONS * HEAD, "request_name"),
    ("byte", BUFFER, "frames"),
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
    # estimate of the wrench: `struct chain`, the posture that counts in this cycle, `struct wrench_map` of a posture
    ("word", 1, "has_chain has_map"),
    ("real", 24, "chain"),
    ("real", AXES, "posture"),
    ("real", AXES + 6 * AXES, "map"),
    # bands of the external torques
    ("word", 1, "has_watch"),
    ("real", AXES, "watch_threshold watch_baseline watch_margin"),
    # plausible positions
    ("real", AXES, "plausible_low plausible_high"),
    # fallback for missing commands
    ("word", 1, "f_at f_has_q f_has_slope f_has_tau f_has_wrench f_missing"),
    ("real", AXES, "f_q f_slope f_tau"),
    ("real", 6, "f_wrench"),
    ("real", 1, "patience over"),
    # output of the user's law: `struct heptarm_command`
    ("real", AXES, "out_q out_tau"),
    ("real", 6, "out_wrench"),
    ("real", AXES, "out_pose"),
    ("real", 1, "out_e1"),
    # compiled law: function, parameters, memory, counts of what the user's process has written to it, a buffer
    ("pointer", 1, "law params memory memory_written law_buffer"),
    ("pointer", 1, "params_ring memory_ring memory_set_ring"),
    ("word", 1, "params_size memory_size params_seen memory_seen"),
    ("word", 1, "law_success law_status law_code law_reported law_late law_not_finite"),
    ("real", 1, "law_fraction"),
    # velocity by differences
    ("word", 1, "q_known"),
    ("real", AXES, "q_before dq"),
    # this cycle; t_known has one bit for each array of t_arrays, which are those of a state from S_ARRAYS on
    ("word", 1, "t_flags t_received t_answer t_size t_stamp t_known t_strategy"),
    ("real", 1, "t_tracking"),
    ("real", at.S_WRENCH - at.S_ARRAYS, "t_arrays"),
    ("real", 6, "t_wrench"),
    ("real", AXES, "t_pose"),
    ("real", 1, "t_e1"),
    ("word", MAX_IO, "t_io"),
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
    """`struct loop` of fri_loop.c."""

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
    made = _library.library()
    made.hf_size.restype = _WORD
    made.hf_turn.argtypes = (_POINTER, ctypes.c_char_p, ctypes.c_int, _WORD)
    made.hf_answer.argtypes = (_POINTER,)
    made.hf_finish.argtypes = (_POINTER, _WORD)
    made.hf_send.argtypes = (_POINTER,)
    made.hf_run.argtypes = (_POINTER, _WORD, _POINTER)
    made.hf_law.argtypes = (_POINTER, _POINTER)
    made.hf_warm_up.argtypes = (_POINTER, ctypes.c_int)
    made.hf_echo.argtypes, made.hf_echo.restype = (ctypes.c_int, _WORD, _POINTER), _WORD
    if made.hf_size() != ctypes.sizeof(_Memory):
        raise Unavailable(f"`struct loop` must have {ctypes.sizeof(_Memory)} bytes, got {made.hf_size()}")
    return made


class Native:
    """Native part of one loop.

    Args:
        cycle: the Python cycle with which it alternates.
        busy_poll: how long before a message is due the loop polls for it instead of sleeping [ns].

    Attributes:
        memory: `struct loop`.

    Raises:
        Unavailable: the native part is not available.
    """

    def __init__(self, cycle: Cycle, *, busy_poll: int = 0) -> None:
        self.library = library()
        self._cycle = cycle
        self.memory = memory = _Memory()
        self.reference = ctypes.byref(memory)
        self.sender = (_WORD * 2)()
        self._is_newer = False
        #: Texts of the errors that a law compiled by Numba has raised.
        self.raised: list[str] = []
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
        memory.law_fraction = LAW_FRACTION
        if cycle.estimator is not None:
            memory.chain[:], memory.has_chain = cycle.estimator.chain, 1
        if cycle.watch is not None:
            memory.has_watch = 1
            for name in ("threshold", "baseline", "margin"):
                getattr(memory, f"watch_{name}")[:] = getattr(cycle.watch, name)
        memory.f_missing = MISSING.index(policy.missing)
        memory.busy_poll = busy_poll
        memory.patience, memory.over = policy.patience, policy.over

    def set_law(self, address: int, kept: object, *, success: int) -> None:
        """Set the compiled law that the native part calls; the Python cycle calls it through `call_law`.

        Args:
            address: of its function, in this process.
            kept: what has to live as long as the function.
            success: what the function returns unless it has failed.
        """
        cycle, memory, layout = self._cycle, self.memory, self._cycle.layout
        base = layout.block.ints.ctypes.data
        values = cycle.memory_values
        params = layout.params.ints.shape[1] - 1
        # params, memory, counts of writes, buffer of the larger of both rings
        self._law_words = words = np.zeros(params + 2 * len(values) + max(params, 2 * len(values)) + 1)
        words[params : params + len(values)] = values
        start = words.ctypes.data
        memory.params, memory.memory = start, start + 8 * params
        memory.memory_written = memory.memory + 8 * len(values)
        memory.law_buffer = memory.memory_written + 8 * len(values)
        memory.params_ring = base + 8 * layout.params_at
        memory.memory_ring, memory.memory_set_ring = (
            base + 8 * layout.memory_at,
            base + 8 * layout.memory_set_at,
        )
        memory.params_size, memory.memory_size = params, len(values)
        memory.law, memory.law_success, self._kept = address, success, kept
        memory.has_law = 1
        self.library.hf_protect()
        cycle.law, cycle.is_compiled = self.call_law, True

    def call_law(self, state: State, out: Output, params: object) -> None:
        """Call the compiled law from the Python cycle.

        Raises:
            LawFailure: it has failed.
        """
        memory = self.memory
        memory.mode = int(state.mode)
        memory.dq[:] = state.dq
        for name in ("q", "tau", "wrench", "pose"):
            getattr(memory, f"out_{name}")[:] = getattr(out, name)
        memory.out_e1 = out.e1
        words = np.array(state.words)
        if self.library.hf_law(self.reference, words.ctypes.data) != LawStatus.OK:
            memory.law_reported = 1
            raise LawFailure(self.law_failure)
        for name in ("q", "tau", "wrench", "pose"):
            getattr(out, name)[:] = getattr(memory, f"out_{name}")
        out.e1 = memory.out_e1

    def note_error(self, error: Any) -> None:
        """Note the error that a law compiled by Numba has raised; for `sys.unraisablehook`."""
        self.raised.append(f"{type(error.exc_value).__name__}: {error.exc_value}")

    @property
    def law_failure(self) -> str:
        """Why the compiled law has failed, in words."""
        status, code = LawStatus(self.memory.law_status), int(self.memory.law_code)
        if status is LawStatus.CRASHED:
            return f"it crashed with {signal.Signals(code).name} ({signal.strsignal(code)})"
        if status is LawStatus.ENDLESS:
            return f"a call did not return within {LAW_CUT * 1e-6:g} ms: look for an endless loop"
        if status is LawStatus.NOT_FINITE:
            return f"it commanded numbers that are not finite {LAW_PATIENCE} times in a row"
        if status is LawStatus.SLOW:
            return (
                f"it took longer than its time budget, {LAW_FRACTION:g} of the command period, {LAW_PATIENCE} times in "
                f"a row; the last call took {code * 1e-3:.0f} us"
            )
        if self.raised:
            return self.raised.pop()
        return f"it returned {code}"

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

        The native part stays inactive in sessions that command poses.

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
        if state is SessionState.COMMANDING_ACTIVE and not guard.is_started:
            return
        whole = [
            (tag, value) for tag, _, value in fields(unwrap(datagram, version)) if isinstance(value, bytes)
        ]
        parts = dict(whole)
        robot, connection = parts.get(2), parts.get(4, b"")
        if max(len(robot or b""), len(connection)) > MAX_PLAIN or set(parts) - {1, 2, 3, 4, 5, 6}:
            return
        if not self._load_signals(parts.get(3, b""), [value for tag, value in whole if tag == 6], version):
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
        memory.q_known = cycle.q_before is not None
        memory.q_before[:] = cycle.q_before or NAN7
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

    def _load_signals(self, monitor: bytes, requests: Sequence[bytes], version: Version) -> bool:
        """Copy signals, requested frames and what is to be sent of them; whether the native part can exchange them.

        Args:
            monitor: monitor data of the last message, encoded.
            requests: requested frames of the last message, encoded.
            version: wire format.
        """
        exchange, memory = self._cycle.exchange, self.memory
        signals = exchange.known
        values = [value for tag, _, value in fields(monitor) if tag == 8 and isinstance(value, bytes)]
        names = [next((value for tag, _, value in fields(one) if tag == 1), None) for one in requests]
        if len(values) != len(signals):  # a name occurs twice
            return False
        frames = _body(m.Command(_NO_HEADER, transformations=exchange.frames(version)), version)
        largest = _LARGEST_ANSWER + len(frames)
        for place, (one, encoded) in enumerate(zip(signals, values, strict=True)):
            is_analog = one.type is m.IoType.ANALOG
            value = put_double(5, one.value) if is_analog else put_varint(4, int(one.value))
            output = m.IoValue(one.name, one.type, m.IoDirection.OUTPUT, 0)
            ((_, _, written),) = fields(_body(m.Command(_NO_HEADER, io=(output,)), version))
            assert isinstance(written, bytes)
            head, put = encoded.removesuffix(value), written[: -9 if is_analog else -2]
            if head == encoded or max(len(head), len(put)) > HEAD:
                return False
            memory.io_is_analog[place] = is_analog
            memory.io_size[place], memory.put_size[place] = len(head), len(put)
            ctypes.memmove(_address(memory, "io_head") + HEAD * place, head, len(head))
            ctypes.memmove(_address(memory, "put_head") + HEAD * place, put, len(put))
            largest += len(put) + _LARGEST_VALUE
        for place, name in enumerate(names):
            if not isinstance(name, bytes) or len(name) > HEAD:
                return False
            memory.request_size[place] = len(name)
            ctypes.memmove(_address(memory, "request_name") + HEAD * place, name, len(name))
        unknown = set(exchange.pending) - {one.name for one in signals}
        if largest > MAX_DATAGRAM or unknown:  # Python reports it
            return False
        memory.io_count, memory.request_count, memory.frames_size = len(signals), len(requests), len(frames)
        ctypes.memmove(_address(memory, "frames"), frames, len(frames))
        self._load_pending()
        return True

    def _load_pending(self) -> None:
        """Copy the outputs that are to be written to the native part."""
        exchange, memory = self._cycle.exchange, self.memory
        places = {one.name: place for place, one in enumerate(exchange.known)}
        memory.pending_count = len(exchange.pending)
        for at_, (name, (value, left)) in enumerate(exchange.pending.items()):
            place = places[name]
            memory.pending_signal[at_], memory.pending_left[at_] = place, left
            memory.pending_value[at_] = _bits(value, is_analog=bool(memory.io_is_analog[place]))

    def _take_pending(self) -> None:
        """Copy the outputs that are to be written to Python."""
        exchange, memory = self._cycle.exchange, self.memory
        names = [one.name for one in exchange.known]
        pending: dict[str, tuple[int | float, int]] = {}
        for place, left, bits in zip(
            memory.pending_signal[: memory.pending_count],
            memory.pending_left[: memory.pending_count],
            memory.pending_value[: memory.pending_count],
            strict=True,
        ):
            pending[names[place]] = (_number(bits, is_analog=bool(memory.io_is_analog[place])), left)
        exchange.pending = pending

    def write_outputs(self) -> None:
        """Take over the outputs that a law in Python has written in this cycle."""
        exchange, memory = self._cycle.exchange, self.memory
        if not exchange.outputs.written:
            return
        self._take_pending()
        exchange.show(
            [
                _number(bits, is_analog=bool(is_analog))
                for bits, is_analog in zip(memory.t_io, memory.io_is_analog[: memory.io_count], strict=False)
            ]
        )
        exchange.write()
        self._load_pending()

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
        self._take_pending()
        cycle.record.ticks, cycle.commands_seen = memory.ticks, memory.commands_seen
        cycle.q_before = tuple(memory.q_before) if memory.q_known else None
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


#: Size of an answer with everything but signals and frames, and of the value of a signal with its key and length.
_LARGEST_ANSWER, _LARGEST_VALUE = 240, 14
_NO_HEADER = m.Header(0, 0)
_BITS = struct.Struct("<d"), struct.Struct("<q"), struct.Struct("<Q")


def _body(command: m.Command, version: Version) -> bytes:
    """Encoded content of a command, without its header; empty: it has none."""
    found: list[Raw] = [
        value for tag, _, value in fields(unwrap(encode_command(command, version), version)) if tag == 2
    ]
    return found[0] if found and isinstance(found[0], bytes) else b""


def _bits(value: float, *, is_analog: bool) -> int:
    """A value of a signal as a word."""
    real, word, unsigned = _BITS
    found: int = word.unpack(real.pack(value) if is_analog else unsigned.pack(int(value)))[0]
    return found


def _number(bits: int, *, is_analog: bool) -> int | float:
    """The value of a signal in a word."""
    real, word, unsigned = _BITS
    found: int | float = (real if is_analog else unsigned).unpack(word.pack(bits))[0]
    return found


def _address(memory: ctypes.Structure, name: str) -> int:
    return ctypes.addressof(memory) + int(getattr(type(memory), name).offset)
