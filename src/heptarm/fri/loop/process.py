"""Process of the loop: start, real-time priority, receiving and answering datagrams.

The loop is a new process, never a fork: the user's process does not delay its answers, and no lock that one of the
user's threads holds at that moment can stop it. A law that the new process cannot import is sent to it by value.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import time
from collections import deque
from importlib.machinery import PathFinder
from typing import Any

import cloudpickle
import numpy as np

from heptarm._library import Unavailable
from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, HeptarmError
from heptarm.fri.guard.collision_watch import watch_of
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import WITH_MEMORY, CompiledLaw, arity
from heptarm.fri.loop.cycle import LOOP_FAILED, Cycle, Law, describe
from heptarm.fri.loop.law_interface import Memory
from heptarm.fri.loop.law_limit import LawLimit
from heptarm.fri.loop.native import (
    CALL_LAW,
    CHECK,
    HANDED_BACK,
    LAW_FAILED,
    SOCKET_ERROR,
    TIMEOUT,
    Native,
    library,
)
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.fri.loop.wrench import WrenchEstimator
from heptarm.fri.protocol.messages import SessionState
from heptarm.fri.protocol.version import Version, spoken_version
from heptarm.io.shared import MemoryBlock
from heptarm.io.udp import Address, UdpSocket

PRIORITY = 60
#: Longest wait for a datagram before the loop checks whether it has to end [s].
PATIENCE = 0.05
#: The loop accepts a sender with another address after this long without a message of the previous one [ns].
SILENT = 1_000_000_000
#: It accepts another port of the same address, that of a restarted controller, after so many periods without a message,
#: and after at least this long [ns]: not at once, so that another program there cannot interrupt a running session.
SILENT_PERIODS, SILENT_PORT = 3, 100_000_000
#: Longest wait for the arm to come to rest before the loop ends [s].
BRAKING = 3.0
#: The loop checks every so many datagrams whether the user's process is alive.
_CHECK_EVERY = 256
_PR_SET_TIMERSLACK = 29
_MCL_CURRENT_FUTURE = 3
#: Size of a law by value, ahead of it.
_SIZE = struct.Struct("<q")


def request_realtime(*, cpu: int | None = None, priority: int = PRIORITY) -> list[str]:
    """Request real-time priority, locked memory, short timer slack and one processor; stop garbage collection.

    Args:
        cpu: processor to run on; None for any.
        priority: priority of SCHED_FIFO.

    Returns:
        A text for each refused request, with its remedy.
    """
    refused = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        refused.append(
            f"no real-time priority ({_reason(error)}): answers may be late while the machine is busy; allow it with "
            "`rtprio` in /etc/security/limits.conf, or run as root"
        )
    if cpu is not None:
        try:
            os.sched_setaffinity(0, {cpu})
        except (OSError, AttributeError) as error:
            refused.append(f"not bound to processor {cpu} ({_reason(error)})")
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
        if libc.mlockall(_MCL_CURRENT_FUTURE) != 0:
            refused.append(
                f"memory not locked ({os.strerror(ctypes.get_errno()).lower()}): a page fault may delay an answer; "
                "allow it with `memlock` in /etc/security/limits.conf"
            )
    else:
        refused.append(f"memory not locked: not supported on {sys.platform}")
    sys.setswitchinterval(2e-4)
    gc.collect()
    gc.freeze()
    gc.disable()
    return refused


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return f"{sys.platform} has none"


def importable(law: Law | CompiledLaw | None) -> str | None:
    """Name "module:function" by which a new process can import a law; None if it cannot."""
    module, name = getattr(law, "__module__", None), getattr(law, "__qualname__", "<")
    if module is None or module == "__main__" or "<" in name:
        return None
    if PathFinder.find_spec(module.partition(".")[0]) is None:  # only this process can find the module
        return None
    found: object = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return f"{module}:{name}" if found is law else None


def by_value(law: Law | CompiledLaw) -> bytes:
    """Serialise a law that a new process cannot import, with the values that it uses.

    Raises:
        CommandRejected: it uses a value that belongs to this process, such as an arm, a lock or a file.
    """
    module = sys.modules.get(getattr(law, "__module__", None) or "")
    foreign = (
        module is not None
        and module.__name__ != "__main__"
        and PathFinder.find_spec(module.__name__.partition(".")[0]) is None
    )
    try:
        if not foreign:
            return bytes(cloudpickle.dumps(law))
        cloudpickle.register_pickle_by_value(module)
        try:
            return bytes(cloudpickle.dumps(law))
        finally:
            cloudpickle.unregister_pickle_by_value(module)
    except Exception as error:  # whatever the objects that it uses raise
        raise CommandRejected(
            f"the law {getattr(law, '__qualname__', law)!r} cannot be sent to the loop's process: {error}",
            parameter="law",
            hint="a law runs in a process of its own: let it use plain values and `params`, not arms, locks or files",
        ) from error


class Worker:
    """Process of a loop: a new interpreter with the module path of this one.

    Args:
        path: file of the shared memory.
        law: law by value; empty: the configuration names the law, or there is none.
    """

    def __init__(self, path: str, law: bytes = b"") -> None:
        folders = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "heptarm.fri.loop.process", path],
            env={**os.environ, "PYTHONPATH": folders, "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        self._printed: deque[str] = deque(maxlen=20)
        self._reader = threading.Thread(target=self._pass_on, name="heptarm-fri-log", daemon=True)
        self._reader.start()
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError), self._process.stdin as pipe:  # it may have ended already
            pipe.write(_SIZE.pack(len(law)) + law)

    def _pass_on(self) -> None:
        """Pass on what the process prints to its standard error, and keep the last lines."""
        assert self._process.stderr is not None
        with self._process.stderr as pipe:
            for line in pipe:
                text = line.decode(errors="replace")
                self._printed.append(text.rstrip())
                with contextlib.suppress(
                    OSError, ValueError, AttributeError
                ):  # there may be none, or a closed one
                    sys.stderr.write(text)

    def printed(self) -> str:
        """The last lines that it printed to its standard error, once it has ended."""
        self._reader.join(1.0)
        return " | ".join(self._printed)

    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def join(self, seconds: float) -> None:
        """Wait for its end."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return
        self._reader.join(1.0)

    @property
    def ending(self) -> str:
        """How it ended, in words."""
        code = self._process.poll()
        if code is None:
            return "it runs"
        if code < 0:
            return f"its process has ended, killed by signal {-code} ({signal.Signals(-code).name})"
        return f"its process has ended with status {code}"

    def kill(self) -> None:
        """Kill it."""
        self._process.kill()
        self._process.wait()
        self._reader.join(1.0)


