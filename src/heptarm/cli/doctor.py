"""`heptarm doctor`: one verdict and one remedy a line."""

from __future__ import annotations

import importlib.util
import os
import platform
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from heptarm import __version__, _resources
from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.target import VARIABLE, parse_target
from heptarm.cli.output import emit
from heptarm.errors import HeptarmError
from heptarm.wire.messages import MAJOR, MINOR, PORT

_REQUESTS = 200
_SLOW_US = 2000.0
_OLD_MS = 20.0


@dataclass(frozen=True, slots=True)
class Look:
    """How to look at FRI.

    Attributes:
        listens: wait for the messages of whatever application runs on the cabinet, instead of opening a session.
        port: own UDP port; None: the first free one of FRI's, 30200 for one who listens.
        period_ms: of a session that is opened.
        version: FRI release that the cabinet should speak; None: any.
        seconds: how long to look [s].
    """

    listens: bool
    port: int | None
    period_ms: int
    version: str | None
    seconds: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """What was looked at, how it is ("ok", "note" or "bad"), and what to do."""

    what: str
    how: str
    found: str
    remedy: str = ""


def run(*, target: str | None, as_json: bool, fri: Look | None = None) -> int:
    """Look at everything, with `fri` also at FRI; the exit code is 1 if something is bad."""
    target = target or os.environ.get(VARIABLE, "").strip() or None
    verdicts = [check() for check in (_python, _extras, _java, _jars, _priority)]
    if target is None or (fri is not None and fri.listens):
        verdicts.append(_port())
    else:
        verdicts += _target(target)
    if fri is not None:
        from heptarm.cli.fri_doctor import look

        verdicts += look(fri, target=None if fri.listens else target)
    if as_json:
        for verdict in verdicts:
            emit(asdict(verdict))
    else:
        Console().print(_table(verdicts))
    return 1 if any(verdict.how == "bad" for verdict in verdicts) else 0


def _table(verdicts: list[Verdict]) -> Table:
    style = {"ok": "[green]ok[/]", "note": "[yellow]note[/]", "bad": "[red]bad[/]"}
    table = Table(
        title=f"heptarm {__version__}, protocol {MAJOR}.{MINOR}",
        title_justify="left",
        box=None,
        pad_edge=False,
    )
    for name in ("", "what", "found", "what to do"):
        table.add_column(name, overflow="fold")
    for verdict in verdicts:
        table.add_row(style[verdict.how], verdict.what, verdict.found, verdict.remedy)
    return table


def _python() -> Verdict:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}, numpy {np.__version__}"
    return Verdict("Python", "ok", found)


def _extras() -> Verdict:
    needed = {"sim": ("mujoco", "ruckig", "jpype"), "viz": ("viser", "matplotlib")}
    missing = [
        extra
        for extra, modules in needed.items()
        if any(importlib.util.find_spec(m) is None for m in modules)
    ]
    if missing:
        return Verdict(
            "extras",
            "note",
            f"not installed: {', '.join(missing)}",
            f"pip install 'heptarm[{','.join(missing)}]'",
        )
    return Verdict("extras", "ok", "sim and viz are installed")


def _java() -> Verdict:
    try:
        from heptarm.virtual import jvm

        return Verdict("Java", "ok", jvm.library())
    except ImportError as error:
        return Verdict(
            "Java", "note", str(error), "only the virtual cabinet needs it: pip install 'heptarm[sim]'"
        )


def _jars() -> Verdict:
    try:
        return Verdict("cabinet", "ok", f"compiled, {len(_resources.jars())} jars")
    except HeptarmError as error:
        return Verdict("cabinet", "note", error.text, error.hint)


def _priority() -> Verdict:
    try:
        before = os.sched_getscheduler(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, before, os.sched_param(0))
    except (OSError, AttributeError) as error:
        remedy = "add 'USER - rtprio 60' to /etc/security/limits.conf and log in again"
        return Verdict(
            "real time", "note", f"no real-time priority ({error}); loops may be late under load", remedy
        )
    return Verdict("real time", "ok", "real-time priority is allowed")


def _port() -> Verdict:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", PORT))
        except OSError:
            return Verdict(
                "port",
                "note",
                f"{PORT} is taken here",
                f"heptarm doctor --target sim://127.0.0.1:{PORT} looks at who has it",
            )
    return Verdict("port", "ok", f"{PORT} is free for heptarm sim")


def _target(target: str) -> Iterator[Verdict]:
    parsed = parse_target(target)
    if not parsed.is_private:
        try:
            socket.create_connection((parsed.host, parsed.port), timeout=3).close()
            yield Verdict("network", "ok", f"{parsed.host}:{parsed.port} accepts connections")
        except OSError as error:
            remedy = "is the cabinet application (or heptarm sim) running? is this machine in its network?"
            yield Verdict("network", "bad", f"{parsed.host}:{parsed.port} does not answer ({error})", remedy)
            return
    try:
        arm = connect(target, control=False)
    except HeptarmError as error:
        yield Verdict("session", "bad", error.text, error.hint)
        return
    with arm:
        yield Verdict(
            "session",
            "ok",
            f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}, cabinet application {arm.software}",
        )
        yield _round_trip(arm)
        yield _age(arm)
        yield _safety(arm)


def _timed(call: Callable[[], object]) -> float:
    begin = time.perf_counter_ns()
    call()
    return (time.perf_counter_ns() - begin) / 1e3


def _round_trip(arm: Arm) -> Verdict:
    times = [_timed(lambda: arm.subscribe(rate=100.0)) for _ in range(_REQUESTS)]
    median, late = np.percentile(times, [50, 99])
    found = f"{median:.0f} us median, {late:.0f} us 99 %"
    if median > _SLOW_US:
        return Verdict(
            "round trip", "note", found, "use a cable and a direct connection; look for load on both machines"
        )
    return Verdict("round trip", "ok", found)


def _age(arm: Arm) -> Verdict:
    ages = [state.age * 1e3 for state in arm.states(duration=1.0)]
    if not ages:
        return Verdict("state", "bad", "no state came within a second", "look at the cabinet's log")
    found = f"{len(ages)} states in 1 s, {np.median(ages):.2f} ms old, 99 % below {np.percentile(ages, 99):.2f} ms"
    how = "note" if np.median(ages) > _OLD_MS else "ok"
    return Verdict("state", how, found, "subscribe at a lower rate" if how == "note" else "")


def _safety(arm: Arm) -> Verdict:
    safety = arm.state.safety
    found = f"{safety.mode.value.upper()}, {'ready' if safety.ready_to_move else 'not ready'} to move"
    if safety.ready_to_move:
        return Verdict("safety", "ok", found)
    remedy = (
        "release the emergency stop"
        if safety.emergency_stop
        else "acknowledge the messages on the smartPAD and press Start"
    )
    return Verdict("safety", "note", found, remedy)
