"""Ends the processes of tests when the tests themselves have ended, also when they were killed.

    python tests/reaper.py RUN PARENT

A process of its own beside each process of pytest, in a session of its own: what ends the tests does not end it. It
needs the standard library only, because it starts with every run.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

#: Environment variable that every process of a test inherits: the run, and the owner of the process.
MARK = "TESTS_OF_HEPTARM"


@dataclass(frozen=True)
class Started:
    """A process that tests have started.

    Attributes:
        pid: its number.
        owner: id of the test, module or folder that it may live as long as.
        command: its command line.
    """

    pid: int
    owner: str
    command: str

    def __str__(self) -> str:
        return f"{self.pid} {self.command}"


def numbers() -> set[int]:
    """All processes of this machine."""
    return {int(name) for name in os.listdir("/proc") if name.isdigit()} if Path("/proc").is_dir() else set()


def started(run: str, *, but: Collection[int] = ()) -> list[Started]:
    """The processes that carry a run's mark; those in `but` are not looked at."""
    mark = f"{MARK}={run} ".encode()
    found = []
    for pid in numbers().difference(but, [os.getpid()]):
        folder = Path("/proc", str(pid))
        try:
            for entry in (folder / "environ").read_bytes().split(b"\0"):
                if entry.startswith(mark):
                    command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                    found.append(Started(pid, entry[len(mark) :].decode(errors="replace"), command.strip()))
        except OSError:
            continue  # ended meanwhile, or of another user
    return found


def abort(process: Started) -> None:
    """End it with SIGABRT, on which Python can print its stacks."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(process.pid, signal.SIGABRT)
        os.kill(process.pid, signal.SIGCONT)


def end(process: Started) -> None:
    """Kill it, also if it is suspended."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(process.pid, signal.SIGKILL)


def main() -> None:
    """Wait for the end of the parent; then end what is left."""
    while os.getppid() == int(sys.argv[2]):
        time.sleep(0.5)
    while left := started(sys.argv[1]):  # again: a process may have started another one meanwhile
        for process in left:
            end(process)
        time.sleep(0.1)


if __name__ == "__main__":
    main()