class Loop:
    """The loop: a socket, a cycle and the shared memory.

    Args:
        layout: the shared memory.
        config: configuration that `heptarm.fri.loop.client` wrote.
        law: overrides the law of the configuration.

    Attributes:
        layout, config, socket, cycle: its parts.
        refused: a text for each setting that has no effect here.

    Raises:
        CommandRejected: the law cannot be compiled or loaded.
        ConnectFailed: the port cannot be bound.
    """

    def __init__(
        self, layout: at.Layout, config: dict[str, Any], *, law: Law | CompiledLaw | None = None
    ) -> None:
        self.layout, self.config = layout, config
        self.socket = UdpSocket(config["port"], host=config["host"], patience=PATIENCE)
        layout.header[at.PORT] = self.socket.port
        schema, memory = (
            {name: (tuple(shape), start) for name, (shape, start) in config[what].items()}
            for what in ("params", "memory")
        )
        self._why_python = ""
        try:
            library()
        except Unavailable as reason:
            self._why_python = str(reason)
        law = law or _imported(config["law"])
        compiled: CompiledLaw | None = None
        in_python: Law | None
        if not isinstance(law, CompiledLaw):
            in_python = law
        elif self._why_python:
            in_python = _without_native(law, self._why_python)
        else:
            compiled, in_python = law, None
        values = np.array(config["remembered"], dtype=np.float64)
        version = config["version"]
        self.cycle = Cycle(
            layout,
            version=None if version is None else Version(version),
            limits=_limits(config["limits"]),
            pose_limits=PoseLimits(**config["pose_limits"]),
            policy=Policy(
                Missing(config["policy"]["missing"]), config["policy"]["patience"], config["policy"]["over"]
            ),
            law=in_python,
            params=Params(np.zeros(config["size"]), schema),
            memory=Memory(values, memory) if in_python and arity(in_python) >= WITH_MEMORY else None,
            memory_values=values,
            positions=(tuple(config["positions"][0]), tuple(config["positions"][1])),
            estimator=WrenchEstimator(config["chain"]),
            watch=watch_of(config["collision"]),
        )
        if in_python is not None:
            self.cycle.limit = LawLimit(layout.header)
        polls, self.refused = config["busy_poll"], list[str]()
        if polls and (self._why_python or os.cpu_count() == 1):
            why = self._why_python or "this machine has one processor, which the sender needs meanwhile"
            self.refused.append(f"no busy polling: {why}")
            polls = 0.0
        self._native = None if self._why_python else Native(self.cycle, busy_poll=round(polls * 1e9))
        layout.header[at.NATIVE] = self._native is not None
        if compiled is not None and self._native is not None:
            address, kept = compiled.load(schema, memory)
            self._native.set_law(address, kept, success=compiled.success)
        self._parent: int = config["parent"]
        self._peer: Address | None = None
        self._deadline = 0
        self._last = b""

    def run(self) -> None:
        """Answer until the user's process stops the loop or has ended, and the arm is at rest.

        Raises:
            ConnectionLost: the port or the loop itself has failed; the text gives the cause.
        """
        if self._native is None:
            self.cycle.record.report(time.monotonic_ns(), f"the loop runs in pure Python: {self._why_python}")
            self._run_in_python()
        else:
            self._run_native(self._native)
        if self.cycle.failure:
            raise ConnectionLost(self.cycle.failure)

    def _run_native(self, native: Native) -> None:
        """Run the native part, which answers frequent messages; handle here what it hands back."""
        header, cycle, states = self.layout.header, self.cycle, self.layout.states
        run, send, now_ns = native.library.hf_run, native.library.hf_send, time.monotonic_ns
        memory, reference = native.memory, native.reference
        out = Output.on(memory.out_q, memory.out_tau, memory.out_wrench, cycle.exchange.outputs)
        dq = np.frombuffer(memory.dq, dtype=np.float64)
        sys.unraisablehook = native.note_error
        native.listen(self.socket.sock, None)
        history = len(states.ints)
        while True:
            code = run(reference, _CHECK_EVERY, native.sender)
            if code == CALL_LAW:
                state = State(states.floats[header[at.STATES] % history], cycle.exchange.signals, dq)
                cycle.call_law(state, out, memory.received)
                native.write_outputs()
                memory.is_ending = cycle.is_ending
                send(reference)
                code = CHECK if header[at.STOP] else CALL_LAW
            elif code == LAW_FAILED:
                memory.law_reported = 1
                native.sync_to_python()
                cycle.law_failed(native.law_failure, memory.received)
                native.sync_from_python(self._last)
                code = CHECK if header[at.STOP] else LAW_FAILED
            elif code == HANDED_BACK:
                native.sync_to_python()
                datagram, sender = native.datagram, native.sender_address
                received = memory.t_received
                if sender != self._peer and not self._accept(sender, datagram, received):
                    native.sync_from_python(self._last)
                    continue
                native.listen(self.socket.sock, sender)
                answer = cycle.turn(datagram, received)
                if answer is not None:
                    self.socket.send(answer, sender)
                cycle.finish(now_ns())
                if cycle.session.sample is not None and cycle.session.received == received:
                    self._last = datagram
                if self._last:
                    native.sync_from_python(self._last)
                code = CHECK if header[at.STOP] else HANDED_BACK
            elif code == SOCKET_ERROR:
                raise ConnectionLost(
                    f"UDP port {self.socket.port} fails: {os.strerror(memory.t_size).lower()}"
                )
            if code == TIMEOUT:
                cycle.idle(now_ns())
                gc.collect()
            if code in (TIMEOUT, CHECK) and (
                self._deadline or header[at.STOP] or os.getppid() != self._parent
            ):
                native.sync_to_python()
                if self._is_over(now_ns()):
                    return
                if self._last:
                    native.sync_from_python(self._last)

    def _run_in_python(self) -> None:
        header, cycle, receive, send = self.layout.header, self.cycle, self.socket.receive, self.socket.send
        now_ns, turns = time.monotonic_ns, 0
        while True:
            got = receive()
            if got is None:
                now = now_ns()
                cycle.idle(now)
                gc.collect()
                if self._is_over(now):
                    return
                continue
            datagram, received, sender = got
            if sender != self._peer and not self._accept(sender, datagram, received):
                continue
            answer = cycle.turn(datagram, received)
            if answer is not None:
                send(answer, sender)
            now = now_ns()
            cycle.finish(now)
            turns += 1
            if (header[at.STOP] or turns % _CHECK_EVERY == 0) and self._is_over(now):
                return

    def _accept(self, sender: Address, datagram: bytes, now: int) -> bool:
        """Whether to accept another sender: only if the session of the previous one has ended or it is silent.

        Args:
            sender: address and port.
            datagram: its datagram.
            now: time of receipt [ns].
        """
        remote = self.config["remote"]
        if remote is not None and sender[0] != remote:
            return False
        session = self.cycle.session
        if self._peer is not None:
            patience = SILENT
            if sender[0] == self._peer[0] and spoken_version(datagram) is not None:
                patience = max(SILENT_PERIODS * session.period, SILENT_PORT)
            if session.state is not SessionState.IDLE and now - session.received < patience:
                return False
            self.cycle.forget_controller()
        self._peer = sender
        self.cycle.record.report(now, f"listening to {sender[0]}:{sender[1]}")
        return True

    def _is_over(self, now: int) -> bool:
        """Whether the loop has ended; make the cycle brake if it has to end."""
        if not self._deadline:
            if not self.layout.header[at.STOP] and os.getppid() == self._parent:
                return False
            self.cycle.end()
            self._deadline = now + round(BRAKING * 1e9)
        silent = now - self.cycle.session.received > 5 * PATIENCE * 1e9
        return self.cycle.may_end or silent or now > self._deadline

    def close(self) -> None:
        """Close the port."""
        self.socket.close()


