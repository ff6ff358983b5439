"""`heptarm bench --fri`: how fast and how reliably messages are answered, as numbers, a verdict and a picture."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from heptarm.arm.connect import connect
from heptarm.arm.fri_advice import cause
from heptarm.arm.fri_settings import PORTS
from heptarm.arm.target import VARIABLE
from heptarm.cli.output import confirm, emit
from heptarm.errors import CommandRejected, NotReady, QualityLost, require
from heptarm.fri.messages import Quality
from heptarm.rt import Client, State
from heptarm.values.arrays import Array, within

#: Messages that are kept for the picture.
_KEPT = 120_000
#: How long quality may take to become good [s].
_WARM_UP = 20.0
#: A smaller share of cycles that went wrong is passed.
_SHARE = 0.01
_COLOURS = {Quality.POOR: "firebrick", Quality.FAIR: "darkorange", Quality.GOOD: "olivedrab"}


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What was measured.

    Attributes:
        messages: the messages since the connection was good, oldest first.
        lost: messages that never came; missed: answers that the cabinet did not take in time.
        period: send period [s].
        why: what spoils it most, with the remedy; empty if nothing does.
        good: it ended in good quality, and few cycles went wrong.
    """

    messages: list[State]
    lost: int
    missed: int
    period: float
    why: str
    good: bool

    @property
    def latency(self) -> Array:
        """Receipt to answer of every answered message [s]."""
        return np.array([one.latency for one in self.messages if one.is_answered])


def run(
    *,
    fri: bool,
    listen: bool,
    command: Literal["monitor", "position"],
    port: int | None,
    period_ms: int,
    version: str | None,
    duration: float,
    plot: Path | None,
    yes: bool,
    target: str | None,
    as_json: bool,
) -> int:
    """Measure; returns the exit code, 1 if too many cycles went wrong.

    Args:
        fri: measure FRI; there is nothing else yet.
        listen: open no session, listen to somebody else's application.
        command: of the session that is opened.
        port: own UDP port.
        period_ms: of the session that is opened.
        version: FRI release of the cabinet.
        duration: [s].
        plot: where the picture goes.
        yes: do not ask before a real robot is held.
        target: what to connect to; None: HEPTARM_TARGET, else a simulator of one's own.
        as_json: print an object.

    Raises:
        HeptarmError: no connection came to stand; the text says why.
    """
    if not fri:
        raise CommandRejected("nothing to measure was named", hint="heptarm bench --fri")
    seconds = within(duration, "duration", 0.1, 86400.0, unit="s")
    if plot is not None:
        require("matplotlib", extra="viz")
    kept = min(_KEPT, round(1.2 * seconds * 1e3 / max(period_ms, 1)) + 2000)
    settings = {"port": port, "version": version, "history": kept}
    if listen:
        source = _heard(settings, seconds)
    else:
        chosen = target or os.environ.get(VARIABLE, "").strip() or "sim://iiwa14"
        source = _asked(chosen, command, period_ms, settings, yes=yes)
    with source as client:
        before = client.stats
        _wait(client, seconds)
        after = client.stats
        course = _course(client, after.lost - before.lost, after.missed - before.missed, before.received)
    if plot is not None:
        draw(course, plot)
    emit(_data(course)) if as_json else print("\n".join(_lines(course, plot)))
    return 0 if course.good else 1


@contextmanager
def _asked(
    target: str,
    command: Literal["monitor", "position"],
    period_ms: int,
    settings: dict[str, Any],
    *,
    yes: bool,
) -> Iterator[Client]:
    """A session of heptarm's application."""
    with connect(target) as arm:
        real = command != "monitor" and not arm.is_virtual
        if real and not (yes or confirm(f"Hold the real {arm.robot.title} by FRI commands?")):
            raise NotReady("nothing was started", hint="confirm the question, or give --yes")
        with arm.fri(command, period_ms=period_ms, **settings) as rt:
            yield rt.client


@contextmanager
def _heard(settings: dict[str, Any], seconds: float) -> Iterator[Client]:
    """Whatever the cabinet sends."""
    port = settings.pop("port")
    with Client(PORTS[0] if port is None else port, **settings) as client:
        deadline = time.monotonic() + _WARM_UP
        while client.next(timeout=max(seconds, 5.0)).quality < Quality.GOOD:
            if time.monotonic() > deadline:
                raise QualityLost(
                    f"the quality is {client.quality.name} after {_WARM_UP:g} s",
                    hint=cause(client.stats, client.state.period, client.refused)
                    or "heptarm doctor --fri --listen",
                )
        yield client


