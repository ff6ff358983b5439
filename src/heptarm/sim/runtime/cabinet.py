"""The virtual cabinet as a process: plant and JVM together, the realtime loop in the main thread.

    python -m heptarm.sim.runtime.cabinet --model iiwa14 --port 30001

Prints one JSON line when clients may connect. It ends on SIGTERM, on SIGINT, and with --parent-pipe when its
standard input is closed, which also happens when its parent is killed.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import json
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, cast, get_args, get_type_hints

from heptarm._resources import cabinet_sources
from heptarm.errors import HeptarmError, without_java
from heptarm.fri.protocol.version import Version
from heptarm.io.keys import find_key
from heptarm.sim.fri.sessions import Sessions
from heptarm.sim.plant.payload import parse_payload
from heptarm.sim.plant.plant import Plant, fitted_arm
from heptarm.sim.plant.safety_monitor import parse_safety
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.sensor_errors import parse_sensors, sensor_errors
from heptarm.sim.plant.shared_state import PositionsFile, Trace
from heptarm.sim.plant.world import Box, compiled
from heptarm.sim.runtime import project
from heptarm.sim.runtime.addresses import AddressMap
from heptarm.sim.runtime.application import PROJECT
from heptarm.sim.runtime.operator import LONGEST_WAIT, SimulatedOperator, timed
from heptarm.sim.runtime.realtime_loop import (
    ANSWER_GAP,
    AT_ONCE,
    RealtimeLoop,
    batch_scheduled,
    share_memory_pools,
)
from heptarm.sim.runtime.rest import Rest
from heptarm.sim.runtime.station import simulated_robot
from heptarm.values.robot import RobotModel
from heptarm.values.simulator_options import RealTime, SimulatorOptions, flag

log = logging.getLogger("heptarm.sim")

#: Java threads that get a real-time priority below the loop's where that is allowed: beginnings of their names, and the
#: priorities. The watchdog wakes with the sampler every few states, and would delay each of these. While the JVM's own
#: thread collects garbage, all others wait for it.
REAL_TIME_THREADS = {"VM Thread": 12, "ha-sampler": 11, "ha-writer": 10, "ha-watchdog": 10}

_PORT_PROPERTY = "heptarm.port.bound"
_START_TIMEOUT = 20.0
_EXITED = (
    "the application called System.exit, which would end the whole JVM of a cabinet: let run() return instead"
)
#: Time between two looks at the number of threads [s].
_HOUSEKEEPING = 0.5
#: Held while an action of the operator is executed and reported.
_OPERATING = threading.Lock()
#: So often a thread's name is read: it may have none yet at first.
_LOOKS = 3
#: Every so often threads are looked for though their number is the same.
_SELDOM = 10
#: Ticks between two updates of the file of positions.
_POSITIONS_EVERY = 30


def arguments(argv: list[str] | None = None) -> SimulatorOptions:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m heptarm.sim.runtime.cabinet", description="A virtual KUKA cabinet."
    )
    types = get_type_hints(SimulatorOptions)
    for field in fields(SimulatorOptions):
        kind, how = types[field.name], {"help": field.metadata["help"]}
        if kind is bool:
            parser.add_argument(flag(field.name), action="store_true", **how)
            continue
        if field.metadata["metavar"]:
            how["metavar"] = field.metadata["metavar"]
        if isinstance(field.default, tuple):
            part: Any = get_args(kind)[0]
            parser.add_argument(flag(field.name), action="append", default=[], type=part, **how)
        else:
            parser.add_argument(
                flag(field.name), type=Path if field.default is None else kind, default=field.default, **how
            )
    found: dict[str, Any] = vars(parser.parse_args(argv))
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in found.items()}
    return SimulatorOptions(**values)


def process_data(options: SimulatorOptions) -> dict[str, project.Value]:
    """Process data as `heptarm install-cabinet` writes them, overridden by the project and by the command line.

    A value keeps its type in the project.

    Raises:
        ValueError: a value does not fit its type, the file is not a project file, or the key cannot be used.
    """
    data = project.read_process_data(cabinet_sources() / "project" / PROJECT).values
    if options.project is not None:
        addresses = AddressMap.of(options.map)
        for name, value in project.read_process_data(options.project).values.items():
            data[name] = addresses.apply(value) if isinstance(value, str) else value
    data |= {"heptarm.bind": options.host, "heptarm.port": options.port}
    if options.observed:
        data |= {"heptarm.reserved_for": options.application.rpartition(".")[2], "heptarm.verbosity": 0}
    if key := find_key(key_file=options.key_file):
        data["heptarm.key"] = key
    for pair in options.data:
        name, equals, text = pair.partition("=")
        if not equals:
            raise ValueError(f"--data must be NAME=VALUE, got {pair!r}")
        data[name] = project.like(data.get(name), text)
    return data


class VirtualCabinet:
    """Plant, JVM and application of one process.

    Args:
        options: of the process.
        data: process data of the application.
        robot: that is simulated.
        notes: what of the robot contradicts the project; reported with the readiness.
    """

    def __init__(
        self,
        options: SimulatorOptions,
        data: dict[str, project.Value],
        robot: RobotModel,
        notes: tuple[str, ...] = (),
    ) -> None:
        # the main thread starts the JVM before there are other threads
        from heptarm.sim.runtime import java_plant, jvm

        self.options, self.notes = options, notes
        fitted = fitted_arm(options.fitted, robot)
        self.plant = Plant(
            robot.name,
            boxes=[Box.of(text) for text in options.box],
            scene=Scene.of(options.scene) if options.scene else None,
            monitored=options.drive_monitoring == "on",
            errors=sensor_errors(robot, options.sensors, fitted),
            limits=parse_safety(options.safety),
            fitted=fitted,
        )
        self.sessions = Sessions(
            self.plant,
            version=Version.of(options.fri_version),
            speed=options.speed,
            address=AddressMap.of(options.map).apply,
        )
        self.operator = SimulatedOperator(self.plant)
        for fault in options.fault:
            self.operator.schedule(fault)
        jvm.start(options.classpath, foreign=self.is_foreign, optimised=options.real_time == "on")
        import jpype

        self._system = jpype.JClass("java.lang.System")
        if not options.verbose and not self.is_foreign:
            jpype.JClass("java.util.logging.LogManager").getLogManager().reset()
        self._java_memory = java_plant.java_memory
        self._trace = None if options.trace is None else Trace(self.plant.shared, options.trace)
        self._positions = (
            None if options.positions is None else PositionsFile(options.positions, len(self.plant.data.qpos))
        )
        # trace and positions are of each tick
        is_recorded = self._trace is not None or self._positions is not None
        self._station = java_plant.open_station(self.plant, self.sessions)
        rest = Rest(self.plant, self.sessions, self.operator, self._station.timers)
        self.loop = RealtimeLoop(
            self.plant.shared,
            self.tick,
            speed=options.speed,
            real_time=real_time_of(options),
            rest=None if self._trace is not None else rest,  # a trace has the state of each tick
            at_once=1 if is_recorded else AT_ONCE,
        )
        for name, value in data.items():
            self._station.setProcessData(name, java_plant.boxed(value))
        if options.project is not None:
            java_plant.add_project(self._station, project.read_project(options.project))
            for name, why in project.read_process_data(options.project).unusable.items():
                if name not in data:
                    self._station.setUnusable(name, why)
        if options.payload:
            self.plant.set_payload(parse_payload(options.payload))
        for button in options.answer:
            self._station.pad.dialogs.script(button)
        pad = jpype.JClass("heptarm.doubles.runtime.ApplicationServices")
        self.operator.answer = lambda button: bool(pad.current().pad.dialogs.press(button))
        self.operator.press = lambda bar, slot: bool(pad.current().pad.press(bar, slot))
        self.operator.keys = lambda: str(pad.current().pad.keys())
        runner = jpype.JClass("heptarm.doubles.runtime.TaskRunner")
        self.host = runner(options.application or jvm.APPLICATION)
        self._server = self.host  # has the port for clients
        if self.is_foreign:
            self._server = runner.beside(jvm.APPLICATION) if options.observed else None
            jpype.JClass("heptarm.doubles.runtime.ExitGuard").install(_failure(_EXITED))

    def start(self) -> None:
        """Start what serves observers and the background tasks that start automatically, then the application."""
        if self.is_observed:
            self._server.start()
        for name in self.options.background:
            self._station.tasks.autoStart(name)
        self.host.start()

    def stop(self) -> None:
        """Deselect the application, then stop the background tasks and what serves observers."""
        self.host.stop()
        self._station.tasks.stopBackground()
        if self.is_observed:
            self._server.stop()

    def tick(self) -> None:
        """Advance operator, FRI and plant by one millisecond; by those that are due where that is the same."""
        self.operator.tick()
        self.sessions.tick()
        is_any_open = self.sessions.is_any_open
        self.loop.answer_gap = ANSWER_GAP if is_any_open else 0.0
        most = 1
        if self.loop.allowed > 1 and not is_any_open:
            most = min(self.loop.allowed, self.operator.next_due - self.plant.tick_count)
        self.plant.tick(most)
        if self._trace is not None:
            self._trace.append()
        if self._positions is not None and self.plant.tick_count % _POSITIONS_EVERY == 0:
            self._positions.write(self.plant.data.qpos)

    @property
    def is_foreign(self) -> bool:
        """Whether another application than heptarm's runs."""
        return bool(self.options.application)

    @property
    def is_observed(self) -> bool:
        """Whether clients may observe another application."""
        return self.is_foreign and self._server is not None

    def ready(self) -> dict[str, Any]:
        """What the line reports that announces that it is ready."""
        robot = self.plant.robot
        return {"ready": True, "pid": os.getpid(), "model": robot.name, "notes": self.notes}

    def port(self) -> int:
        """The port that heptarm's application has opened, for clients or for observers.

        Raises:
            RuntimeError: the application ended before.
        """
        deadline = time.monotonic() + _START_TIMEOUT
        while time.monotonic() < deadline:
            bound = self._system.getProperty(_PORT_PROPERTY)
            if bound is not None:
                return int(str(bound))
            if not self._server.isAlive():
                break
            time.sleep(0.002)
        failure = str(self._server.failure() or "no reason given")
        if "Address already in use" in failure:
            failure = f"port {self.options.port} is in use by another program"
        raise RuntimeError(
            f"the cabinet application did not start: {without_java(failure) or 'no reason given'}"
        )

    def close(self) -> None:
        """Write the statistics for the last time, and what is left of the trace."""
        self.write_stats()
        if self._trace is not None:
            self._trace.close()

    def write_stats(self) -> None:
        """Write statistics of the realtime loop and of memory to the file of the option `stats`."""
        if self.options.stats is not None:
            java, objects = self._java_memory(), gc.get_objects()
            counts = {"objects": len(objects), "types": sum(isinstance(entry, type) for entry in objects)}
            text = json.dumps(asdict(self.loop.statistics) | {"memory": counts | java})
            partial = self.options.stats.with_suffix(".part")
            partial.write_text(text, encoding="utf-8")
            partial.replace(self.options.stats)


