"""A virtual cabinet of one's own: a child process that ends with this one, whatever happens.

The child gets a pipe as its standard input and ends when that closes; the operating system closes it even when this
process is killed. Nothing of heptarm.virtual is imported here.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import logging
import queue
import subprocess
import sys
import threading
from collections import deque

from heptarm.arm.target import Target
from heptarm.errors import ConnectFailed, ConnectionLost

_log = logging.getLogger("heptarm.sim")

#: A virtual cabinet is ready within a few seconds; a busy machine may need more [s].
READY_TIMEOUT = 60.0
_END_TIMEOUT = 5.0
_REPLY_TIMEOUT = 20.0


class PrivateCabinet:
    """A running virtual cabinet.

    Attributes:
        host: where it listens.
        port: where it listens.
        pid: its process id.
    """

    host = "127.0.0.1"

    def __init__(
        self,
        process: subprocess.Popen[str],
        port: int,
        readers: list[threading.Thread],
        replies: queue.SimpleQueue[str],
    ) -> None:
        self._replies = replies
        self._asking = threading.Lock()
        self.port = port
        self.pid = process.pid
        self._process = process
        self._readers = readers
        atexit.register(self.close)

    @classmethod
    def start(cls, target: Target, *, timeout: float = READY_TIMEOUT) -> PrivateCabinet:
        """Start one and wait until it accepts clients.

        Raises:
            ConnectFailed: it does not start; the text has its last words.
        """
        command = [sys.executable, "-m", "heptarm.virtual.cabinet", "--model", target.model, "--port", "0"]
        for name, value in target.options:
            command += [f"--{name}", value]
        command.append("--parent-pipe")
        # its own session: a Ctrl-C at the terminal is for this process, which then stops the arm through the link
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        words: deque[str] = deque(maxlen=20)
        ready: queue.SimpleQueue[int | None] = queue.SimpleQueue()
        replies: queue.SimpleQueue[str] = queue.SimpleQueue()
        readers = [
            threading.Thread(
                target=_listen, args=(process, ready, replies, words), name="heptarm-sim-out", daemon=True
            ),
            threading.Thread(target=_drain, args=(process, words), name="heptarm-sim-log", daemon=True),
        ]
        for reader in readers:
            reader.start()
        try:
            port = ready.get(timeout=timeout)
        except queue.Empty:
            port = None
        except BaseException:
            _end(process, readers)
            raise
        if port is None:
            _end(process, readers)
            raise ConnectFailed(
                f"the virtual cabinet did not start: {' | '.join(words) or 'it said nothing'}",
                hint="try `python -m heptarm.virtual.cabinet`; it needs pip install 'heptarm[sim]'",
            )
        return cls(process, port, readers, replies)

    @property
    def is_running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def operate(self, words: str) -> str:
        """Let the person beside the robot do something; returns why it was not understood, "" if it was.

        Raises:
            ConnectionLost: the process has ended, or does not answer.
        """
        with self._asking:
            try:
                assert self._process.stdin is not None
                self._process.stdin.write(f"{' '.join(words.split())}\n")
                self._process.stdin.flush()
                return self._replies.get(timeout=_REPLY_TIMEOUT)
            except (OSError, ValueError, queue.Empty):
                raise ConnectionLost("the virtual cabinet does not answer", hint="connect again") from None

    def close(self) -> None:
        """End it; closing twice is legal."""
        atexit.unregister(self.close)
        _end(self._process, self._readers)


def _listen(
    process: subprocess.Popen[str],
    ready: queue.SimpleQueue[int | None],
    replies: queue.SimpleQueue[str],
    words: deque[str],
) -> None:
    """Wait for the READY line, then hand on what is answered to the operator."""
    assert process.stdout is not None
    for line in process.stdout:
        try:
            message = json.loads(line)
            if "operator" in message:
                replies.put(str(message["error"]))
            elif message["ready"]:
                ready.put(int(message["port"]))
            else:
                words.append(str(message["error"]))
        except (ValueError, KeyError, TypeError):
            words.append(line.rstrip())
    ready.put(None)


def _drain(process: subprocess.Popen[str], words: deque[str]) -> None:
    assert process.stderr is not None
    for line in process.stderr:
        words.append(line.rstrip())
        _log.debug("%s", line.rstrip())


def _end(process: subprocess.Popen[str], readers: list[threading.Thread]) -> None:
    """Close its pipe, wait, and kill it if that is not enough."""
    with contextlib.suppress(OSError):  # it may be gone already
        if process.stdin is not None:
            process.stdin.close()
    try:
        process.wait(_END_TIMEOUT)
    except subprocess.TimeoutExpired:
        _log.warning("the virtual cabinet (process %d) did not end by itself; killing it", process.pid)
        process.kill()
        process.wait(_END_TIMEOUT)
    for reader, pipe in zip(readers, (process.stdout, process.stderr), strict=True):
        reader.join(1.0)
        if pipe is not None and not reader.is_alive():
            pipe.close()
