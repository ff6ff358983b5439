"""`heptarm doctor`: the installation, a target, and FRI: one verdict and one remedy per line."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import platform
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from rich.console import Console
from rich.table import Table
from rich.text import Text

from heptarm import __version__, _resources
from heptarm.arm.arm import Arm
from heptarm.arm.fri.diagnosis import cause, silence, strangers
from heptarm.arm.fri.settings import PORTS
from heptarm.arm.link.target import parse_target
from heptarm.cli.options import (
    FRI,
    NO_TARGET,
    CommandTarget,
    FriListen,
    FriPeriod,
    FriPort,
    FriVersion,
    Json,
)
from heptarm.cli.output import emit
from heptarm.errors import EXTRAS, CommandRejected, ConnectFailed, HeptarmError, Timeout
from heptarm.fri.loop.client import Client
from heptarm.fri.protocol.messages import CommandMode, Quality, SessionState
from heptarm.fri.session.events import Event, Kind
from heptarm.io.udp import UdpSocket
from heptarm.values.text import printable
from heptarm.wire.messages import MAJOR, MINOR, PORT

_REQUESTS = 200
_SLOW_US = 2000.0
_OLD_MS = 20.0
#: Fraction of the pings by datagram that a good network answers.
_ANSWERED = 0.98
#: A larger fraction of lost messages or answers is reported.
_LOST_FRACTION = 0.001
_LONGEST = 3600.0
#: Addresses that mean every interface.
_ALL = ("0.0.0.0", "::")
_KINDS = ("position", "torque", "wrench", "pose")
_VERSION = (
    "leave --fri-version (version= in a program) out: heptarm takes it from the first message; a client that is built "
    "with KUKA's SDK has to be built for the cabinet's version"
)
_SITE = "https://github.com/heptarm/heptarm/blob/main/docs"
#: Pages that explain a check, in the order of the checks: from what one needs to the first motion.
_PAGES = {
    "Python": "guide/real-robot/what-you-need.md",
    "extras": "guide/real-robot/what-you-need.md",
    "Java": "guide/virtual-cabinet.md",
    "cabinet": "guide/virtual-cabinet.md",
    "real time": "guide/fri.md",
    "port": "guide/virtual-cabinet.md",
    "network": "guide/real-robot/network.md",
    "session": "guide/real-robot/project.md",
    "options": "guide/real-robot/what-you-need.md#options-of-sunrise",
    "protection": "guide/security.md",
    "round trip": "guide/real-robot/network.md",
    "state": "guide/state.md",
    "datagrams": "guide/connect.md",
    "safety": "guide/real-robot/safety-configuration.md",
}
#: What an option of Sunrise adds, by the capability that the cabinet reports.
_OPTIONS = {
    "servo": "servo motions (Sunrise.Servoing)",
    "servo_lin": "straight servo motions",
    "fri": "FRI (Sunrise.FRI)",
    "hand_guide": "hand guiding",
}
_UNKNOWN = "read the messages on the smartPAD and the log of the cabinet application"


@dataclass(frozen=True, slots=True)
class Look:
    """How to check FRI.

    Attributes:
        listens: wait for the messages of any application on the cabinet, instead of opening a session.
        port: own UDP port; None: the first free one of FRI's, 30200 for a listener.
        period_ms: of a session that is opened.
        version: FRI release that the cabinet should speak; None: any.
        seconds: how long to check [s].
    """

    listens: bool
    port: int | None
    period_ms: int
    version: str | None
    seconds: float


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The outcome of one check: what, how it is ("ok", "note" or "bad"), what was found, and what to do."""

    what: str
    how: str
    found: str
    remedy: str = ""

    @property
    def page(self) -> str:
        """Address of the page that explains the check; empty: none does."""
        page = _PAGES.get(self.what, "guide/fri.md" if self.what.startswith("FRI") else "")
        return f"{_SITE}/{page}" if page else ""