def real_time_of(options: SimulatorOptions) -> RealTime:
    """When the loop asks for real-time priority.

    Raises:
        ValueError: the option has another value.
    """
    for known in get_args(RealTime):
        if options.real_time == known:
            return cast(RealTime, known)
    raise ValueError(f"real_time must be one of {', '.join(get_args(RealTime))}, got {options.real_time!r}")


class _Priorities:
    """Priorities of the application's threads: real-time ones while the loop has one."""

    def __init__(self, loop: RealtimeLoop) -> None:
        self._loop = loop
        self._promoted: dict[int, int] = {}  # and the policies that they had
        self._looks: dict[str, int] = {}
        self._threads = self._left = self._updates = 0

    def update(self) -> None:
        """Promote new threads, every client adds some; or demote those that were promoted."""
        if sys.platform == "linux" and self._loop.is_real_time:
            if not self._is_due():
                return
            looks = {task: self._looks.get(task, 0) + 1 for task in os.listdir("/proc/self/task")}
            for task in [task for task, count in looks.items() if count <= _LOOKS]:
                with contextlib.suppress(OSError):  # it has ended, or is refused, which the statistics report
                    name = Path(f"/proc/self/task/{task}/comm").read_text()
                    for begin, priority in REAL_TIME_THREADS.items():
                        if name.startswith(begin):
                            self._promote(int(task), priority)
            self._looks = looks
        elif self._promoted:
            self._looks, self._threads = {}, 0
            for number, policy in self._promoted.items():
                with contextlib.suppress(OSError):  # it has ended
                    os.sched_setscheduler(number, policy, os.sched_param(0))
            self._promoted = {}

    def _is_due(self) -> bool:
        """Whether to look for new threads: to list them takes 0.2 ms, in which a state would be late."""
        threads = os.stat("/proc/self/task").st_nlink  # changes with their number
        if threads != self._threads:
            self._threads, self._left = threads, _LOOKS
        self._updates += 1
        self._left -= 1
        return self._left >= 0 or self._updates % _SELDOM == 0  # one may have ended when another began

    def _promote(self, number: int, priority: int) -> None:
        policy = os.sched_getscheduler(number)
        if policy != os.SCHED_FIFO:
            os.sched_setscheduler(number, os.SCHED_FIFO, os.sched_param(priority))
            self._promoted[number] = policy


