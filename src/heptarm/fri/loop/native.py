"""The native part of the loop: builds it where there is a compiler, and keeps it in step with the Python turn.

Python stays the authority. The native part answers messages that differ from the one before in numbers only; any other
comes back here, and the Python turn goes on from where the native one has stopped.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from heptarm.errors import HeptarmError
from heptarm.fri.guard import Limited
from heptarm.fri.messages import CommandMode, SessionState
from heptarm.fri.policy import Missing
from heptarm.fri.protobuf import fields
from heptarm.fri.statistics import BINS
from heptarm.fri.version import unwrap
from heptarm.rt import layout as at
from heptarm.rt.cycle import Cycle

#: Set to anything to run in pure Python.
SWITCH = "HEPTARM_PURE_PYTHON"
HANDBACK, LAW = -1, -2
TIMEOUT, GIVEN_BACK, LOOK, BROKEN, CALL_LAW = range(5)
BUFFER = 2048

_SOURCE = Path(__file__).with_name("native.c")
_WORD, _REAL, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p
_REALS7, _REALS6 = _REAL * 7, _REAL * 6
_MISSING = (Missing.HOLD, Missing.EXTRAPOLATE, Missing.RAMP_DOWN)
_JOINT_MODES = (CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH)
_STATES = ("MONITORING_WAIT", "MONITORING_READY", "COMMANDING_WAIT", "COMMANDING_ACTIVE")


class Unavailable(HeptarmError):
    """There is no native part here; the text says why."""


class _Memory(ctypes.Structure):
    """`struct loop` of native.c."""

    _fields_ = (
        *((name, _POINTER) for name in ("header", "latency", "jitter", "states", "commands", "outputs")),
        *((name, _WORD) for name in ("history", "bins", "sock", "address", "port")),
        *(
            (name, _WORD)
            for name in (
                *("hot", "framed", "echoes", "state", "quality", "mode", "sequence", "received", "period"),
                *("multiplier", "waiting", "sent", "reflected"),
            )
        ),
        ("info", _WORD * 6),
        ("robot_size", _WORD),
        ("connection_size", _WORD),
        ("robot", ctypes.c_char * 64),
        ("connection", ctypes.c_char * 64),
        *(
            (name, _WORD)
            for name in (
                *("is_started", "is_ending", "has_law", "ticks", "commands_seen", "outputs_seen", "started"),
                *("ipo_known", "ipo_sequence"),
            )
        ),
        *((name, _REALS7) for name in ("ipo", "slope", "q", "v", "a", "r", "tau")),
        ("wrench", _REALS6),
        *(
            (name, _REALS7)
            for name in (
                *("low", "high", "top_v", "top_a", "top_j", "near", "dq_max", "ddq_max", "dddq_max"),
                *("tau_max", "tau_step"),
            )
        ),
        ("wrench_max", _REALS6),
        ("wrench_step", _REALS6),
        ("reach", _REAL),
        ("step", _REAL),
        *(
            (name, _WORD)
            for name in ("f_at", "f_has_q", "f_has_slope", "f_has_tau", "f_has_wrench", "f_missing")
        ),
        *((name, _REALS7) for name in ("f_q", "f_slope", "f_tau")),
        ("f_wrench", _REALS6),
        ("patience", _REAL),
        ("over", _REAL),
        ("out_q", _REALS7),
        ("out_tau", _REALS7),
        ("out_wrench", _REALS6),
        *((name, _WORD) for name in ("t_flags", "t_received", "t_answer", "t_size", "t_stamp", "t_known")),
        ("t_tracking", _REAL),
        ("t_q", _REAL * 42),
        ("t_wrench", _REALS6),
        ("t_pose", _REALS7),
        ("t_e1", _REAL),
        ("t_octets", ctypes.c_uint8 * BUFFER),
        ("t_reply", ctypes.c_uint8 * BUFFER),
    )


@functools.cache
def library() -> ctypes.CDLL:
    """The compiled native part; compiled at the first use and kept in the user's cache.

    Raises:
        Unavailable: this system has none, or no compiler.
    """
    if os.environ.get(SWITCH):
        raise Unavailable(f"switched off by {SWITCH}")
    if sys.platform != "linux" or sys.byteorder != "little":
        raise Unavailable("it is for Linux on little-endian machines")
    source = _SOURCE.read_bytes()
    key = hashlib.sha256(source + os.uname().machine.encode()).hexdigest()[:16]
    root = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    target = Path(root) / "heptarm" / f"fri-{key}.so"
    try:
        if not target.exists():
            _compile(target)
        made = ctypes.CDLL(str(target))
    except OSError as error:
        raise Unavailable(f"it cannot be built or loaded: {error}") from error
    made.hf_size.restype = _WORD
    made.hf_turn.argtypes = (_POINTER, ctypes.c_char_p, ctypes.c_int, _WORD)
    made.hf_answer.argtypes = (_POINTER,)
    made.hf_finish.argtypes = (_POINTER, _WORD)
    made.hf_send.argtypes = (_POINTER,)
    made.hf_run.argtypes = (_POINTER, _WORD, _POINTER)
    if made.hf_size() != ctypes.sizeof(_Memory):
        raise Unavailable(f"its memory has {made.hf_size()} octets, not {ctypes.sizeof(_Memory)}")
    return made


def _compile(target: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise Unavailable("there is no C compiler: install gcc for the fastest loop")
    target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(
        dir=target.parent
    ) as folder:  # the same file system: the last step is atomic
        made = Path(folder) / "made.so"
        # no contraction: the numbers are Python's to the last bit
        flags = ("-O2", "-shared", "-fPIC", "-ffp-contract=off")
        run = subprocess.run(
            [compiler, *flags, "-o", str(made), str(_SOURCE), "-lm"], check=False, capture_output=True, text=True
        )
        if run.returncode:
            raise Unavailable(f"{compiler} refuses it: {run.stderr.strip().splitlines()[0]}")
        os.replace(made, target)


class Native:
    """The native part of one loop.

    Args:
        cycle: the Python turn, which it relieves.

    Attributes:
        memory: what both share.

    Raises:
        Unavailable: there is none here.
    """

    def __init__(self, cycle: Cycle) -> None:
        self.library = library()
        self._cycle = cycle
        self.memory = memory = _Memory()
        self.reference = ctypes.byref(memory)
        self.sender = (_WORD * 2)()
        self._ahead = False
        layout, base = cycle.layout, cycle.layout.block.ints.ctypes.data
        memory.header, memory.latency, memory.jitter = base, base + 8 * at.LATENCY, base + 8 * at.JITTER
        memory.states, memory.commands = base + 8 * layout.states_at, base + 8 * layout.commands_at
        memory.outputs = base + 8 * layout.outputs_at
        memory.history, memory.bins = len(layout.states.ints), BINS
        memory.has_law = cycle.law is not None
        limits, policy = cycle.guard.limits, cycle.filler.policy
        for name in ("dq_max", "ddq_max", "dddq_max", "tau_max", "wrench_max"):
            getattr(memory, name)[:] = getattr(limits, name)
        memory.reach = limits.reach
        memory.f_missing = _MISSING.index(policy.missing)
        memory.patience, memory.over = policy.patience, policy.over

    def listen(self, sock: socket.socket, peer: tuple[str, int] | None) -> None:
        """The socket, and the controller that is listened to."""
        self.memory.sock = sock.fileno()
        if peer is not None:
            self.memory.address = int.from_bytes(socket.inet_aton(peer[0]), "little")
            self.memory.port = peer[1]

    @property
    def datagram(self) -> bytes:
        """The datagram that was handed back."""
        return bytes(memoryview(self.memory.t_octets)[: self.memory.t_size])

    @property
    def heard(self) -> tuple[str, int]:
        """Its sender."""
        return socket.inet_ntoa(int(self.sender[0]).to_bytes(4, "little")), int(self.sender[1])

    def give(self, datagram: bytes) -> None:
        """Let the native part go on from where the Python turn is; it needs the last datagram.

        It stays out of sessions that are not plain.
        """
        cycle, memory = self._cycle, self.memory
        session, guard, filler = cycle.session, cycle.guard, cycle.filler
        sample, version, state, mode = session.sample, session.version, session.state, session.mode
        commanding = state in (SessionState.COMMANDING_WAIT, SessionState.COMMANDING_ACTIVE)
        memory.hot = 0
        if sample is None or version is None or state is SessionState.IDLE or sample.connection is None:
            return
        if session.trouble:  # another message of this session has to end it
            return
        if commanding and (mode not in _JOINT_MODES or sample.q_ipo is None):
            return
        if not cycle.exchange.is_idle:  # signals and frames are Python's
            return
        if state is SessionState.COMMANDING_ACTIVE and not guard.is_started:
            return
        parts = {
            tag: value for tag, _, value in fields(unwrap(datagram, version)) if isinstance(value, bytes)
        }
        robot, connection = parts.get(2), parts.get(4, b"")
        if max(len(robot or b""), len(connection)) > 64 or set(parts) - {1, 2, 3, 4, 5}:
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
        memory.info[:] = cycle.record.info[2]
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
        memory.f_at = filler.at
        for name in ("q", "slope", "tau", "wrench"):
            value: Sequence[float] | None = getattr(filler, name)
            setattr(memory, f"f_has_{name}", value is not None)
            if value is not None:
                getattr(memory, f"f_{name}")[:] = value
        memory.hot = 1
        self._ahead = True

    def take(self) -> None:
        """Let the Python turn go on from where the native part is."""
        cycle, memory = self._cycle, self.memory
        if not self._ahead:
            return
        self._ahead = False
        session, guard, filler = cycle.session, cycle.guard, cycle.filler
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
        filler.at = memory.f_at
        for name in ("q", "slope", "tau", "wrench"):
            if getattr(memory, f"f_has_{name}"):
                setattr(filler, name, list(getattr(memory, f"f_{name}")))
            elif name == "slope":
                filler.slope = None
        ints, floats = cycle.layout.block.ints, cycle.layout.block.floats
        report = guard.report
        for kind in Limited:
            start = 7 * kind
            report.counts[kind] = ints[at.LIMITED_COUNTS + start : at.LIMITED_COUNTS + start + 7].tolist()
            report.worst[kind] = floats[at.LIMITED_WORST + start : at.LIMITED_WORST + start + 7].tolist()
            report.allowed[kind] = floats[
                at.LIMITED_ALLOWED + start : at.LIMITED_ALLOWED + start + 7
            ].tolist()

    # the turn without a socket, for tests

    def turn(self, datagram: bytes, received: int) -> int:
        """Take a datagram: HANDBACK, LAW, or the size of the answer."""
        return int(self.library.hf_turn(self.reference, datagram, len(datagram), received))

    def answer(self) -> int:
        """The law has spoken; returns the size of the answer."""
        return int(self.library.hf_answer(self.reference))

    def finish(self, now: int) -> None:
        """Publish the turn."""
        self.library.hf_finish(self.reference, now)

    def reply(self, size: int) -> bytes:
        """The answer."""
        return bytes(memoryview(self.memory.t_reply)[:size])


def _address(memory: ctypes.Structure, name: str) -> int:
    return ctypes.addressof(memory) + int(getattr(type(memory), name).offset)
