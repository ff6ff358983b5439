"""The virtual cabinet as a process: plant and JVM together, the plant's loop in the main thread.

    python -m heptarm.virtual.cabinet --model iiwa14 --port 30001

Prints one JSON line when clients may connect. It ends on SIGTERM, on SIGINT, and with --parent-pipe when its
standard input is closed, which happens however its parent ends.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from heptarm.fri.version import Version
from heptarm.virtual import processdata, templates
from heptarm.virtual.fri.sessions import Sessions
from heptarm.virtual.operator import Operator, timed
from heptarm.virtual.pacer import ROOM, Pacer, courteous
from heptarm.virtual.payload import hanging
from heptarm.virtual.plant import Plant
from heptarm.virtual.world import Box

log = logging.getLogger("heptarm.virtual")

#: Java threads that get a real-time priority below the loop's where that is allowed, by the start of their names.
REAL_TIME_THREADS = ("ha-sampler", "ha-writer", "ha-watchdog")
REAL_TIME_PRIORITY = 10

_PORT_PROPERTY = "heptarm.port.bound"
_START_TIMEOUT = 20.0
_HOUSEKEEPING = 0.1


def arguments(argv: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m heptarm.virtual.cabinet", description="A virtual KUKA cabinet."
    )
    parser.add_argument("--model", default="iiwa14", help="iiwa7 or iiwa14")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=int, default=30001, help="0: any free port")
    parser.add_argument(
        "--speed", type=float, default=1.0, help="simulated seconds per second; 0: as fast as it goes"
    )
    parser.add_argument("--key", default="", help="pre-shared key")
    parser.add_argument("--application", default="", help="class of another application; ends with it")
    parser.add_argument(
        "--background", action="append", default=[], help="class of a background task of that application"
    )
    parser.add_argument("--classpath", action="append", default=[], help="folder or jar with its classes")
    parser.add_argument(
        "--fri-version", default="1.15", help="release of the cabinet's FRI, such as 1.11 or 2.5"
    )
    parser.add_argument(
        "--project", type=Path, help="RoboticsAPI.data.xml with process data, templates and frames"
    )
    parser.add_argument(
        "--box",
        action="append",
        default=[],
        metavar="X,Y,Z,LENGTH,WIDTH,HEIGHT",
        help="a box that stands around the arm [m]",
    )
    parser.add_argument(
        "--payload",
        metavar="MASS[,X,Y,Z]",
        help="what hangs on the flange, whatever the controller is told [kg, m]",
    )
    parser.add_argument("--data", action="append", default=[], metavar="NAME=VALUE", help="process data")
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="NAME@SECONDS",
        help="let something go wrong at a simulated time, such as emergency_stop@5; may be given again",
    )
    parser.add_argument(
        "--stats", type=Path, help="write the loop's statistics here at the end and on SIGUSR1"
    )
    parser.add_argument(
        "--parent-pipe",
        action="store_true",
        help="end when standard input is closed; its lines are what the operator does",
    )
    parser.add_argument("--verbose", action="store_true", help="log to standard error")
    return parser.parse_args(argv)


def process_data(options: argparse.Namespace) -> dict[str, processdata.Value]:
    """Process data: the project's, then what the command line says; a value keeps the type that the project gives it.

    Raises:
        ValueError: a value does not fit its type, or the file is none.
    """
    data: dict[str, processdata.Value] = {"heptarm.max_rate": 1000.0, "heptarm.key": ""}
    if options.project is not None:
        data |= processdata.read(options.project)
    data |= {"heptarm.bind": options.host, "heptarm.port": options.port}
    if options.key:
        data["heptarm.key"] = options.key
    for pair in options.data:
        name, equals, text = pair.partition("=")
        if not equals:
            raise ValueError(f"--data {pair}: NAME=VALUE is expected")
        data[name] = processdata.like(data.get(name), text)
    return data


class VirtualCabinet:
    """Plant, JVM and application of one process."""

    def __init__(self, options: argparse.Namespace, data: dict[str, processdata.Value]) -> None:
        # the JVM is started by the main thread before anything else wakes up
        from heptarm.virtual import jvm, station

        self._options = options
        self.plant = Plant(options.model, boxes=[Box.of(text) for text in options.box])
        self.sessions = Sessions(self.plant, version=Version.of(options.fri_version), speed=options.speed)
        self.operator = Operator(self.plant)
        for fault in options.fault:
            self.operator.schedule(fault)
        self.pacer = Pacer(self.plant.ring, self.tick, speed=options.speed)
        jvm.start(options.classpath)
        import jpype

        self._system = jpype.JClass("java.lang.System")
        if not options.verbose:
            jpype.JClass("java.util.logging.LogManager").getLogManager().reset()
        self._station = station.open_station(self.plant, self.sessions)
        for name, value in data.items():
            self._station.setProcessData(name, station.boxed(value))
        if options.project is not None:
            station.furnish(self._station, templates.read(options.project))
        if options.payload is not None:
            self.plant.hang(hanging(options.payload))
        pad = jpype.JClass("heptarm.doubles.Desk")
        self.operator.answer = lambda button: bool(pad.current().pad.dialogs.press(button))
        self.operator.press = lambda bar, slot: bool(pad.current().pad.press(bar, slot))
        self.host = jpype.JClass("heptarm.doubles.Host")(options.application or jvm.APPLICATION)

    def start(self) -> None:
        """Start the background tasks that want it, then the application."""
        for name in self._options.background:
            self._station.tasks.autoStart(name)
        self.host.start()

    def stop(self) -> None:
        """Deselect the application, then end what runs beside it."""
        self.host.stop()
        self._station.tasks.stopBackground()

    def tick(self) -> None:
        """One millisecond of operator, FRI and plant."""
        self.operator.tick()
        self.sessions.tick()
        self.pacer.room = ROOM if self.sessions.any else 0.0
        self.plant.tick()

    @property
    def foreign(self) -> bool:
        """Whether another application than heptarm's runs."""
        return bool(self._options.application)

    def port(self) -> int:
        """The port that the application has opened.

        Raises:
            RuntimeError: the application ended instead.
        """
        deadline = time.monotonic() + _START_TIMEOUT
        while time.monotonic() < deadline:
            bound = self._system.getProperty(_PORT_PROPERTY)
            if bound is not None:
                return int(str(bound))
            if not self.host.isAlive():
                break
            time.sleep(0.002)
        raise RuntimeError(
            f"the cabinet application did not start: {self.host.failure() or 'it gives no reason'}"
        )

    def write_stats(self) -> None:
        """Write the loop's statistics to the file that was asked for."""
        if self._options.stats is not None:
            text = json.dumps(asdict(self.pacer.report))
            partial = self._options.stats.with_suffix(".part")
            partial.write_text(text, encoding="utf-8")
            partial.replace(self._options.stats)