def _wait(client: Client, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while (rest := deadline - time.monotonic()) > 0.0:
        client.next(timeout=5.0)
        time.sleep(min(rest, 0.1))


def _course(client: Client, lost: int, missed: int, before: int) -> Course:
    stats, states = client.stats, client.history()
    messages = states[-max(1, min(len(states), stats.received - before)) :]
    period = messages[-1].period
    late = sum(one.latency > period for one in messages)
    good = messages[-1].quality >= Quality.GOOD and lost + missed + late <= _SHARE * len(messages)
    usual = float(np.percentile([one.latency for one in messages], 99))
    why = cause(stats, period, client.refused, late=usual)
    return Course(messages, lost, missed, period, why, good)


def _data(course: Course) -> dict[str, Any]:
    median, late, later = _percentiles(course.latency)
    return {
        "messages": len(course.messages),
        "period_s": course.period,
        "lost": course.lost,
        "missed": course.missed,
        "latency_s": {
            "p50": median,
            "p99": late,
            "p999": later,
            "max": float(course.latency.max(initial=0.0)),
        },
        "quality": _shares(course),
        "cause": course.why,
        "good": course.good,
    }


def _lines(course: Course, plot: Path | None) -> list[str]:
    median, late, later = (1e6 * one for one in _percentiles(course.latency))
    longest = 1e6 * course.latency.max(initial=0.0)
    lines = [
        f"messages  {len(course.messages)} every {course.period * 1e3:g} ms, {course.lost} lost",
        f"answers   {len(course.latency)} sent, {course.missed} missed by the cabinet",
        f"latency   {median:.0f} us median, {late:.0f} us 99 %, {later:.0f} us 99.9 %, {longest:.0f} us longest",
        "quality   " + ", ".join(f"{100 * share:.1f} % {name}" for name, share in _shares(course).items()),
        f"verdict   {'good' if course.good else 'not good'}" + (f": {course.why}" if course.why else ""),
    ]
    return lines + ([f"plotted in {plot}"] if plot is not None else [])


def _percentiles(latency: Array) -> tuple[float, float, float]:
    if not latency.size:
        return 0.0, 0.0, 0.0
    median, late, later = np.percentile(latency, [50, 99, 99.9])
    return float(median), float(late), float(later)


def _shares(course: Course) -> dict[str, float]:
    seen = [one.quality for one in course.messages]
    return {one.name.lower(): seen.count(one) / len(seen) for one in Quality if one in seen}


def draw(course: Course, path: Path) -> None:
    """Save a histogram of the latency, and its course over time with what went wrong."""
    matplotlib = require("matplotlib", extra="viz")
    matplotlib.use("Agg")
    plt: Any = require("matplotlib.pyplot", extra="viz")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    micros = 1e6 * course.latency
    top = max(50.0, 1.1 * float(np.percentile(micros, 99.9)) if micros.size else 0.0)
    left.hist(np.minimum(micros, top), bins=np.linspace(0.0, top, 120), color="steelblue", log=True)
    for share, style in ((50, "-"), (99, "--"), (99.9, ":")):
        value = float(np.percentile(micros, share)) if micros.size else 0.0
        left.axvline(
            value, color="black", linestyle=style, linewidth=1.0, label=f"{share:g} %: {value:.0f} us"
        )
    left.set_xlabel("receipt of a message to its answer [us]; the last bar has all longer ones")
    left.set_ylabel("answers")
    left.legend(fontsize=9, framealpha=1.0)
    begin = course.messages[0].received
    times = np.array([(one.received - begin) * 1e-9 for one in course.messages])
    delays = np.array([1e6 * one.latency if one.is_answered else np.nan for one in course.messages])
    right.plot(times, delays, ".", markersize=1.5, color="steelblue", rasterized=True)
    right.axhline(1e6 * course.period, color="black", linewidth=0.8, linestyle=":")
    right.text(0.0, 1e6 * course.period, " one period", fontsize=8, va="bottom")
    for quality, colour in _COLOURS.items():
        spans = np.array([one.quality == quality for one in course.messages])
        if spans.any():
            across = right.get_xaxis_transform()
            right.fill_between(
                times, 0, 1, where=spans, color=colour, alpha=0.2, transform=across, label=quality.name
            )
            right.legend(frameon=False, fontsize=9)
    gaps = np.flatnonzero(np.diff([one.sequence for one in course.messages]) > 1)
    right.plot(times[gaps], np.full(len(gaps), 1e6 * course.period), "x", color="firebrick")
    right.set_yscale("log")
    right.set_xlabel("time [s]")
    right.set_ylabel("latency [us]")
    verdict = "good" if course.good else "not good"
    figure.suptitle(
        f"FRI every {course.period * 1e3:g} ms: {len(course.messages)} messages, {course.lost} lost, "
        f"{course.missed} answers missed, {verdict}",
        fontsize=11,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
