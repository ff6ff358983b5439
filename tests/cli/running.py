"""Runs the command line as a user does."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any

from tests.cli.forks import Forks
from tests.interrupts import ctrl_c_interrupts
from tests.retry import retry, silent

#: Environment variables that would change what a command does.
_OURS = ("HEPTARM_TARGET", "HEPTARM_KEY")
#: And those that the interpreter reads when it starts.
_INTERPRETERS = {"PYTHONPATH", "PYTHONWARNINGS", "LD_LIBRARY_PATH"}
HEPTARM = [sys.executable, "-m", "heptarm.cli.main"]


#: Where commands are started from; None: each is started by itself.
forks: Forks | None = None


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """One command, to its end."""
    variables = {name: value for name, value in os.environ.items() if name not in _OURS} | environment

    def attempt() -> subprocess.CompletedProcess[str]:
        if forks is not None and not environment.keys() & _INTERPRETERS:
            return forks.run(arguments, variables, timeout=120.0)
        return subprocess.run(
            [*HEPTARM, *arguments], capture_output=True, text=True, timeout=120, env=variables, check=False
        )

    return retry(attempt, silent)


def objects(*arguments: str) -> list[dict[str, Any]]:
    """The JSON objects that a command prints with --json; it must succeed."""
    done = run(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@contextmanager
def sim(*arguments: str, stderr: IO[str] | None = None) -> Iterator[dict[str, Any]]:
    """`heptarm sim --json` in the foreground of another process; ended as by Ctrl-C."""
    command = [*HEPTARM, "sim", "--json", "--port", "0", *arguments]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True)
    with process:
        try:
            assert process.stdout is not None
            yield json.loads(process.stdout.readline())
        finally:
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=20) == 0