def _promote() -> None:
    """Give the application's threads their priority; new ones appear with every client."""
    for task in Path("/proc/self/task").iterdir():
        try:
            if (task / "comm").read_text().startswith(REAL_TIME_THREADS):
                number = int(task.name)
                if os.sched_getscheduler(number) == os.SCHED_OTHER:
                    os.sched_setscheduler(number, os.SCHED_FIFO, os.sched_param(REAL_TIME_PRIORITY))
        except (OSError, ProcessLookupError):
            continue  # the thread has ended, or the priority is refused; the report says the latter


def _housekeeping(stop: threading.Event) -> None:
    while not stop.wait(_HOUSEKEEPING):
        _promote()


def _when_orphaned(operator: Operator, end: Callable[[], None]) -> None:
    """Do what standard input says until it ends: then the parent is gone or wants us to end."""
    rest = b""
    while True:
        try:
            octets = os.read(0, 4096)
        except OSError:
            break
        if not octets:
            break
        *lines, rest = (rest + octets).split(b"\n")
        for line in lines:
            _obey(operator, line.decode("utf-8", "replace").strip())
    end()


def _obey(operator: Operator, words: str) -> None:
    """Do something in words, and say on standard output whether that was understood."""
    try:
        if words:
            operator.do(words)
        error = ""
    except ValueError as refused:
        error = str(refused)
    print(json.dumps({"operator": words, "error": error}), flush=True)


def _announce(cabinet: VirtualCabinet, stopping: threading.Event, failed: list[str]) -> None:
    if cabinet.foreign:
        _accompany(cabinet, stopping, failed)
        return
    try:
        port = cabinet.port()
    except RuntimeError as error:
        failed.append(str(error))
        cabinet.pacer.stop()
        return
    options = cabinet._options
    ready = {"ready": True, "host": options.host, "port": port, "pid": os.getpid(), "model": options.model}
    print(json.dumps(ready), flush=True)
    _housekeeping(stopping)


def _accompany(cabinet: VirtualCabinet, stopping: threading.Event, failed: list[str]) -> None:
    """Run for as long as somebody else's application does."""
    while cabinet.host.isAlive():
        time.sleep(0.01)
    failure = cabinet.host.failure()
    # an application that we end ourselves may well end by the exception of its interruption
    if failure is not None and not stopping.is_set():
        failed.append(str(failure))
    cabinet.pacer.stop()


def main(argv: list[str] | None = None) -> int:
    """Run a virtual cabinet until it is told to end."""
    options = arguments(argv)
    logging.basicConfig(level=logging.INFO if options.verbose else logging.WARNING, stream=sys.stderr)
    try:
        data = process_data(options)
        for fault in options.fault:
            timed(fault)
        for text in options.box:
            Box.of(text)
        if options.payload is not None:
            hanging(options.payload)
        if options.project is not None:
            templates.read(options.project)
    except (ValueError, OSError) as error:
        print(json.dumps({"ready": False, "error": str(error)}), flush=True)
        return 2
    with courteous():
        cabinet = VirtualCabinet(options, data)
    stopping = threading.Event()
    failed: list[str] = []

    def end(*_: Any) -> None:
        stopping.set()
        cabinet.pacer.stop()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    if hasattr(signal, "SIGUSR1"):
        signal.signal(signal.SIGUSR1, lambda *_: cabinet.write_stats())
    if options.parent_pipe:
        threading.Thread(target=_when_orphaned, args=(cabinet.operator, end), daemon=True).start()
    announcer = threading.Thread(target=_announce, args=(cabinet, stopping, failed), daemon=True)
    with courteous():
        cabinet.start()
    announcer.start()
    cabinet.pacer.run()
    stopping.set()
    _end(cabinet)
    if failed:
        print(json.dumps({"ready": False, "error": failed[0]}), flush=True)
    # the JVM's shutdown may wait for threads of its own; everything is closed, so leave at once
    sys.stdout.flush()
    os._exit(1 if failed else 0)


def _end(cabinet: VirtualCabinet) -> None:
    """Deselect the application while the plant goes on ticking, so that the arm comes to rest."""
    done = threading.Event()

    def stop() -> None:
        cabinet.stop()
        done.set()

    threading.Thread(target=stop, daemon=True).start()
    while not done.is_set():
        cabinet.tick()
        time.sleep(0.0005)
    cabinet.write_stats()


if __name__ == "__main__":
    sys.exit(main())
