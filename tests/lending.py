"""Virtual cabinets that programs under test use one after the other, instead of starting one each.

A test module lends them to the programs that it runs: in those, `connect("sim://iiwa14")` takes a cabinet that is
free and of the same model and speed, and gives it back when the connection or the program ends. A program that asks for
one faster than time gets the fastest. A cabinet that comes back is made as it was: nothing pressed, nothing attached,
the arm at its first position. One that cannot be made so is ended, and another one started when it is asked for. A
program that asks for another option, or for a second arm, starts its own.
"""

from __future__ import annotations

import json
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

import heptarm as ha
from heptarm.arm.link.local_simulator import READY_TIMEOUT, PrivateCabinet
from heptarm.arm.link.target import Target
from tests import reaper

ROOT = Path(__file__).resolve().parents[1]
#: How a program takes part; put before it.
PRELUDE = """
import sys
sys.path.append({root!r})
from tests.lending import borrow
borrow({address!r})
sys.path.remove({root!r})
"""


def borrow(address: str) -> None:
    """From now on private virtual cabinets of this program are those of a `Lender`, where it has one free."""
    start = PrivateCabinet.start

    def take(target: Target, *, key: str | None = None, timeout: float = READY_TIMEOUT) -> PrivateCabinet:
        options = dict(target.options)
        if key is None and not options.keys() - {"speed"}:
            line = socket.socket(socket.AF_UNIX)
            line.connect(address)
            lent = Borrowed.take(line, target.model, float(options.get("speed", 1.0)))
            if lent is not None:
                return lent
        return start(target, key=key, timeout=timeout)

    PrivateCabinet.start = take  # type: ignore[method-assign]


class Borrowed(PrivateCabinet):
    """A cabinet of another process: what its operator does goes through there."""

    def __init__(self, line: socket.socket, lines: Any, attributes: dict[str, Any]) -> None:
        vars(self).update(attributes)  # what a PrivateCabinet shows: port, pid, model and others
        self._line, self._lines, self._asking = line, lines, threading.Lock()

    @classmethod
    def take(cls, line: socket.socket, model: str, speed: float) -> Borrowed | None:
        """One that is free; None: there is none."""
        lines = line.makefile("rw", encoding="utf-8")
        given = _ask(lines, {"model": model, "speed": speed})
        if given:
            return cls(line, lines, given)
        lines.close()
        line.close()
        return None

    @property
    def is_running(self) -> bool:
        return True

    def operate(self, words: str) -> tuple[str, str]:
        with self._asking:
            error, shown = _ask(self._lines, {"operate": words})
        return error, shown

    def abandon(self) -> None:
        """A fork of the program neither operates it nor gives it back."""

    def close(self) -> None:
        with self._asking:
            if not self._lines.closed:
                self._lines.close()
                self._line.close()


def _ask(lines: Any, question: Any) -> Any:
    lines.write(json.dumps(question) + "\n")
    lines.flush()
    return json.loads(lines.readline())