def _without_native(law: CompiledLaw, reason: str) -> Law:
    """The Python form of a compiled law, for a loop in pure Python.

    Raises:
        CommandRejected: it has none.
    """
    if law.python is None:
        raise CommandRejected(
            f"a law from a library needs the native part of the loop: {reason}",
            parameter="law",
            hint="install gcc, or write the law in Python",
        )
    return law.python


def _imported(name: str | None) -> Law | CompiledLaw | None:
    """Import the law "module:function"."""
    if name is None:
        return None
    module, _, function = name.partition(":")
    found: Any = importlib.import_module(module)
    for part in function.split("."):
        found = getattr(found, part)
    law: Law | CompiledLaw = found
    return law


def _received_law() -> Law | CompiledLaw | None:
    """Read the law that `Worker` sent by value; None if it sent none."""
    (size,) = _SIZE.unpack(sys.stdin.buffer.read(_SIZE.size))
    law: Law | CompiledLaw | None = pickle.loads(sys.stdin.buffer.read(size)) if size else None
    return law


def _limits(plain: dict[str, Any]) -> Limits:
    made: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in plain.items()}
    return Limits(**made)


def main(path: str) -> int:
    """Run a loop, with the law that standard input has by value, or that of the configuration.

    Args:
        path: file of the shared memory, with the configuration.
    """
    block = MemoryBlock(path=path)
    header = block.view(0, at.LATENCY)

    def stop(number: int, frame: object) -> None:
        header[at.STOP] = 1

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the user's process handles Ctrl-C and stops this one
    first = at.Layout(
        block, history=header[at.HISTORY], params=header[at.SIZE], memory=header[at.MEMORY_SIZE]
    )
    config = json.loads(first.config.read() or "{}")
    header[at.PID] = os.getpid()
    try:
        loop = Loop(first, config, law=_received_law())
    except BaseException as error:  # also of the module of the law, which may do anything when it is imported
        if isinstance(error, CommandRejected) and error.parameter == "law":
            first.trouble.write(json.dumps([error.text, error.hint]))
            header[at.STATUS] = at.Status.BAD_LAW
            return 1
        first.trouble.write(str(error) if isinstance(error, HeptarmError) else describe(error))
        has_port = not isinstance(error, ConnectFailed) or error.parameter != "port"
        header[at.STATUS] = at.Status.FAILED if has_port else at.Status.NO_PORT
        return 1
    refused = (request_realtime(cpu=config["cpu"]) if config["realtime"] else []) + loop.refused
    first.refused.write("\n".join(refused))
    header[at.STATUS] = at.Status.RUNNING
    try:
        loop.run()
    except BaseException as error:  # never without a cause: the user's process reads it
        first.trouble.write(str(error) if isinstance(error, HeptarmError) else LOOP_FAILED + describe(error))
        header[at.STATUS] = at.Status.FAILED
        return 1
    finally:
        loop.close()
    header[at.STATUS] = at.Status.ENDED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