def doctor(
    *,
    fri: Annotated[bool, Parameter(group=FRI, negative="", help="Also check FRI.")] = False,
    listen: FriListen = False,
    fri_port: FriPort = None,
    fri_period: FriPeriod = 1,
    fri_version: FriVersion = None,
    seconds: Annotated[float, Parameter(group=FRI, help="How long to check FRI [s].")] = 5.0,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Check the installation, and a target if one is given: one verdict and one remedy per line.

    With --fri also check FRI: a session of the target, or with --listen the messages of another application on
    the cabinet.

    For example:

        heptarm doctor

        heptarm doctor --fri --target lab1
    """
    target = target.or_else(None)
    listens = listen or target.text is None
    look = Look(listens, fri_port, fri_period, fri_version, seconds) if fri else None
    verdicts = [check() for check in (_python, _extras, _java, _jars, _priority)]
    if target.text is None or (look is not None and look.listens):
        verdicts.append(_port())
    else:
        verdicts += _target(target, target.text)
    if look is not None:
        verdicts += _fri(look, target=None if look.listens else target)
    if as_json:
        for verdict in verdicts:
            emit(asdict(verdict) | {"page": verdict.page})
    else:
        Console().print(_table(verdicts))
        for page in dict.fromkeys(
            verdict.page for verdict in verdicts if verdict.how != "ok" and verdict.page
        ):
            print(f"see {page}")
    return 1 if any(verdict.how == "bad" for verdict in verdicts) else 0


def _table(verdicts: list[CheckResult]) -> Table:
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
        # found and remedy are no markup: Rich would swallow the extra in 'heptarm[viz]'
        table.add_row(style[verdict.how], verdict.what, Text(verdict.found), Text(verdict.remedy))
    return table


def _python() -> CheckResult:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}, numpy {np.__version__}"
    return CheckResult("Python", "ok", found)


def _extras() -> CheckResult:
    missing = [
        extra
        for extra in ("sim", "viz")
        if any(importlib.util.find_spec(name) is None for name in EXTRAS[extra])
    ]
    if missing:
        return CheckResult(
            "extras",
            "note",
            f"not installed: {', '.join(missing)}",
            f"pip install 'heptarm[{','.join(missing)}]'",
        )
    return CheckResult("extras", "ok", "sim and viz are installed")


def _java() -> CheckResult:
    try:
        from heptarm.sim.runtime import jvm

        return CheckResult("Java", "ok", jvm.library())
    except ImportError as error:
        return CheckResult(
            "Java", "note", str(error), "only the virtual cabinet needs it: pip install 'heptarm[sim]'"
        )


def _jars() -> CheckResult:
    try:
        return CheckResult("cabinet", "ok", f"compiled, {len(_resources.jars())} jars")
    except HeptarmError as error:
        return CheckResult("cabinet", "note", error.text, error.hint)


def _priority() -> CheckResult:
    try:
        before = os.sched_getscheduler(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, before, os.sched_param(0))
    except (OSError, AttributeError) as error:
        remedy = "add 'USER - rtprio 60' to /etc/security/limits.conf and log in again"
        return CheckResult(
            "real time", "note", f"no real-time priority ({error}); loops may be late under load", remedy
        )
    return CheckResult("real time", "ok", "real-time priority is allowed")


def _port() -> CheckResult:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", PORT))
        except OSError:
            return CheckResult(
                "port",
                "note",
                f"{PORT} is taken here",
                f"heptarm doctor --target sim://127.0.0.1:{PORT} names the program that uses it",
            )
    return CheckResult("port", "ok", f"{PORT} is free for heptarm sim")


def _target(target: CommandTarget, text: str) -> Iterator[CheckResult]:
    parsed = parse_target(text)
    if not parsed.is_private:
        try:
            socket.create_connection((parsed.host, parsed.port), timeout=3).close()
            yield CheckResult("network", "ok", f"{parsed.host}:{parsed.port} accepts connections")
        except socket.gaierror:
            remedy = (
                "check the spelling, or use the IP address; heptarm targets lists the names of saved robots"
            )
            yield CheckResult("network", "bad", f"no host is named {parsed.host}", remedy)
            return
        except OSError as error:
            remedy = (
                "start the cabinet application or heptarm sim, and check that this machine is in its network"
            )
            yield CheckResult(
                "network", "bad", f"{parsed.host}:{parsed.port} does not answer ({error})", remedy
            )
            return
    try:
        arm = replace(target, datagrams=True).connect(control=False)
    except HeptarmError as error:
        yield CheckResult("session", "bad", error.text, error.hint)
        return
    with arm:
        yield CheckResult(
            "session",
            "ok",
            f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}, cabinet application {arm.software}",
        )
        yield _options(arm)
        yield _protection(arm, keyed=target.find_key() is not None)
        yield _round_trip(arm)
        yield _age(arm)
        yield datagram_check(arm)
        yield _safety(arm)


def _options(arm: Arm) -> CheckResult:
    if "sunrise2_preview" in arm.capabilities:
        return CheckResult(
            "options",
            "note",
            f"a preview for Sunrise 2.x, never run on such a cabinet; it can: {', '.join(arm.capabilities)}",
            "everything else is refused; run the probe of the guide on the cabinet and report its output",
        )
    missing = [text for name, text in _OPTIONS.items() if name not in arm.capabilities]
    if not missing:
        return CheckResult("options", "ok", f"installed: {', '.join(_OPTIONS.values())}")
    return CheckResult(
        "options",
        "note",
        f"this cabinet lacks {', '.join(missing)}",
        "install the option in Workbench, synchronize, and write the sources without --without; or do without",
    )


def _protection(arm: Arm, *, keyed: bool) -> CheckResult:
    if keyed:
        return CheckResult(
            "protection",
            "ok",
            "both sides have proved that they know the key",
        )
    address, allowed = _setting(arm, "heptarm.bind", "0.0.0.0"), _setting(arm, "heptarm.allow", "").strip()
    if allowed:
        return CheckResult(
            "protection", "ok", f"without a key; only these addresses may connect: {printable(allowed)}"
        )
    if address in _ALL:
        return CheckResult(
            "protection",
            "note",
            "any program in the network can move the robot: neither a key nor an allow-list is set",
            "make a key with `heptarm key new --target ADDRESS` and set it in the process data heptarm.key",
        )
    return CheckResult("protection", "ok", f"without a key; the cabinet listens on {printable(address)} only")


def _setting(arm: Arm, name: str, default: str) -> str:
    try:
        return arm.pad.process_data(name)
    except CommandRejected:  # the project does not have it
        return default


def _timed(call: Callable[[], object]) -> float:
    begin = time.perf_counter_ns()
    call()
    return (time.perf_counter_ns() - begin) / 1e3


def _round_trip(arm: Arm) -> CheckResult:
    times = [_timed(lambda: arm.subscribe(rate=100.0)) for _ in range(_REQUESTS)]
    median, late = np.percentile(times, [50, 99])
    found = f"{median:.0f} us median, {late:.0f} us 99 %"
    if median > _SLOW_US:
        return CheckResult(
            "round trip", "note", found, "use a cable and a direct connection; look for load on both machines"
        )
    return CheckResult("round trip", "ok", found)


def _age(arm: Arm) -> CheckResult:
    ages = [state.age * 1e3 for state in arm.states(duration=1.0)]
    if not ages:
        return CheckResult("state", "bad", "no state received within 1 s", "read the log of the cabinet")
    found = f"{len(ages)} states in 1 s, {np.median(ages):.2f} ms old, 99 % below {np.percentile(ages, 99):.2f} ms"
    how = "note" if np.median(ages) > _OLD_MS else "ok"
    return CheckResult("state", how, found, "subscribe at a lower rate" if how == "note" else "")


def datagram_check(arm: Arm) -> CheckResult:
    """Check whether datagrams get through in both directions; the arm was connected with them a second ago."""
    report = arm.connection.datagrams
    if report is None:
        return CheckResult(
            "datagrams",
            "note",
            "the cabinet has no UDP port: servo targets and states go over TCP",
            "only networks that lose packets need them: set the process data heptarm.datagrams to 1",
        )
    if not report.gets_through:
        return CheckResult(
            "datagrams",
            "note",
            f"no answer by UDP to {report.pings} pings: servo targets and states go over TCP",
            "let the firewalls pass UDP on the port of the application, in both directions",
        )
    found = f"{report.answers} of {report.pings} pings answered by UDP, {report.round_trip * 1e3:.2f} ms"
    if report.answers < _ANSWERED * report.pings - 2:  # the last ones are still under way
        return CheckResult(
            "datagrams", "note", found, "the network loses packets: connect(..., datagrams=True)"
        )
    return CheckResult("datagrams", "ok", found)


def _safety(arm: Arm) -> CheckResult:
    safety = arm.state.safety
    if not safety.is_known:
        return CheckResult(
            "safety",
            "note",
            "unknown: this cabinet reports neither safety state nor readiness nor operation mode",
            "look at the smartPAD before each motion",
        )
    found = f"{safety.mode.value.upper()}, {'ready' if safety.ready_to_move else 'not ready'} to move"
    if safety.ready_to_move:
        return CheckResult("safety", "ok", found)
    remedy = (
        "release the emergency stop"
        if safety.emergency_stop
        else "acknowledge the messages on the smartPAD and press Start"
    )
    return CheckResult("safety", "note", found, remedy)


def _fri(settings: Look, *, target: CommandTarget | None) -> Iterator[CheckResult]:
    """Check FRI of a target; without one, of any controller that sends to this machine."""
    if not 0.1 <= settings.seconds <= _LONGEST:
        raise CommandRejected(
            f"--seconds must be 0.1 to {_LONGEST:g} s, got {settings.seconds:g} s", parameter="--seconds"
        )
    port = settings.port if settings.port is not None else PORTS[0]
    taken = _taken(port)
    if taken is not None:
        if settings.port is not None or target is None:
            yield CheckResult("FRI port", "bad", taken.text, taken.hint)
            return
        yield CheckResult("FRI port", "note", taken.text, taken.hint)
    else:
        yield CheckResult("FRI port", "ok", f"UDP port {port} is free on this machine")
    yield from _listening(settings, port) if target is None else _opened(settings, target)


def _taken(port: int) -> HeptarmError | None:
    try:
        UdpSocket(port).close()
    except ConnectFailed as error:
        return error
    return None


def _listening(settings: Look, port: int) -> Iterator[CheckResult]:
    """Listen to another application on the cabinet."""
    with Client(port, version=settings.version) as client:
        began = time.monotonic()
        with contextlib.suppress(Timeout):
            client.next(timeout=settings.seconds)
        if not client.stats.received:
            yield _nothing(client, settings.seconds)
            return
        state = client.state
        while time.monotonic() - began < settings.seconds:
            time.sleep(0.05)
            state = max(state, client.state, key=lambda state: state.session)
        yield _messages(client, client.events())
        if state.session >= SessionState.COMMANDING_WAIT and state.mode is not CommandMode.NO_COMMAND:
            yield CheckResult(
                "FRI command", "ok", f"the application lets this client command: {state.mode.name}"
            )
        else:
            yield CheckResult(
                "FRI command",
                "note",
                f"the session is {state.session.name}: no motion with an overlay runs, so nothing can be commanded",
                "let the application add an FRIJointOverlay with a client command mode to a motion such as "
                "PositionHold"
                if state.session is SessionState.MONITORING_READY
                else "see the quality below",
            )
        yield from _quality(client)


def _nothing(client: Client, seconds: float) -> CheckResult:
    if client.stats.malformed:
        found, _, remedy = strangers(client).replace(": likely cause", "").rpartition(": ")
        return CheckResult("FRI messages", "bad", found, _VERSION if _names_version(found) else remedy)
    advice = silence("", client.port).partition("; ")[2]
    return CheckResult("FRI messages", "bad", f"nothing has arrived within {seconds:g} s", advice)


def _names_version(text: str) -> bool:
    """Whether the problem is a mismatch of FRI versions."""
    return "speaks FRI" in text


def _opened(settings: Look, target: CommandTarget) -> Iterator[CheckResult]:
    """Open a monitoring session of heptarm's application, beside any running motion."""
    try:
        arm = target.connect()
    except HeptarmError as error:
        yield CheckResult(
            "FRI session", "bad", error.text, error.hint or "end the client that controls the robot"
        )
        return
    with arm:
        offered = [name.removeprefix("fri_") for name in arm.capabilities if name.startswith("fri_")]
        kinds = [kind for kind in ("monitor", *_KINDS) if kind in offered]
        if not kinds:
            yield CheckResult(
                "FRI command",
                "bad",
                "this cabinet has no FRI",
                "install the option Sunrise.FRI on the cabinet",
            )
            return
        missing = [kind for kind in _KINDS if kind not in kinds]
        yield CheckResult(
            "FRI command",
            "ok",
            f"offered: {', '.join(kinds)}"
            + (f"; not offered: {', '.join(missing)}" if missing else "")
            + ("; signals are available" if "io" in offered else "; without signals"),
            "pose needs Sunrise 2.x" if missing == ["pose"] else "",
        )
        session = arm.fri(
            "monitor",
            period_ms=settings.period_ms,
            port=settings.port,
            version=settings.version,
            timeout=min(max(settings.seconds, 3.0), 60.0),
        )
        try:
            with session as rt:
                rt.wait(settings.seconds)
                yield _messages(rt.client, rt.events())
                yield from _quality(rt.client)
        except HeptarmError as error:
            if _names_version(error.hint):
                yield CheckResult("FRI session", "bad", error.hint.partition(": ")[0], _VERSION)
            else:
                yield CheckResult("FRI session", "bad", error.text, error.hint or _UNKNOWN)


def _messages(client: Client, events: list[Event]) -> CheckResult:
    stats, state = client.stats, client.state
    version = next((event.text for event in events if event.kind is Kind.VERSION), "")
    spoken = version.rpartition(" FRI ")[2] or "of the version that was asked for"
    found = f"FRI {spoken}, every {state.period * 1e3:g} ms: {stats.received} received, {stats.lost} lost"
    remedy = "use a cable and a direct connection instead of a busy switch"
    if stats.lost > _LOST_FRACTION * stats.received:
        return CheckResult("FRI messages", "note", found, remedy)
    return CheckResult("FRI messages", "ok", found)


def _quality(client: Client) -> Iterator[CheckResult]:
    stats, state = client.stats, client.state
    total = max(1, sum(stats.quality.values()))
    parts = ", ".join(f"{100 * count / total:.0f} % {name}" for name, count in stats.quality.items() if count)
    found = f"{_trend(client)} ({parts}); {stats.missed} answers missed"
    median, late, longest = _latency(client)
    why = cause(stats, state.period, client.refused, late=late)
    if state.quality < Quality.GOOD:
        yield CheckResult(
            "FRI quality", "bad", found, why or "wait: the quality rises with each answer in time"
        )
    elif why:
        yield CheckResult("FRI quality", "note", found, why)
    else:
        yield CheckResult("FRI quality", "ok", found)
    found = f"{1e3 * median:.3f} ms median, {1e3 * late:.3f} ms 99 %, {1e3 * longest:.3f} ms longest"
    slow = late > 0.5 * state.period
    remedy = "; ".join(client.refused) or "look for load on this machine" if slow else ""
    yield CheckResult("FRI answers", "note" if slow else "ok", found, remedy)
    if client.refused and not slow:
        yield CheckResult("FRI loop", "note", client.refused[0].partition(":")[0], client.refused[0])


def _latency(client: Client) -> tuple[float, float, float]:
    """Median, 99 % and longest latency since the quality was good [s]: the first answers are always slow."""
    states = client.history()
    first = next((i for i, state in enumerate(states) if state.quality >= Quality.GOOD), 0)
    delays = [state.latency for state in states[first:]]
    return float(np.median(delays)), float(np.percentile(delays, 99)), max(delays)


def _trend(client: Client) -> str:
    """The qualities in their order, each named once."""
    names: list[str] = []
    for state in client.history():
        if not names or names[-1] != state.quality.name:
            names.append(state.quality.name)
    return " -> ".join(names[-6:]) or client.quality.name
