"""What a newcomer has: an empty home, a fresh clone of the last commit, and a clock.

The scripts `first_hour.py` and `first_day.py` take their steps here. Everything is in a temporary folder: a fresh HOME,
no inherited PYTHONPATH or virtual environment, no cache of pip. Compilers and other packages of the system are those of
this machine. It needs the network, and nothing but Python's standard library.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: The environment that a newcomer has as well: the network's, and where the system's programs are.
KEPT = ("PATH", "LANG", "TERM", "http_proxy", "https_proxy", "no_proxy", "PIP_INDEX_URL", "SSL_CERT_FILE")
#: Longest duration of a step on a machine that does nothing else [s].
PATIENCE = 900.0
#: A block of Python that a reader types; one whose fence states `no-run` is none.
BLOCK = re.compile(r"^```python(?![^\n]*no-run)[^\n]*\n(.*?)^```", re.S | re.M)


@dataclass(frozen=True)
class Step:
    """A step of a newcomer: its short name for `--only`, its title, and what it does; it returns the outcome."""

    name: str
    title: str
    run: Callable[[], str]


@dataclass(frozen=True)
class Timed:
    """How a step ended."""

    title: str
    seconds: float
    outcome: str
    failed: bool = False


class Newcomer:
    """A person with an empty home.

    Args:
        folder: an empty folder.
        patience: longest duration of a step [s].
    """

    def __init__(self, folder: Path, *, patience: float = PATIENCE) -> None:
        self._patience = patience
        self.home, self.clone = folder / "home", folder / "heptarm"
        self._folder = folder
        self.home.mkdir()

    @property
    def python(self) -> Path:
        """Python of the clone's environment, which `make demo` makes."""
        return self.clone / ".venv/bin/python"

    def run(self, *command: str | Path, cwd: Path | None = None) -> str:
        """Run a command in the clone, or in another folder; returns what it prints.

        Raises:
            RuntimeError: it failed; the text is the end of what it said.
        """
        environment = {name: os.environ[name] for name in KEPT if name in os.environ}
        environment |= {"HOME": str(self.home), "PIP_NO_CACHE_DIR": "1"}
        started = subprocess.Popen(
            [str(word) for word in command],
            cwd=self.clone if cwd is None else cwd,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            output, complaint = started.communicate(timeout=self._patience)
        except BaseException:  # it ran too long, or Ctrl-C: what it has started ends with it
            os.killpg(started.pid, signal.SIGKILL)
            started.communicate()
            raise
        if started.returncode:
            raise RuntimeError((complaint.strip() or output.strip())[-2000:])
        return output

    def last(self, *command: str | Path, cwd: Path | None = None) -> str:
        """Run a command; returns the last line that it prints."""
        lines = [line.strip() for line in self.run(*command, cwd=cwd).splitlines() if line.strip()]
        return lines[-1] if lines else ""

    def get(self) -> str:
        """Clone the repository; returns its last commit."""
        self.run("git", "clone", "-q", f"file://{ROOT}", self.clone, cwd=self._folder)
        return self.last("git", "log", "-1", "--format=%h %s")

    def type_in(self, page: str, heading: str = "") -> str:
        """Run the Python blocks of a page, or of one of its sections, as one program; returns its last line.

        Raises:
            ValueError: there is no such section, or nothing to type.
        """
        text = (self.clone / page).read_text(encoding="utf-8")
        if heading:
            _, found, text = text.partition(f"\n## {heading}\n")
            text = text.partition("\n## ")[0]
            if not found:
                raise ValueError(f"{page} has no section {heading!r}")
        blocks = BLOCK.findall(text)
        if not blocks:
            raise ValueError(f"{page} has nothing to type in under {heading!r}")
        program = self._folder / "program.py"
        program.write_text("\n".join(blocks), encoding="utf-8")
        return f"{len(blocks)} snippets; {self.last(self.python, program, cwd=self.home)}"


def timed(step: Step) -> Timed:
    """Take a step."""
    began = time.monotonic()
    try:
        outcome, failed = step.run(), False
    except LookupError as error:
        outcome, failed = f"left out: {error.args[0]}", False
    except (RuntimeError, subprocess.TimeoutExpired, ValueError, OSError) as error:
        outcome, failed = str(error), True
    return Timed(step.title, time.monotonic() - began, outcome, failed)


def take(steps_of: Callable[[Path], Iterable[Step]], only: str) -> int:
    """Take steps in a temporary folder and print a table; the first failure ends them.

    Args:
        steps_of: the steps of a newcomer in this folder.
        only: names of steps, separated by commas; empty: all.

    Returns:
        The status to exit with.
    """
    chosen = {part for part in only.split(",") if part}
    total = 0.0
    with tempfile.TemporaryDirectory(prefix="heptarm-newcomer-") as folder:
        for step in steps_of(Path(folder)):
            if chosen and step.name not in chosen:
                continue
            result = timed(step)
            total += result.seconds
            print(f"{result.seconds:7.1f} s  {result.title:42}  {result.outcome.strip()[:110]}", flush=True)
            if result.failed:
                print(result.outcome, file=sys.stderr)
                return 1
    print(f"{total:7.1f} s  in all")
    return 0
