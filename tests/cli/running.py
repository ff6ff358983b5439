"""Runs the command line as a user does."""

from __future__ import annotations

import io
import json
import logging
import os
import runpy
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import IO, Any, ClassVar
from unittest.mock import patch

import heptarm.cli
from tests.doubled import check_lines
from tests.forks import Forks, Popen
from tests.interrupts import ctrl_c_interrupts
from tests.long import LONG
from tests.retry import retry, silent

#: Environment variables that would change what a command does.
_OURS = ("HEPTARM_TARGET", "HEPTARM_KEY")
HEPTARM = [sys.executable, "-m", "heptarm.cli.main"]

#: What commands import.
_PACKAGES = (
    *("cyclopts", "cyclopts.help", "docstring_parser", "rich.markdown", "rich.syntax", "numpy", "jpype"),
    *(
        "heptarm",
        "heptarm.arm.several",
        "heptarm.planning.search",
        "heptarm.panel.process",
        "heptarm.testing",
    ),
    *("heptarm.cli.doctor", "heptarm.cli.motion", "heptarm.cli.record", "heptarm.cli.sim.cabinet"),
)


class Command(Popen):
    """A command that runs in a fork."""

    forks: ClassVar[dict[str, Forks]] = {HEPTARM[2]: Forks(_PACKAGES)}


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """One command, to its end."""
    variables = {name: value for name, value in os.environ.items() if name not in _OURS} | environment

    def attempt() -> subprocess.CompletedProcess[str]:
        pipe = subprocess.PIPE
        with Command([*HEPTARM, *arguments], stdout=pipe, stderr=pipe, text=True, env=variables) as process:
            try:
                said = process.communicate(timeout=120)
            except BaseException:
                process.kill()
                raise
        return subprocess.CompletedProcess(process.args, process.returncode, *said)

    done = retry(attempt, silent)
    check_lines(done.stderr)
    return done


def refused(*arguments: str) -> subprocess.CompletedProcess[str]:
    """One command that ends before it starts anything: in this process, or in one of its own with LONG=1.

    A process takes most of a second of a processor, and there are a hundred refusals.
    """
    if LONG:
        return run(*arguments)
    variables = {name: value for name, value in os.environ.items() if name not in _OURS}
    log, on_end = logging.getLogger("heptarm"), signal.getsignal(signal.SIGTERM)
    level = log.level
    with (
        patch.dict(os.environ, variables, clear=True),
        patch.object(sys, "argv", ["heptarm", *arguments]),
        redirect_stdout(io.StringIO()) as said,
        redirect_stderr(io.StringIO()) as complained,
    ):
        try:
            runpy.run_path(str(Path(heptarm.cli.__file__).with_name("main.py")), run_name="__main__")
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        finally:  # commands own their process
            log.setLevel(level)
            signal.signal(signal.SIGTERM, on_end)
    command = [*HEPTARM, *arguments]
    return subprocess.CompletedProcess(command, code, said.getvalue(), complained.getvalue())


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
