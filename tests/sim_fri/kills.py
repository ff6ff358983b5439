"""Both sides of a session as processes that are killed, in real time."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from heptarm.errors import ConnectionLost, Timeout
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.client import Client
from tests.sim_fri.scenarios import QUALITY

ROOT = Path(__file__).parents[2]
#: Longest wait, also on a busy machine [s].
PATIENCE = 120.0

_CONTROLLER = """
import sys
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.sim.fri.settings import describe
from heptarm.sim.runtime.standalone_fri import StandaloneSettings, Standalone
from tests.sim_fri.rig import Arm

client, own = ("127.0.0.1", int(sys.argv[1])), int(sys.argv[2])
settings = StandaloneSettings(configuration=SessionConfiguration(Version.V1_15, 5), client=client, port=own)
Standalone(Arm(), settings, listener=lambda event: print(describe(event), flush=True)).run()
"""

_USER = """
import sys, time
from heptarm.fri import Client
client = Client(int(sys.argv[1]), timeout=120.0)
client.wait("COMMANDING_ACTIVE", timeout=120.0)
print("active", flush=True)
time.sleep(600.0)
"""


class Program:
    """A Python program as a process, and the lines that it prints."""

    def __init__(self, text: str, *arguments: int) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", text, *map(str, arguments)], stdout=subprocess.PIPE, text=True, cwd=ROOT
        )
        self._lines: queue.Queue[str] = queue.Queue()
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.strip())

    def until(self, word: str) -> str:
        """The next line with a word in it."""
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                line = self._lines.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                code = self.process.poll()
                state = "it runs" if code is None else f"it ended with {code}"
                raise AssertionError(f"no line with {word!r} within {PATIENCE:g} s; {state}") from None
            if word in line:
                return line

    def kill(self) -> None:
        """SIGKILL."""
        self.process.kill()
        self.process.wait()
        self._thread.join()
        assert self.process.stdout is not None
        self.process.stdout.close()


@contextlib.contextmanager
def _running(text: str, *arguments: int) -> Iterator[Program]:
    program = Program(text, *arguments)
    try:
        yield program
    finally:
        program.kill()


def controllers(times: int) -> int:
    """Kill the controller during a session: the client reports it, waits, and accepts the next controller."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        own = probe.getsockname()[1]
    with Client(0, timeout=PATIENCE) as client:
        for _ in range(times):
            with _running(_CONTROLLER, client.port, own):
                client.wait("COMMANDING_ACTIVE", timeout=PATIENCE)
                for _ in range(3):
                    client.next(timeout=PATIENCE)
            try:
                while True:
                    client.next(timeout=0.2)
            except Timeout as error:
                assert "has stopped sending" in str(error), error
        assert client.stats.commanded > times and client.stats.restarts >= times - 1
    return times


def clients(times: int) -> int:
    """Kill the client, alternately its loop and its user: the controller reports the reason, and takes the next one."""
    with Client(0, timeout=PATIENCE) as probe:
        port = probe.port
    with _running(_CONTROLLER, port, 0) as controller:
        for turn in range(times):
            if turn % 2:
                with _running(_USER, port) as user:
                    user.until("active")
                    controller.until("-> COMMANDING_ACTIVE")
            else:
                _without_loop(port)
                controller.until("-> COMMANDING_ACTIVE")
            assert QUALITY in controller.until("overlay ended")
        with Client(port, timeout=PATIENCE) as client:
            client.wait("COMMANDING_ACTIVE", timeout=PATIENCE)
    return times


def _without_loop(port: int) -> None:
    """A client whose loop is killed: its user receives an error."""
    with Client(port, timeout=PATIENCE) as client:
        client.wait("COMMANDING_ACTIVE", timeout=PATIENCE)
        os.kill(int(client._header[at.PID]), signal.SIGKILL)
        try:
            while True:
                client.next(timeout=PATIENCE)
        except ConnectionLost as error:
            assert "its process has ended" in str(error), error