def _housekeeping(loop: RealtimeLoop, stop: threading.Event) -> None:
    priorities = _Priorities(loop)
    while not stop.wait(_HOUSEKEEPING):
        priorities.update()


def _read_standard_input(operator: SimulatedOperator, end: Callable[[], None]) -> None:
    """Execute operator actions from standard input until it is closed: then the parent has ended."""
    rest = b""
    while True:
        try:
            data = os.read(0, 4096)
        except OSError:
            break
        if not data:
            break
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            _operate(operator, line.decode("utf-8", "replace").strip())
    end()


def _operate(operator: SimulatedOperator, words: str) -> None:
    """Execute an operator action and report on standard output whether it was accepted, and what it shows."""
    shown = error = ""
    with _OPERATING:
        try:
            if words:
                shown = operator.do(words)
                operator.await_tick()
        except ValueError as refused:
            error = str(refused)
        print(json.dumps({"operator": words, "error": error, "shown": shown}), flush=True)


def _announce(cabinet: VirtualCabinet, stopping: threading.Event, failed: list[str]) -> None:
    if cabinet.is_foreign:
        _wait_for_application(cabinet, stopping, failed)
        return
    try:
        port = cabinet.port()
    except RuntimeError as error:
        failed.append(str(error))
        cabinet.loop.stop()
        return
    print(json.dumps(cabinet.ready() | {"host": cabinet.options.host, "port": port}), flush=True)
    _housekeeping(cabinet.loop, stopping)


