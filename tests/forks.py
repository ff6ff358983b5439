"""Starts Python programs from processes that have imported their packages already: a pytest plugin for all tests.

To import the packages of a virtual cabinet takes half a second of a processor, as long as all else of its start; those
of a command take a second, longer than most commands. So they are imported once in each process of the tests, and each
program runs in a fork. It is a process of its own in all else: a child of the test's process, with its arguments,
its environment, its folder and its exit code, and its module executed from the first line on. The lists of the
system's processes show it with these, too.

What tests start is diverted here by itself where it is one of `PROGRAMS`. What a test's programs start in their turn
is not: so users' programs and commands start their cabinets as they do without tests.

    python -m tests.forks NUMBER MODULE ...
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from tests import reaper

ROOT = Path(__file__).parents[1]
#: Programs that run in a fork, and what is imported for them.
PROGRAMS = {
    "heptarm.sim.runtime.cabinet": (
        "heptarm.sim.runtime.cabinet",
        "heptarm.sim.runtime.java_plant",
        "heptarm.sim.runtime.jvm",
    ),
}
#: Variables that a program has read before its first line; it is started as always where they are others.
_READ_AT_ONCE = ("PYTHON", "LD_", "MUJOCO", "OMP_", "OPENBLAS_")
#: Cabinets draw nothing, and need no library for windows.
_PRESET = {"MUJOCO_GL": "disable"}
#: Place for the arguments and the environment of a program, in the process whose fork it is.
_ROOM = "HEPTARM_ROOM_OF_FORKS"
_ARGUMENTS, _VARIABLES = 8_000, 60_000
_LONGEST = 1 << 17
_SET_CHILD_SUBREAPER = 36
_REPLY_TIMEOUT = 60.0


class Forks:
    """A process with packages in it, started when it is first needed.

    Args:
        packages: modules that are imported.
    """

    def __init__(self, packages: Sequence[str]) -> None:
        self._packages = packages
        self._lock = threading.Lock()
        self._line: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._fixed: dict[str, str] = {}

    def close(self) -> None:
        """End the process; what it has started goes on."""
        with self._lock:
            if self._line is not None and self._process is not None:
                self._line.close()
                self._process.wait()
                self._line = self._process = None

    def suits(self, environment: Mapping[str, str]) -> bool:
        """Whether a program with this environment may run in a fork."""
        with self._lock:
            self._open()
            return self._fixed == _read_at_once(_PRESET | dict(environment))

    def start(
        self, arguments: Sequence[str], environment: Mapping[str, str], *, folder: str, files: Sequence[int],
        session: bool,
    ) -> int:  # fmt: skip
        """Start a program as a child of this process; returns its number.

        Args:
            arguments: module, and what follows it.
            environment: all variables.
            folder: to start it in.
            files: its standard input, output and error.
            session: whether it gets a session of its own.
        """
        asked = {
            "arguments": arguments,
            "environment": dict(environment),
            "folder": folder,
            "session": session,
        }
        with self._lock, _adopting():
            line = self._open()
            socket.send_fds(line, [json.dumps(asked).encode()], list(files))
            return int(line.recv(100))

    def _open(self) -> socket.socket:
        if self._line is None:
            self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            self._line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2 * _LONGEST)
            self._line.settimeout(_REPLY_TIMEOUT)
            # it lives as long as the tests: no test is its owner
            variables = {name: value for name, value in os.environ.items() if name != reaper.MARK} | _PRESET
            self._fixed = _read_at_once(variables)
            with theirs:
                self._process = _POPEN(
                    [sys.executable, "-m", __name__, str(theirs.fileno()), *self._packages, _ARGUMENTS * " "],
                    cwd=ROOT,
                    env=variables | {_ROOM: _VARIABLES * " "},
                    stdin=subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    start_new_session=True,
                )
        return self._line


def _read_at_once(environment: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in environment.items() if name.startswith(_READ_AT_ONCE)}


@contextlib.contextmanager
def _adopting() -> Iterator[None]:
    """Meanwhile descendants of this process whose parents end become its children."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "prctl")
    try:
        yield
    finally:
        libc.prctl(_SET_CHILD_SUBREAPER, 0, 0, 0, 0)


# ------------------------------------------------------------------------------- in the process with the packages


