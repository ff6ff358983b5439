"""`heptarm doctor --fri`: what keeps an FRI connection from standing, or standing well, one verdict a line."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import numpy as np

from heptarm.arm.connect import connect
from heptarm.arm.fri_advice import cause, silence, strangers
from heptarm.arm.fri_settings import PORTS
from heptarm.cli.doctor import Look, Verdict
from heptarm.errors import CommandRejected, ConnectFailed, HeptarmError, Timeout
from heptarm.fri.event import Event, Kind
from heptarm.fri.messages import CommandMode, Quality, SessionState
from heptarm.io.udp import UdpSocket
from heptarm.rt import Client

#: A share of lost messages or answers that is worth a word.
_SHARE = 0.001
_MOST = 3600.0
_KINDS = ("position", "torque", "wrench", "pose")
_VERSION = (
    "leave --fri-version (version= in a program) out: heptarm takes it from the first message; a client that is built "
    "with KUKA's SDK has to be built for the cabinet's version"
)
_UNKNOWN = "look at the messages on the smartPAD and at the log of the cabinet's application"


def look(settings: Look, *, target: str | None) -> Iterator[Verdict]:
    """Look at FRI of a target, or of whatever sends to this machine if there is none."""
    if not 0.1 <= settings.seconds <= _MOST:
        raise CommandRejected(
            f"--seconds is {settings.seconds:g}; allowed is 0.1 to {_MOST:g}", parameter="--seconds"
        )
    port = settings.port if settings.port is not None else PORTS[0]
    taken = _taken(port)
    if taken is not None:
        if settings.port is not None or target is None:
            yield Verdict("FRI port", "bad", taken.text, taken.hint)
            return
        yield Verdict("FRI port", "note", taken.text, taken.hint)
    else:
        yield Verdict("FRI port", "ok", f"UDP port {port} is free on this machine")
    yield from _listening(settings, port) if target is None else _opened(settings, target)


def _taken(port: int) -> HeptarmError | None:
    try:
        UdpSocket(port).close()
    except ConnectFailed as error:
        return error
    return None


def _listening(settings: Look, port: int) -> Iterator[Verdict]:
    """Somebody else's application on the cabinet sends, or does not."""
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
            state = max(state, client.state, key=lambda one: one.session)
        yield _messages(client, client.events())
        if state.session >= SessionState.COMMANDING_WAIT and state.mode is not CommandMode.NO_COMMAND:
            yield Verdict("FRI command", "ok", f"the application lets this client command: {state.mode.name}")
        else:
            yield Verdict(
                "FRI command",
                "note",
                f"the session is {state.session.name}: no motion with an overlay runs, so nothing can be commanded",
                "let the application add an FRIJointOverlay with a client command mode to a motion such as "
                "PositionHold"
                if state.session is SessionState.MONITORING_READY
                else "see the quality below",
            )
        yield from _quality(client)


def _nothing(client: Client, seconds: float) -> Verdict:
    if client.stats.malformed:
        found, _, remedy = strangers(client).rpartition(": ")
        return Verdict("FRI messages", "bad", found, _VERSION if _names_version(found) else remedy)
    advice = silence("", client.port).partition("; ")[2]
    return Verdict("FRI messages", "bad", f"nothing has arrived within {seconds:g} s", advice)


def _names_version(text: str) -> bool:
    """Whether a trouble is that of two versions."""
    return "speaks FRI" in text


def _opened(settings: Look, target: str) -> Iterator[Verdict]:
    """A session of heptarm's application that only monitors, beside whatever runs."""
    try:
        arm = connect(target)
    except HeptarmError as error:
        yield Verdict(
            "FRI session", "bad", error.text, error.hint or "end the client that controls the robot"
        )
        return
    with arm:
        offered = [name.removeprefix("fri_") for name in arm.capabilities if name.startswith("fri_")]
        kinds = [kind for kind in ("monitor", *_KINDS) if kind in offered]
        if not kinds:
            yield Verdict(
                "FRI command",
                "bad",
                "this cabinet has no FRI",
                "install the option Sunrise.FRI on the cabinet",
            )
            return
        missing = [kind for kind in _KINDS if kind not in kinds]
        yield Verdict(
            "FRI command",
            "ok",
            f"offered: {', '.join(kinds)}"
            + (f"; not offered: {', '.join(missing)}" if missing else "")
            + ("; signals may go with them" if "io" in offered else "; without signals"),
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
                yield Verdict("FRI session", "bad", error.hint.partition(": ")[0], _VERSION)
            else:
                yield Verdict("FRI session", "bad", error.text, error.hint or _UNKNOWN)


def _messages(client: Client, events: list[Event]) -> Verdict:
    stats, state = client.stats, client.state
    version = next((event.text for event in events if event.kind is Kind.VERSION), "")
    spoken = version.rpartition(" FRI ")[2] or "of the version that was asked for"
    found = f"FRI {spoken}, every {state.period * 1e3:g} ms: {stats.received} received, {stats.lost} lost"
    remedy = "a cable, a direct connection and no busy switch lose none"
    if stats.lost > _SHARE * stats.received:
        return Verdict("FRI messages", "note", found, remedy)
    return Verdict("FRI messages", "ok", found)


def _quality(client: Client) -> Iterator[Verdict]:
    stats, state = client.stats, client.state
    total = max(1, sum(stats.quality.values()))
    shares = ", ".join(
        f"{100 * count / total:.0f} % {name}" for name, count in stats.quality.items() if count
    )
    found = f"{_trend(client)} ({shares}); {stats.missed} answers missed"
    median, late, longest = _latency(client)
    why = cause(stats, state.period, client.refused, late=late)
    if state.quality < Quality.GOOD:
        yield Verdict("FRI quality", "bad", found, why or "give it time: quality is earned answer by answer")
    elif why:
        yield Verdict("FRI quality", "note", found, why)
    else:
        yield Verdict("FRI quality", "ok", found)
    found = f"{1e3 * median:.3f} ms median, {1e3 * late:.3f} ms 99 %, {1e3 * longest:.3f} ms longest"
    slow = late > 0.5 * state.period
    remedy = "; ".join(client.refused) or "look for load on this machine" if slow else ""
    yield Verdict("FRI answers", "note" if slow else "ok", found, remedy)
    if client.refused and not slow:
        yield Verdict("FRI loop", "note", client.refused[0].partition(":")[0], client.refused[0])


def _latency(client: Client) -> tuple[float, float, float]:
    """Median, 99 % and longest latency since the quality was good [s]: the first answers are always slow."""
    states = client.history()
    first = next((i for i, one in enumerate(states) if one.quality >= Quality.GOOD), 0)
    delays = [one.latency for one in states[first:]]
    return float(np.median(delays)), float(np.percentile(delays, 99)), max(delays)


def _trend(client: Client) -> str:
    """The qualities one after the other, each named once."""
    names: list[str] = []
    for state in client.history():
        if not names or names[-1] != state.quality.name:
            names.append(state.quality.name)
    return " -> ".join(names[-6:]) or client.quality.name
