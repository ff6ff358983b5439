"""The cycle of the loop as Python sees it: it is made of the settings, calls laws in Python, and words what went wrong.

Everything else a cycle does is C: see native/fri_cycle.c. There is no socket here; `heptarm.fri.loop.process` has it.
"""

from __future__ import annotations

import ctypes
import signal
import time
import traceback
from typing import Any

import numpy as np

from heptarm.fri.guard.fallback import Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.guard.torque_guard import TorqueGuard
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import WITH_MEMORY, CompiledLaw, arity
from heptarm.fri.loop.law_interface import Memory
from heptarm.fri.loop.law_limit import EndlessLaw, LawLimit
from heptarm.fri.loop.native import (
    LAW,
    LAW_CUT,
    LAW_FRACTION,
    LAW_PATIENCE,
    MISSING,
    SETTINGS,
    LawStatus,
    Seam,
    library,
)
from heptarm.fri.loop.parameters import RateLimiter
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import Output, Outputs, Params, Signals, State
from heptarm.fri.loop.wrench import chain_of
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.events import Kind

#: Beginning of the text of the event after a failure of the law.
LAW_FAILED = "the law failed, the arm brakes: "
_KINDS = list(Kind)


class Cycle:
    """A loop in C on the shared memory of its client.

    Args:
        layout: the shared memory.
        settings: settings of the loop.

    Attributes:
        seam: what it and Python have in common, `struct fri_seam`.
        reference: the loop, for its functions.
        limit: interrupts a law in Python that does not return; None: nothing does.
        raised: texts of the errors that a law compiled by Numba has raised.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
        CommandRejected: the law cannot be compiled or loaded.
    """

    def __init__(self, layout: at.Layout, settings: LoopSettings) -> None:
        self.library = library()
        self.layout, self.settings = layout, settings
        self.seam: Any = Seam()
        self.limit: LawLimit | None = None
        self.raised: list[str] = []
        self._set(layout, settings)
        self.reference = self.library.fri_new(ctypes.byref(self.seam))
        self._set_law(layout, settings)

    def _set(self, layout: at.Layout, settings: LoopSettings) -> None:
        """Fill the seam with places in the shared memory and settings."""
        seam, base, arm = self.seam, layout.block.ints.ctypes.data, settings.arm
        seam.header = base
        for name in ("states", "commands", "events", "trouble", "offered", "outputs"):
            setattr(seam, name, base + 8 * getattr(layout, f"{name}_at"))
        seam.history = settings.history
        wire, policy = settings.wire, settings.policy or Policy()
        seam.version = at.ABSENT if wire is None else list(Version).index(wire)
        for name in SETTINGS:
            setattr(seam, name, getattr(settings, name))
        _fill(seam.joint_limits, settings.limits or Limits.of(arm))
        _fill(seam.pose_limits, settings.pose_limits or PoseLimits())
        seam.lowest[:], seam.highest[:], seam.fastest[:] = arm.q_min, arm.q_max, arm.dq_max
        seam.missing, seam.patience, seam.over = MISSING.index(policy.missing), policy.patience, policy.over
        seam.has_chain, seam.chain[:] = 1, chain_of(arm)
        self._torques = TorqueGuard(settings.limits or Limits.of(arm), settings.bodies)
        seam.torque_guard = self._torques.words.ctypes.data
        if settings.collision is not None:
            seam.has_watch = 1
            for name in ("threshold", "baseline", "margin"):
                getattr(seam, f"watch_{name}")[:] = getattr(settings.collision, name)

    def _set_law(self, layout: at.Layout, settings: LoopSettings) -> None:
        """Load a compiled law, or prepare the call of one in Python."""
        law, seam = settings.law, self.seam
        values, schema = settings.law_params
        memory, kept = settings.law_memory
        self._law, self._kept = law, None
        self._memory_values = memory
        seam.has_law = law is not None
        if isinstance(law, CompiledLaw):
            seam.law, self._kept = law.load(schema, kept)
            seam.law_success = law.success
            self._words = {
                name: np.zeros(size + 1)
                for name, size in (
                    ("params", values.size),
                    ("params_target", values.size),
                    ("params_rates", values.size),
                    ("memory", memory.size),
                    ("memory_written", memory.size),
                    ("law_buffer", max(values.size, 2 * memory.size)),
                )
            }
            self._words["params_rates"][:-1] = settings.law_rates
            self._words["memory"][:-1] = memory
            for name, words in self._words.items():
                setattr(seam, name, words.ctypes.data)
            base = layout.block.ints.ctypes.data
            for name in ("params", "memory", "memory_set"):
                setattr(seam, f"{name}_ring", base + 8 * getattr(layout, f"{name}_at"))
            seam.params_size, seam.memory_size = values.size, memory.size
            self.library.fri_protect()
            return
        given = np.zeros(values.size)
        self._params = Params(given, schema)
        self._follower = RateLimiter(given, settings.law_rates)
        self._memory = Memory(memory, kept) if law is not None and arity(law) >= WITH_MEMORY else None
        self._param_tick, self._memory_tick, self._offer_tick = -1, 0, -1
        self._memory_written = np.zeros(memory.size)
        self._outputs, self._signals = Outputs(), Signals()
        self._out = Output.on(np.frombuffer(seam.out, dtype=np.float64), self._outputs)
        self._dq = np.frombuffer(seam.dq, dtype=np.float64)

    def __del__(self) -> None:
        if getattr(self, "reference", None):
            self.library.fri_free(self.reference)
            self.reference = None

    # ------------------------------------------------------------------------------- one cycle without a socket

    def turn(self, datagram: bytes, received: int) -> bytes | None:
        """Process a datagram and make its answer, None for none; call `finish` next.

        Args:
            datagram: the datagram.
            received: time of receipt, monotonic clock [ns].
        """
        size = self.library.fri_turn(self.reference, datagram, len(datagram), received)
        if size == LAW:
            self.call_law()
            size = self.library.fri_answer(self.reference)
        return ctypes.string_at(self.seam.reply, size) if size else None

    def finish(self, now: int) -> None:
        """Publish the cycle, after its answer was sent at `now` [ns]."""
        self.library.fri_finish(self.reference, now)
        if self.has_failed:
            self.report_failure()

    def end(self) -> None:
        """Brake from now on, regardless of commands."""
        self.library.fri_end(self.reference)

    @property
    def may_end(self) -> bool:
        """Whether no axis moves by commands of this client."""
        return bool(self.library.fri_may_end(self.reference))

    def report(self, now: int, text: str) -> None:
        """Publish an event."""
        self.library.fri_note(self.reference, _KINDS.index(Kind.CLIENT), now, text.encode())

    # -------------------------------------------------------------------------------------------------- the law

    def call_law(self) -> None:
        """Call the law in Python on the state of this cycle; brake from now on if it fails."""
        law, layout = self._law, self.layout
        assert law is not None and not isinstance(law, CompiledLaw)
        if layout.offered.tick != self._offer_tick and (offer := layout.offered.read()) is not None:
            self._offer_tick = layout.offered.tick
            self._signals = self._outputs.signals = Signals.of(offer[0])
        states = layout.states
        state = State(states.floats[states.count % len(states.ints)], self._signals, self._dq)
        self._take_params(state.dt)
        began = time.monotonic_ns()
        try:
            if self.limit is not None:
                self.limit.begin(began)
            if self._memory is None:
                law(state, self._out, self._params)
            else:
                self._take_memory()
                law(state, self._out, self._params, self._memory)
                layout.memory.write(self._memory_values)
            if self.limit is not None:
                self.limit.end()
            self._write_outputs()
        except BaseException as error:  # sys.exit() as well: the arm has to brake first
            if self.limit is not None:
                self.limit.end()
            self._fail(str(error) if isinstance(error, EndlessLaw) else describe(error))
        layout.header[at.OVERRUNS] += time.monotonic_ns() - began > LAW_FRACTION * state.dt * 1e9

    def _take_params(self, dt: float) -> None:
        """Let the parameters follow what the user's process has set."""
        ring, follower = self.layout.params, self._follower
        if ring.count != self._param_tick and (words := ring.read(ring.count - 1)) is not None:
            if self._param_tick < 0:
                follower.begin(words[1:])
            follower.target[:] = words[1:]
            self._param_tick = ring.count
        follower.step(dt)

    def _write_outputs(self) -> None:
        """Hand on the outputs that the law has written in this cycle."""
        seam, written = self.seam, self._outputs.written
        for place, (name, value) in enumerate(written.items()):
            is_analog = isinstance(value, float)
            bits = np.array([value], dtype=np.float64 if is_analog else np.uint64).view(np.int64)
            seam.written_signal[place], seam.written_value[place] = (
                self._signals.names.index(name),
                int(bits[0]),
            )
        seam.written = len(written)
        written.clear()

    def _take_memory(self) -> None:
        """Take over what the user's process has written to the memory of the law."""
        ring, size = self.layout.memory_set, len(self._memory_values)
        if ring.count == self._memory_tick or (words := ring.read(ring.count - 1)) is None:
            return
        self._memory_tick = ring.count
        values, written = words[1 : 1 + size], words[1 + size :]
        newer = written > self._memory_written
        self._memory_values[newer] = values[newer]
        self._memory_written[:] = written

    def note_error(self, error: Any) -> None:
        """Note the error that a law compiled by Numba has raised; for `sys.unraisablehook`."""
        self.raised.append(f"{type(error.exc_value).__name__}: {error.exc_value}")

    @property
    def has_failed(self) -> bool:
        """Whether the compiled law has failed, and that was not reported yet."""
        return bool(self.seam.law_status != LawStatus.OK and not self.seam.law_reported)

    def report_failure(self) -> None:
        """Report why the compiled law has failed."""
        self.seam.law_reported = 1
        self._fail(self._failure)

    def _fail(self, text: str) -> None:
        self.report(self.seam.received, LAW_FAILED + text)
        self.end()

    @property
    def _failure(self) -> str:
        """Why the compiled law has failed, in words."""
        status, code = LawStatus(self.seam.law_status), int(self.seam.law_code)
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


def _fill(structure: Any, limits: Limits | PoseLimits) -> None:
    """Copy limits to their structure."""
    for name in limits.__dataclass_fields__:
        value = getattr(limits, name)
        if isinstance(value, tuple):
            getattr(structure, name)[:] = value
        else:
            setattr(structure, name, value)


def describe(error: BaseException) -> str:
    """Describe an error in one line, with its place."""
    trace = traceback.extract_tb(error.__traceback__)
    place = f" ({trace[-1].filename.rpartition('/')[2]}, line {trace[-1].lineno})" if trace else ""
    return f"{type(error).__name__}: {error}{place}"