def _wait_for_application(cabinet: VirtualCabinet, stopping: threading.Event, failed: list[str]) -> None:
    """Run until the foreign application ends."""
    ready = cabinet.ready()
    if cabinet.is_observed:
        try:
            ready["port"] = cabinet.port()
        except RuntimeError as error:
            failed.append(str(error))
            cabinet.loop.stop()
            return
    print(json.dumps(ready), flush=True)
    while cabinet.host.isAlive():
        time.sleep(0.01)
    failure = cabinet.host.failure()
    # an application that is ended here may end by an exception of its interruption
    if failure is not None and not stopping.is_set():
        failed.append(str(failure))
    cabinet.loop.stop()


def main(argv: list[str] | None = None) -> int:
    """Run a virtual cabinet until a signal or its parent ends it."""
    options = arguments(argv)
    logging.basicConfig(level=logging.INFO if options.verbose else logging.WARNING, stream=sys.stderr)
    try:
        arm, notes = simulated_robot(options)
        data = process_data(options)
        for fault in options.fault:
            timed(fault)
        for text in options.box:
            Box.of(text)
        if options.scene:
            compiled(arm.name, (), Scene.of(options.scene))
        if options.payload:
            parse_payload(options.payload)
        if options.drive_monitoring not in ("on", "off"):
            raise ValueError(f"drive_monitoring must be on or off, got {options.drive_monitoring!r}")
        parse_sensors(options.sensors)
        fitted_arm(options.fitted, arm)
        parse_safety(options.safety)
        real_time_of(options)
        if options.project is not None:
            project.read_project(options.project)
    except (ValueError, OSError) as error:  # a CommandRejected is a ValueError
        print(json.dumps({"ready": False, "error": str(error), "options": True}), flush=True)
        return 2
    share_memory_pools()
    try:
        with batch_scheduled():
            cabinet = VirtualCabinet(options, data, arm, notes)
    except Exception as error:  # of the JVM, of a jar, of the machine: the parent prints it
        log.debug("the virtual cabinet does not start", exc_info=True)
        print(json.dumps({"ready": False, "error": _described(error), "host": True}), flush=True)
        os._exit(2)  # a JVM that has started may wait for its own threads
    stopping = threading.Event()
    failed: list[str] = []

    def end(*_: Any) -> None:
        stopping.set()
        cabinet.loop.stop()

    for number in (signal.SIGTERM, signal.SIGINT):
        if signal.getsignal(number) is not signal.SIG_IGN:  # a shell's background job ignores Ctrl-C
            signal.signal(number, end)
    if hasattr(signal, "SIGUSR1"):
        signal.signal(signal.SIGUSR1, lambda *_: cabinet.write_stats())
    if options.parent_pipe:
        threading.Thread(target=_read_standard_input, args=(cabinet.operator, end), daemon=True).start()
    announcer = threading.Thread(target=_announce, args=(cabinet, stopping, failed), daemon=True)
    try:
        with batch_scheduled():
            cabinet.start()
        announcer.start()
        cabinet.loop.run()
        stopping.set()
        _end(cabinet)
    except Exception as error:  # an error of the simulator itself
        log.debug("the virtual cabinet has failed", exc_info=True)
        stopping.set()
        failed.insert(0, f"the virtual cabinet has failed: {_described(error)}")
    _OPERATING.acquire(
        timeout=2 * LONGEST_WAIT
    )  # an action may have ended the application: it is reported first
    if failed:
        print(_failure(failed[0]), flush=True)
    # the JVM's shutdown may wait for its own threads; everything is closed, so exit at once
    sys.stdout.flush()
    os._exit(1 if failed else 0)


def _failure(error: str) -> str:
    """The line that reports why the process ends."""
    return json.dumps({"ready": False, "error": error})


def _described(error: Exception) -> str:
    """An error of the host in one line."""
    text = " ".join(str(error).split())
    # an exception of Java names its class itself
    if text.startswith(type(error).__name__) and (said := without_java(text)):
        return said
    return text if isinstance(error, HeptarmError) else f"{type(error).__name__}: {text}"


def _end(cabinet: VirtualCabinet) -> None:
    """Deselect the application while the plant continues to tick, so that the arm comes to rest."""
    done = threading.Event()

    def stop() -> None:
        cabinet.stop()
        done.set()

    threading.Thread(target=stop, daemon=True).start()
    while not done.is_set():
        cabinet.tick()
        time.sleep(0.0005)
    cabinet.close()


if __name__ == "__main__":
    sys.exit(main())
