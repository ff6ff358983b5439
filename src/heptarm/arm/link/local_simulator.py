"""Start a private virtual cabinet: a child process that ends with this one, whatever happens.

The child reads a pipe as its standard input and ends when that closes; the operating system closes it even when this
process is killed. Nothing of heptarm.sim is imported here.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import logging
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import weakref
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from heptarm.arm.link.target import Target
from heptarm.errors import ConnectFailed, ConnectionLost, refuse_windows, require_extra, system_errors
from heptarm.io.keys import environment
from heptarm.values.simulator_options import flag

_log = logging.getLogger("heptarm.sim")

_NOT_STARTED = "the virtual cabinet did not start"
#: Longest time to start a virtual cabinet [s]: a few seconds, more on a busy machine.
READY_TIMEOUT = 60.0
_END_TIMEOUT = 5.0
_REPLY_TIMEOUT = 20.0
#: It draws nothing: without a library for windows MuJoCo is imported a quarter of a second sooner.
_NO_WINDOW = {"MUJOCO_GL": "disable"}


@dataclass(frozen=True, slots=True)
class _Ready:
    """What a virtual cabinet reports when it accepts clients: its port, its robot, and what of that is doubtful."""

    port: int
    model: str
    notes: tuple[str, ...]


class PrivateCabinet:
    """A running virtual cabinet of this program.

    Attributes:
        host: address on which it listens.
        port: TCP port on which it listens.
        pid: its process id.
        scene: what is around the arm; "": nothing.
        model: name of its robot, with its media flange.
        positions: file in which it writes the positions of arm and scene; None: there is no scene.
    """

    host = "127.0.0.1"

    def __init__(
        self,
        process: subprocess.Popen[str],
        port: int,
        model: str,
        readers: list[threading.Thread],
        replies: queue.SimpleQueue[tuple[str, str]],
        scene: str,
        positions: Path | None,
    ) -> None:
        self.scene, self.positions = scene, positions
        self._replies = replies
        self._command_lock = threading.Lock()
        self.port, self.model = port, model
        self.pid = process.pid
        self._process = process
        self._readers = readers
        atexit.register(self.close)
        _cabinets.add(self)

    def abandon(self) -> None:
        """Give up the pipes in a fork of the process, so that only the original process keeps the simulator running."""
        atexit.unregister(self.close)
        self._readers, self.positions = [], None
        self._process.returncode = 0  # it is no child of this process: nothing to wait for
        self._command_lock = threading.Lock()
        nothing = os.open(os.devnull, os.O_RDWR)
        try:
            for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
                if pipe is not None and not pipe.closed:
                    os.dup2(nothing, pipe.fileno(), inheritable=False)  # the file's own lock may be held
        finally:
            os.close(nothing)

    @classmethod
    def start(
        cls, target: Target, *, key: str | None = None, timeout: float = READY_TIMEOUT
    ) -> PrivateCabinet:
        """Start a virtual cabinet and wait until it accepts clients.

        Args:
            target: which one.
            key: pre-shared key that it asks its clients for; None: none.
            timeout: longest wait [s].

        Raises:
            ConnectFailed: it does not start; the text has its last output.
            MissingExtra: the packages of the simulator are not installed.
            CommandRejected: this is Windows.
        """
        refuse_windows("the virtual cabinet")
        require_extra("sim")
        command = [
            sys.executable,
            "-m",
            "heptarm.sim.runtime.cabinet",
            "--model",
            target.model,
            "--port",
            "0",
        ]
        for name, value in target.options:
            command += [flag(name), value]
        if key is None:
            command += ["--data", "heptarm.key="]  # a key in a project's file is that of the real cabinet
        scene = dict(target.options).get("scene", "")
        with system_errors(_NOT_STARTED, kind=ConnectFailed):
            positions = Path(tempfile.mkdtemp(prefix="heptarm-")) / "positions" if scene else None
        if positions is not None:
            command += ["--positions", str(positions)]
        command.append("--parent-pipe")
        # a session of its own: Ctrl-C in the terminal reaches only this process, which then stops the arm
        try:
            with system_errors(_NOT_STARTED, kind=ConnectFailed):
                process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                    start_new_session=True,
                    env=_NO_WINDOW
                    | environment(key),  # never an argument, which all users of the machine can read
                )
        except BaseException:
            _remove(positions)
            raise
        output: deque[str] = deque(maxlen=20)
        ready: queue.SimpleQueue[_Ready | None] = queue.SimpleQueue()
        replies: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        wrong_option = threading.Event()
        readers = [
            threading.Thread(
                target=_read_output,
                args=(process, ready, replies, output, wrong_option),
                name="heptarm-sim-out",
                daemon=True,
            ),
            threading.Thread(target=_read_log, args=(process, output), name="heptarm-sim-log", daemon=True),
        ]
        for reader in readers:
            reader.start()
        is_slow = False
        try:
            found = ready.get(timeout=timeout)
        except queue.Empty:
            found, is_slow = None, True
        except BaseException:
            _end(process, readers, positions)
            raise
        if found is None:
            _end(process, readers, positions)
            if is_slow:
                raise ConnectFailed(
                    f"the virtual cabinet did not start within {timeout:g} s",
                    hint="check the load and the free memory of this machine",
                )
            hint = "run `python -m heptarm.sim.runtime.cabinet`; it needs pip install 'heptarm[sim]'"
            if wrong_option.is_set():
                hint = f'correct the target "{target}"'
            raise ConnectFailed(f"{_NOT_STARTED}: {' | '.join(output) or 'no output'}", hint=hint)
        for note in found.notes:
            _log.warning("%s", note)
        return cls(process, found.port, found.model, readers, replies, scene, positions)

    @property
    def is_running(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def operate(self, words: str) -> tuple[str, str]:
        """Carry out an operator command; returns the error text, "" if it succeeded, and what it shows.

        Raises:
            ConnectionLost: the process has ended, or does not answer.
        """
        if not self.is_running:
            raise ConnectionLost(
                "the virtual cabinet has ended, or belongs to the process that this one is a fork of",
                hint="connect again",
            )
        with self._command_lock:
            try:
                assert self._process.stdin is not None
                self._process.stdin.write(f"{' '.join(words.split())}\n")
                self._process.stdin.flush()
                return self._replies.get(timeout=_REPLY_TIMEOUT)
            except (OSError, ValueError, queue.Empty):
                raise ConnectionLost(
                    f"the virtual cabinet did not answer within {_REPLY_TIMEOUT:g} s", hint="connect again"
                ) from None

    def close(self) -> None:
        """End the process; calling it again has no effect."""
        atexit.unregister(self.close)
        _end(self._process, self._readers, self.positions)


#: All private cabinets, for a fork of the process.
_cabinets: weakref.WeakSet[PrivateCabinet] = weakref.WeakSet()


def _abandon_cabinets() -> None:
    for cabinet in list(_cabinets):
        cabinet.abandon()


if hasattr(os, "register_at_fork"):  # not on Windows, where no process forks
    os.register_at_fork(after_in_child=_abandon_cabinets)


def _read_output(
    process: subprocess.Popen[str],
    ready: queue.SimpleQueue[_Ready | None],
    replies: queue.SimpleQueue[tuple[str, str]],
    output: deque[str],
    wrong_option: threading.Event,
) -> None:
    """Read the READY line, which may be a refusal of an option, then the replies to operator commands."""
    assert process.stdout is not None
    for line in process.stdout:
        try:
            message = json.loads(line)
            if "operator" in message:
                replies.put((str(message["error"]), str(message["shown"])))
            elif message["ready"]:
                notes = tuple(map(str, message["notes"]))
                ready.put(_Ready(int(message["port"]), str(message["model"]), notes))
            else:
                output.append(str(message["error"]))
                if message.get("options"):
                    wrong_option.set()
        except (ValueError, KeyError, TypeError):
            output.append(line.rstrip())
    ready.put(None)


def _read_log(process: subprocess.Popen[str], output: deque[str]) -> None:
    assert process.stderr is not None
    for line in process.stderr:
        output.append(line.rstrip())
        _log.debug("%s", line.rstrip())


def _end(process: subprocess.Popen[str], readers: list[threading.Thread], positions: Path | None) -> None:
    """Close the pipe and wait; kill the process if it does not end; remove its file of positions."""
    with contextlib.suppress(OSError):  # the process may have ended already
        if process.stdin is not None:
            process.stdin.close()
    try:
        process.wait(_END_TIMEOUT)
    except subprocess.TimeoutExpired:
        _log.warning(
            "the virtual cabinet (process %d) did not end within %g s; killing it", process.pid, _END_TIMEOUT
        )
        process.kill()
        process.wait(_END_TIMEOUT)
    for reader, pipe in zip(readers, (process.stdout, process.stderr), strict=True):
        reader.join(1.0)
        if pipe is not None and not reader.is_alive():
            pipe.close()
    _remove(positions)


def _remove(positions: Path | None) -> None:
    """Remove the file of positions and its folder."""
    if positions is not None:
        shutil.rmtree(positions.parent, ignore_errors=True)
