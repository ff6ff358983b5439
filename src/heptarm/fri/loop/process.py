"""Process of the loop: start, real-time priority, receiving and answering datagrams.

The loop is a new process, never a fork: the user's process does not delay its answers, and no lock that one of the
user's threads holds at that moment can stop it. A law that the new process cannot import is sent to it by value.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import io
import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import cloudpickle

from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, HeptarmError, system_errors
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import CompiledLaw
from heptarm.fri.loop.cycle import Cycle, describe
from heptarm.fri.loop.law_limit import LawLimit
from heptarm.fri.loop.native import CALL_LAW, ENDED, LAW_FAILED, SOCKET_ERROR
from heptarm.fri.loop.settings import Law, LoopSettings
from heptarm.io.new_process import by_value, is_importable, module_path
from heptarm.io.shared import MemoryBlock
from heptarm.io.udp import UdpSocket

PRIORITY = 60
#: Longest wait for a datagram before the loop checks whether it has to end [s].
PATIENCE = 0.05
#: Beginning of the trouble after a failure of the loop itself.
LOOP_FAILED = "the loop failed: "
_PR_SET_TIMERSLACK = 29
_MCL_CURRENT_FUTURE = 3


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
    if module is None or "<" in name or not is_importable(module):
        return None
    found: object = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return f"{module}:{name}" if found is law else None


@dataclass(frozen=True, slots=True)
class Place:
    """Where a loop listens, and to whom.

    Attributes:
        port: UDP port to bind.
        host: own address to bind.
        remote: address of the controller; None accepts any.
        parent: process that uses the loop.
    """

    port: int
    host: str
    remote: str | None
    parent: int


class _Pickler(cloudpickle.Pickler):  # type: ignore[misc]
    """Pickles settings; a law that the new process can import by its name, any other by value."""

    def __init__(self, file: io.BytesIO, law: Law | CompiledLaw | None) -> None:
        super().__init__(file)
        self._law, self._name = law, None if law is None else importable(law)

    def reducer_override(self, obj: Any) -> Any:
        if obj is self._law and self._name is not None:
            return imported, (self._name,)
        return super().reducer_override(obj)


def packed(settings: LoopSettings, place: Place) -> bytes:
    """Serialise what a loop's process needs.

    Raises:
        CommandRejected: the law uses a value that belongs to this process, such as an arm, a lock or a file.
    """
    law = settings.law
    into = io.BytesIO()
    try:
        with by_value(law):
            _Pickler(into, law).dump((settings, place))
    except Exception as error:  # whatever the objects that it uses raise
        raise CommandRejected(
            f"the law {getattr(law, '__qualname__', law)!r} cannot be sent to the loop's process: {error}",
            parameter="law",
            hint="a law runs in a process of its own: let it use plain values and `params`, not arms, locks or files",
        ) from error
    return into.getvalue()


def imported(name: str) -> Any:
    """Import "module:function"."""
    module, _, function = name.partition(":")
    found: Any = importlib.import_module(module)
    for part in function.split("."):
        found = getattr(found, part)
    return found


class Worker:
    """Process of a loop: a new interpreter with the module path of this one.

    Args:
        path: file of the shared memory.
        sent: what it needs, see `packed`.
    """

    def __init__(self, path: str, sent: bytes) -> None:
        with system_errors("the loop's process cannot be started", kind=ConnectFailed):
            self._process = subprocess.Popen(
                [sys.executable, "-m", "heptarm.fri.loop.process", path],
                env={**os.environ, "PYTHONPATH": module_path(), "OPENBLAS_NUM_THREADS": "1"},
                stdin=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
        self._printed: deque[str] = deque(maxlen=20)
        self._reader = threading.Thread(target=self._pass_on, name="heptarm-fri-log", daemon=True)
        self._reader.start()
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError), self._process.stdin as pipe:  # it may have ended already
            pipe.write(sent)

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
        settings: settings of the loop.
        place: where it listens.

    Attributes:
        layout, settings, socket, cycle: its parts.
        refused: a text for each setting that has no effect here.

    Raises:
        CommandRejected: the law cannot be compiled or loaded.
        ConnectFailed: the port cannot be bound.
        Unavailable: the compiled part of heptarm is missing.
    """

    def __init__(self, layout: at.Layout, settings: LoopSettings, place: Place) -> None:
        self.layout, self.settings, self.refused = layout, settings, list[str]()
        if settings.busy_poll and os.cpu_count() == 1:
            why = "this machine has one processor, which the sender needs meanwhile"
            self.refused.append(f"no busy polling: {why}")
            settings = replace(settings, busy_poll=0.0)
        self.socket = UdpSocket(place.port, host=place.host, patience=PATIENCE)
        layout.header[at.PORT] = self.socket.port
        self.cycle = Cycle(layout, settings)
        seam = self.cycle.seam
        seam.sock, seam.parent = self.socket.sock.fileno(), place.parent
        if place.remote is not None:
            seam.remote = int.from_bytes(socket.inet_aton(place.remote), sys.byteorder)
        if settings.law is not None and not isinstance(settings.law, CompiledLaw):
            self.cycle.limit = LawLimit(layout.header)

    def run(self) -> None:
        """Answer until the user's process stops the loop or has ended, and the arm is at rest.

        Raises:
            ConnectionLost: the port has failed; the text gives the cause.
        """
        cycle, run, reference = self.cycle, self.cycle.library.fri_run, self.cycle.reference
        sys.unraisablehook = cycle.note_error
        code = run(reference, 0)
        while code != ENDED:
            if code == CALL_LAW:
                cycle.call_law()
            elif code == LAW_FAILED:
                cycle.report_failure()
            elif code == SOCKET_ERROR:
                why = os.strerror(cycle.seam.error).lower()
                raise ConnectionLost(f"UDP port {self.socket.port} fails: {why}")
            else:  # nothing arrives
                gc.collect()
            code = run(reference, code == CALL_LAW)

    def close(self) -> None:
        """Close the port."""
        self.socket.close()


def main(path: str) -> int:
    """Run a loop with the settings that standard input has.

    Args:
        path: file of the shared memory.
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
    header[at.PID] = os.getpid()
    try:
        settings, place = pickle.loads(sys.stdin.buffer.read())
        loop = Loop(first, settings, place)
    except BaseException as error:  # also of the module of the law, which may do anything when it is imported
        if isinstance(error, CommandRejected) and error.parameter == "law":
            first.trouble.write(json.dumps([error.text, error.hint]))
            header[at.STATUS] = at.Status.BAD_LAW
            return 1
        first.trouble.write(str(error) if isinstance(error, HeptarmError) else describe(error))
        has_port = not isinstance(error, ConnectFailed) or error.parameter != "port"
        header[at.STATUS] = at.Status.FAILED if has_port else at.Status.NO_PORT
        return 1
    refused = (request_realtime(cpu=settings.cpu) if settings.realtime else []) + loop.refused
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
