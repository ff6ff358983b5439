"""Runs the projects of examples/sunrise, each with its client, from the command to the end."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.cli.running import HEPTARM
from tests.interrupts import ctrl_c_interrupts

SUNRISE = Path(__file__).parents[2] / "examples" / "sunrise"
#: After this time everything here is over, also on a busy machine [s].
PATIENCE = 240.0
#: Simulated seconds per second.
SPEED = "2"
#: An application's addresses in the laboratory, and here.
HERE = ("--map", "172.31.1.25=127.0.0.1")


@dataclass(frozen=True, slots=True)
class Driven:
    """A project that was driven to its end.

    Attributes:
        returncode: of the command.
        log: everything that it printed.
        said: lines of its client.
        ready_after: from the command until the application ran [s].
        seconds: from the command to its end [s].
    """

    returncode: int
    log: str
    said: tuple[str, ...]
    ready_after: float
    seconds: float


class Running:
    """A project that runs; see `running`."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.log = ""
        self._began = time.monotonic()
        self._ready_after = float("nan")

    def until(self, words: str) -> bool:
        """Read until a line contains these words; False: it never does."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.log += line
            if "runs on a virtual" in line:
                self._ready_after = time.monotonic() - self._began
            if words and words in line:
                return True
        return False

    def type(self, *lines: str) -> None:
        """Type lines of the operator."""
        assert self.process.stdin is not None
        self.process.stdin.writelines(f"{line}\n" for line in lines)
        self.process.stdin.flush()

    def end(self, said: list[str] | None = None) -> Driven:
        """Read to its end."""
        self.until("")
        code = self.process.wait(timeout=PATIENCE)
        seconds = time.monotonic() - self._began
        return Driven(code, self.log, tuple(said or ()), self._ready_after, seconds)


@contextmanager
def running(project: str, *options: str, speed: str = SPEED) -> Iterator[Running]:
    """A project of examples/sunrise; ended as by Ctrl-C if it still runs at the end, killed after a long time."""
    command = [*HEPTARM, "sim", "--app", str(SUNRISE / project), "--speed", speed, *options]
    with _killed_late(command) as process:
        yield Running(process)


@contextmanager
def _killed_late(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    pipe = subprocess.PIPE
    with ctrl_c_interrupts():
        started = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True)
    with started as process:
        timer = threading.Timer(PATIENCE, process.kill)
        timer.start()
        try:
            yield process
        finally:
            timer.cancel()
            if process.poll() is None:
                process.send_signal(signal.SIGINT)


@contextmanager
def client(*words: str) -> Iterator[subprocess.Popen[str]]:
    """A client of a project, in an interpreter that cannot import heptarm; killed at the end if it still runs."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-I", "-S", *words], stdout=pipe, stderr=pipe, text=True, env=environment
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def ended(process: subprocess.Popen[str]) -> list[str]:
    """Lines of a client that ends without an error."""
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, out + err
    return out.splitlines()


def _port_of(process: subprocess.Popen[str]) -> int:
    """The port that a client has printed."""
    assert process.stdout is not None
    found = re.fullmatch(r"port (\d+)\n", process.stdout.readline())
    assert found is not None
    return int(found[1])


def free_port() -> int:
    """A port for a server that takes its port as a number."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


# ---------------------------------------------------------------------------------------- the projects, one by one


def token_server() -> Driven:
    """The TCP server of text."""
    port = str(free_port())
    script = str(SUNRISE / "token_server" / "client.py")
    with (
        running("token_server", "--app-data", f"port={port}") as cabinet,
        client(script, "127.0.0.1", port) as pc,
    ):
        return cabinet.end(ended(pc))


def dial_out() -> Driven:
    """The application that dials the PC."""
    with (
        client(str(SUNRISE / "dial_out" / "pc.py"), "0") as pc,
        running("dial_out", *HERE, "--app-data", f"pc_port={_port_of(pc)}") as cabinet,
    ):
        return cabinet.end(ended(pc))


def pad_menu() -> Driven:
    """The menu on the smartPAD, with its own operator."""
    script = SUNRISE / "pad_menu" / "operator.py"
    with _killed_late([sys.executable, str(script), str(SUNRISE / "pad_menu"), "--speed", SPEED]) as process:
        return Running(process).end()


def station_io() -> Driven:
    """The application with signals, and its background task."""
    with (
        client(str(SUNRISE / "station_io" / "listen.py"), "0") as pc,
        running("station_io", *HERE, "--app-data", f"status_port={_port_of(pc)}") as cabinet,
    ):
        assert cabinet.until("waiting for orders"), cabinet.log
        cabinet.type("set Station.Pressure 2.5", "set Station.Order 60", "set Station.Start 1")
        assert cabinet.until("order 60 is done"), cabinet.log
        cabinet.type("set Station.Start 0", "set Station.Order 20", "set Station.Start 1")
        assert cabinet.until("order 20 is done"), cabinet.log
        said = ended(pc)
        cabinet.type("set Station.Start 0", "set Station.Order 255", "set Station.Start 1")
        return cabinet.end(said)


def recorder() -> Driven:
    """The recorder, and the script that reads its files."""
    folder = tempfile.mkdtemp(prefix="heptarm-recordings-")
    try:
        with running("recorder", "--app-data", f"recordings={folder}") as cabinet:
            done = cabinet.end()
        with client(str(SUNRISE / "recorder" / "read.py"), folder) as reader:
            return Driven(done.returncode, done.log, tuple(ended(reader)), done.ready_after, done.seconds)
    finally:
        shutil.rmtree(folder)


def cell() -> Driven:
    """Pick and place with a tool of its own class."""
    with running("cell", "--app-data", "cell.parts=1") as cabinet:
        return cabinet.end()


DRIVERS: dict[str, Callable[[], Driven]] = {
    one.__name__: one for one in (cell, token_server, dial_out, pad_menu, station_io, recorder)
}
