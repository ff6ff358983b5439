"""Starts commands from a process that has imported the packages already.

To import them takes a second of a processor, longer than most commands: so they are imported once, and each command
runs in a fork. It is a process of its own in all else: with its arguments, its environment, its exit code, and the
module `heptarm.cli.main` executed from its first line on.

    python -m tests.cli.forks ADDRESS
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO, Any

ROOT = Path(__file__).parents[2]
#: What commands import.
PACKAGES = (
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


class Forks:
    """The process, for those that want a command to run.

    Args:
        folder: for its socket and the output of commands.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._address = folder, str(folder / "socket")
        command = [sys.executable, "-m", "tests.cli.forks", self._address]
        self._process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, start_new_session=True
        )
        assert self._process.stdout is not None and self._process.stdout.readline()

    def close(self) -> None:
        """End it; commands that still run go on."""
        self._process.terminate()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def run(
        self, arguments: tuple[str, ...], environment: dict[str, str], *, timeout: float
    ) -> subprocess.CompletedProcess[str]:
        """One command, to its end.

        Args:
            arguments: after `heptarm`.
            environment: all variables.
            timeout: until it is killed [s].
        """
        folder = Path(tempfile.mkdtemp(dir=self._folder))
        output = [folder / name for name in ("stdout", "stderr")]
        asked = {"arguments": arguments, "environment": environment, "folder": os.getcwd()}
        with socket.socket(socket.AF_UNIX) as line, line.makefile("rw", encoding="utf-8") as lines:
            line.settimeout(timeout)
            line.connect(self._address)
            lines.write(json.dumps(asked | {"output": list(map(str, output))}) + "\n")
            lines.flush()
            process = json.loads(lines.readline())
            try:
                code = json.loads(lines.readline())
            except TimeoutError:
                os.kill(process, signal.SIGKILL)
                raise subprocess.TimeoutExpired(arguments, timeout) from None
        stdout, stderr = (file.read_text(encoding="utf-8") for file in output)
        return subprocess.CompletedProcess(("heptarm", *arguments), code, stdout, stderr)


def _serve(address: str) -> dict[str, Any]:
    """Serve until the end of this process; in the fork for a command: what is asked."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(address)
        server.listen()
        print("ready", flush=True)
        while True:
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
            line, _ = server.accept()
            with line:
                if os.fork():
                    continue
                with line.makefile("rw", encoding="utf-8") as lines:
                    asked: dict[str, Any] = json.loads(lines.readline())
                    if not (command := os.fork()):
                        return asked
                    _answer(lines, command)


def _answer(lines: IO[str], command: int) -> None:
    lines.write(f"{command}\n")
    lines.flush()
    lines.write(f"{os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])}\n")
    lines.flush()
    os._exit(0)


def _become(asked: dict[str, Any]) -> None:
    """Give this process the arguments, variables, folder and output of a command."""
    sys.argv = ["heptarm", *asked["arguments"]]
    os.environ.clear()
    os.environ.update(asked["environment"])
    os.chdir(asked["folder"])
    for number, path in enumerate(asked["output"], start=1):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, number)
        os.close(file)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1, errors="backslashreplace")  # noqa: SIM115


def main(address: str) -> None:
    """Import the packages, and serve."""
    gc.disable()
    for name in PACKAGES:
        importlib.import_module(name)
    gc.freeze()  # a fork shares the memory of what is there, as long as it is not collected
    gc.enable()
    _become(_serve(address))
    runpy.run_module("heptarm.cli.main", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main(sys.argv[1])
