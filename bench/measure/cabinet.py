"""A virtual cabinet as a process, with its statistics and its memory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any

from tests.interrupts import ctrl_c_interrupts

#: Java's optimising compiler is busy for so long with what is called a thousand times a second [s].
WARM_UP = 12.0


class Cabinet:
    """Starts `python -m heptarm.sim.runtime.cabinet` on a free port.

    Args:
        options: of its command line.
        real_time: when it asks for real-time priority; latencies are measured with it.
    """

    def __init__(self, *options: str, real_time: str = "on") -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._stats = Path(self._folder.name) / "stats.json"
        began = time.monotonic()
        command = [
            sys.executable,
            "-m",
            "heptarm.sim.runtime.cabinet",
            "--port",
            "0",
            "--stats",
            str(self._stats),
            "--real-time",
            real_time,
            "--data",
            "heptarm.max_rate=1000",  # figures are of more than a cabinet's getters allow
        ]
        with ctrl_c_interrupts():  # also where the benchmarks run in the background
            self.process = subprocess.Popen(
                [*command, "--parent-pipe", *options],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        assert self.process.stdout is not None
        ready = json.loads(self.process.stdout.readline() or '{"ready": false}')
        if not ready["ready"]:
            raise RuntimeError(f"the virtual cabinet did not start: {ready}")
        self.ready_after = time.monotonic() - began
        self.port: int = ready["port"]

    @property
    def target(self) -> str:
        return f"sim://127.0.0.1:{self.port}"

    def pin(self, cpu: int) -> None:
        """Keep the plant's loop on one processor; its other threads stay free."""
        os.sched_setaffinity(self.process.pid, {cpu})

    def operate(self, words: str) -> None:
        """Let the simulated operator act, and wait until that is done."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(f"{words}\n")
        self.process.stdin.flush()
        reply = json.loads(self.process.stdout.readline() or '{"error": "the cabinet has ended"}')
        if reply["error"]:
            raise RuntimeError(reply["error"])

    def memory(self) -> float:
        """Proportional set size [MB]: what the process adds to the machine."""
        text = Path(f"/proc/{self.process.pid}/smaps_rollup").read_text()
        return next(int(line.split()[1]) for line in text.splitlines() if line.startswith("Pss:")) / 1024

    def stats(self) -> dict[str, Any]:
        """Statistics of the loop so far."""
        self._stats.unlink(missing_ok=True)
        self.process.send_signal(signal.SIGUSR1)
        deadline = time.monotonic() + 30.0
        while not self._stats.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        return dict(json.loads(self._stats.read_text()))

    def end(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        return self.process.wait(timeout=10)

    def _close_pipes(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()

    def __enter__(self) -> Cabinet:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.end()
        self._close_pipes()
        self._folder.cleanup()