class Lender:
    """Lends some cabinets, which it starts, until it is closed.

    Args:
        address: path of its socket.
        speeds: one cabinet of each speed; it is started when it is first asked for.
    """

    def __init__(self, address: Path, *speeds: float) -> None:
        self.address = str(address)
        self._changed = threading.Condition()
        self._owner = os.environ.get(
            reaper.MARK
        )  # its cabinets live as long as it, not as the test that asks
        self._cabinets: dict[float, _Lent | None] = dict.fromkeys(speeds)
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(self.address)
        self._server.listen()
        self._threads = [threading.Thread(target=self._serve, name="lender", daemon=True)]
        self._threads[0].start()

    @property
    def prelude(self) -> str:
        """Put before a program that is to borrow."""
        return PRELUDE.format(root=str(ROOT), address=self.address)

    def __enter__(self) -> Lender:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        for thread in self._threads:
            thread.join(30.0)
        for lent in self._cabinets.values():
            if lent is not None:
                lent.cabinet.close()

    def _serve(self) -> None:
        while True:
            try:
                line, _ = self._server.accept()
            except OSError:
                return
            thread = threading.Thread(target=self._lend, args=(line,), name="lending", daemon=True)
            self._threads.append(thread)
            thread.start()

    def _lend(self, line: socket.socket) -> None:
        with line, line.makefile("rw", encoding="utf-8") as lines:

            def answer(value: object) -> None:
                lines.write(json.dumps(value) + "\n")
                lines.flush()

            asked = json.loads(lines.readline())
            with self._taken(asked["model"], asked["speed"]) as lent:
                if lent is None:
                    answer(None)
                    return
                answer({name: value for name, value in vars(lent.cabinet).items() if name[0] != "_"})
                try:
                    for question in lines:
                        answer(lent.cabinet.operate(json.loads(question)["operate"]))
                except OSError:
                    pass  # the program was killed

    @contextmanager
    def _taken(self, model: str, speed: float) -> Iterator[_Lent | None]:
        fastest = max(self._cabinets)
        speed = fastest if 1.0 < speed <= fastest else speed
        with self._changed:
            lent = None
            if model == "iiwa14" and speed in self._cabinets:
                lent = self._cabinets[speed]
                self._changed.wait_for(lambda: lent is None or not lent.is_tidied, 60.0)
                if lent is None or lent.is_spoilt:
                    lent = self._cabinets[speed] = self._started(speed)
                lent = None if lent.is_taken else lent
            if lent is not None:
                lent.is_taken = True
        try:
            yield lent
        finally:
            if lent is not None:
                with self._changed:
                    lent.is_tidied = True
                lent.tidy()
                with self._changed:
                    lent.is_taken = lent.is_tidied = False
                    self._changed.notify_all()

    def _started(self, speed: float) -> _Lent:
        """Another cabinet; the test is waiting for the program that asks, so nothing else starts a process."""
        asking = os.environ.get(reaper.MARK)
        if self._owner is not None:
            os.environ[reaper.MARK] = self._owner
        try:
            return _Lent(speed)
        finally:
            if asking is not None:
                os.environ[reaper.MARK] = asking


class _Lent:
    """A cabinet that is lent again and again."""

    def __init__(self, speed: float) -> None:
        self.cabinet = PrivateCabinet.start(Target(model="iiwa14", options=(("speed", f"{speed:g}"),)))
        self.is_taken = self.is_tidied = self.is_spoilt = False
        self.spoilt_by = ""
        with self._connected() as arm:
            self._first, self._known = arm.state.q, _known(arm)

    def _connected(self) -> ha.Arm:
        return ha.connect(f"sim://{self.cabinet.host}:{self.cabinet.port}", watchdog=10.0, timeout=30.0)

    def tidy(self) -> None:
        """Make it as it was, or end it."""
        try:
            for words in ("clear", "release", "aut", "override 1"):
                self.cabinet.operate(words)
            with self._connected() as arm:
                arm.stop()
                arm.recover(timeout=30.0)
                arm.set_override(1.0)
                arm.move(ha.ptp(self._first), speed=1.0)
                for name, value in self._known[2].items():
                    if arm.io[name] != value:
                        arm.io[name] = value
                known = _known(arm)
            if known != self._known:
                raise RuntimeError(f"it was left with {known}, not {self._known}")
            assert np.abs(arm.state.q - self._first).max() < 1e-3
        except Exception as error:
            self.is_spoilt, self.spoilt_by = True, str(error)
            self.cabinet.close()


def _known(arm: ha.Arm) -> tuple[Any, Any, dict[str, bool | float], str]:
    """What a program can leave in a cabinet: tools, frames, signals, and the attached tool."""
    welcome = arm.connection.welcome
    return (welcome.tools, welcome.frames, {name: arm.io[name] for name in arm.io}, arm.state.tool)