def _serve(line: socket.socket) -> dict[str, Any]:
    """Serve until nobody asks any more; in a fork: return what was asked for."""
    while True:
        message, files, _, _ = socket.recv_fds(line, _LONGEST, 3)
        if not message:
            os._exit(0)
        received, send = os.pipe()
        if not (between := os.fork()):
            if number := os.fork():
                os.write(send, str(number).encode())
                os._exit(0)  # so that the process that asks becomes its parent
            for file in (received, send):
                os.close(file)
            asked: dict[str, Any] = json.loads(message)
            return asked | {"files": files}
        os.waitpid(between, 0)
        os.close(send)
        line.send(os.read(received, 100))
        for file in (received, *files):
            os.close(file)


def _become(asked: dict[str, Any]) -> None:
    """Give this process the arguments, variables, folder and standard files of a program."""
    if asked["session"]:
        os.setsid()
    arguments, variables = asked["arguments"], asked["environment"]
    os.environ.clear()
    os.environ.update(variables)
    _appear([sys.executable, "-m", *arguments], variables)
    os.chdir(asked["folder"])
    sys.path[0] = asked["folder"]
    sys.argv = list(arguments)
    for number, file in enumerate(asked["files"]):
        os.dup2(file, number)
        os.close(file)
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1, errors="backslashreplace")  # noqa: SIM115


def _appear(command: Sequence[str], variables: Mapping[str, str]) -> None:
    """Show these in /proc, where tests look for the owners of processes; nothing else uses that memory any more."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    places = [int(number) for number in fields[45:49]]
    shown = (command, [f"{name}={value}" for name, value in variables.items()])
    for begin, end, words in zip(places[::2], places[1::2], shown, strict=True):
        text = b"".join(os.fsencode(word) + b"\0" for word in words)
        size = end - begin
        ctypes.memmove(begin, text[: size - 1].ljust(size, b"\0"), size)


def main(number: str, *packages: str) -> None:
    """Import the packages, and serve."""
    gc.disable()
    for name in packages:
        importlib.import_module(name)
    gc.freeze()  # a fork shares the memory of what is there, as long as it is not collected
    gc.enable()
    with socket.socket(fileno=int(number)) as line:
        asked = _serve(line)
    _become(asked)
    module = asked["arguments"][0]
    sys.modules.pop(module, None)  # it is executed from its first line on
    runpy.run_module(module, run_name="__main__", alter_sys=True)


# ------------------------------------------------------------------------------- in the process of the tests

_POPEN = subprocess.Popen
_owner: int | None = None
_home = ""  # network namespace of the forks


def _network() -> str:
    """The network namespace of this thread."""
    return os.readlink("/proc/thread-self/ns/net")


class Popen(subprocess.Popen):  # type: ignore[type-arg]
    """A process that runs in a fork where it can: where its module is known and it asks for nothing particular."""

    forks: ClassVar[dict[str, Forks]] = {}

    def _execute_child(self, args: Any, *rest: Any) -> None:
        (_, before, _, passed, folder, variables, _, _, shell), pipes, more = rest[:9], rest[9:15], rest[15:]
        environment = os.environ if variables is None else variables
        known = None
        if not shell and isinstance(args, (list, tuple)) and list(args[:2]) == [sys.executable, "-m"]:
            known = self.forks.get(args[2])
        particular = before is not None or passed or any(value not in (-1, None) for value in more[1:5])
        is_here = os.getpid() == _owner and _network() == _home
        if known is None or particular or not is_here or not known.suits(environment):
            super()._execute_child(args, *rest)  # type: ignore[misc]
            return
        self.pid = known.start(
            [str(word) for word in args[2:]],
            {str(name): str(value) for name, value in environment.items()},
            folder=os.fspath(folder or os.getcwd()),
            files=[
                file if file >= 0 else number for number, file in enumerate((pipes[0], pipes[3], pipes[5]))
            ],
            session=bool(more[5]),
        )
        self._child_created = True
        self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]


class _Diverted(Popen):
    forks: ClassVar[dict[str, Forks]] = {name: Forks(packages) for name, packages in PROGRAMS.items()}


def pytest_configure() -> None:
    """Divert the programs from now on."""
    global _owner, _home
    if sys.platform == "linux":  # elsewhere a fork of a process with libraries of the system is not safe
        _owner, _home = os.getpid(), _network()
        subprocess.Popen = _Diverted  # type: ignore[misc]


def pytest_unconfigure() -> None:
    """As it was."""
    subprocess.Popen = _POPEN  # type: ignore[misc]
    for one in _Diverted.forks.values():
        one.close()


if __name__ == "__main__":
    if hasattr(signal, "SIGINT"):
        signal.signal(signal.SIGINT, signal.default_int_handler)
    main(*sys.argv[1:-1])
