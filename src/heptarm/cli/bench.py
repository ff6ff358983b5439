"""`heptarm bench --fri`: how fast and how reliably messages are answered, as numbers, a verdict and a picture."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from heptarm.arm.fri.diagnosis import cause
from heptarm.arm.fri.settings import PORTS
from heptarm.cli.options import (
    FRI,
    NO_TARGET,
    CommandTarget,
    FriListen,
    FriPeriod,
    FriPort,
    FriVersion,
    Json,
    Overwrite,
    Yes,
)
from heptarm.cli.output import confirm, emit
from heptarm.errors import CommandRejected, NotReady, QualityLost, require
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.echo import floor
from heptarm.fri.loop.user_api import State
from heptarm.fri.protocol.messages import Quality
from heptarm.values.checks import Array, within
from heptarm.values.files import writable_file

#: Messages kept for the picture.
_KEPT = 120_000
#: Longest measurement of the echo [s].
_ECHO_TIME = 10.0
#: How long quality may take to become good [s].
_WARM_UP = 20.0
#: A smaller fraction of failed cycles is accepted.
_FAILED_FRACTION = 0.01
_COLOURS = {Quality.POOR: "firebrick", Quality.FAIR: "darkorange", Quality.GOOD: "olivedrab"}


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """A measured FRI session.

    Attributes:
        messages: the messages since the connection was good, oldest first.
        lost: messages that never came; missed: answers that the cabinet did not take in time.
        period: send period [s].
        why: the main disturbance with its remedy; empty without one.
        good: the session ended in good quality, and few cycles failed.
        echo: receipt to reply of a bare echo in C on this machine [s]; empty if it was not measured.
    """

    messages: list[State]
    lost: int
    missed: int
    period: float
    why: str
    good: bool
    echo: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def latency(self) -> Array:
        """Receipt to answer of every answered message [s]."""
        return np.array([message.latency for message in self.messages if message.is_answered])


def bench(
    *,
    fri: Annotated[bool, Parameter(group=FRI, negative="", help="Measure FRI.")] = False,
    listen: FriListen = False,
    fri_command: Annotated[
        Literal["monitor", "position"],
        Parameter(group=FRI, help="Only monitor, or hold the position by commands."),
    ] = "monitor",
    fri_port: FriPort = None,
    fri_period: FriPeriod = 1,
    fri_version: FriVersion = None,
    duration: Annotated[float, Parameter(help="How long to measure [s].")] = 10.0,
    plot: Annotated[
        Path | None,
        Parameter(
            help="Save a histogram, beside that of a bare echo in C, and the time series as a picture."
        ),
    ] = None,
    yes: Yes = False,
    target: CommandTarget = NO_TARGET,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Measure how fast and how reliably FRI messages are answered, and name the main disturbance.

    For example:

        heptarm bench --fri --duration 30 --plot bench.png --target lab1
    """
    if not fri:
        raise CommandRejected("--fri is required: this command measures FRI", hint="heptarm bench --fri")
    seconds = within(duration, "duration", 0.1, 86400.0, unit="s")
    if plot is not None:
        require("matplotlib", extra="viz")
        writable_file(plot, overwrite=overwrite, name="plot")
    kept = min(_KEPT, round(1.2 * seconds * 1e3 / max(fri_period, 1)) + 2000)
    settings = {"port": fri_port, "version": fri_version, "history": kept}
    if listen:
        source = _heard(settings, seconds)
    else:
        source = _asked(target.or_else("sim://iiwa14"), fri_command, fri_period, settings, yes=yes)
    with source as client:
        before = client.stats
        echo = _wait_beside_echo(client, seconds) if plot is not None else _wait(client, seconds)
        after = client.stats
        measured = _measure(client, after.lost - before.lost, after.missed - before.missed, before.received)
    if plot is not None:
        measured = replace(measured, echo=echo)
        draw(measured, plot)
    emit(_data(measured)) if as_json else print("\n".join(_lines(measured, plot)))
    return 0 if measured.good else 1


@contextmanager
def _asked(
    target: CommandTarget,
    command: Literal["monitor", "position"],
    period_ms: int,
    settings: dict[str, Any],
    *,
    yes: bool,
) -> Iterator[Client]:
    """A session of heptarm's application."""
    with target.connect() as arm:
        real = command != "monitor" and not arm.is_virtual
        if real and not (yes or confirm(f"Hold the real {arm.robot.title} by FRI commands?")):
            raise NotReady("nothing was started", hint="confirm the question, or give --yes")
        with arm.fri(command, period_ms=period_ms, **settings) as rt:
            yield rt.client


@contextmanager
def _heard(settings: dict[str, Any], seconds: float) -> Iterator[Client]:
    """The messages of any application on the cabinet."""
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


def _wait(client: Client, seconds: float) -> Array:
    """Wait while messages come; no echo is measured."""
    deadline = time.monotonic() + seconds
    while (rest := deadline - time.monotonic()) > 0.0:
        client.next(timeout=5.0)
        time.sleep(min(rest, 0.1))
    return np.zeros(0)


def _wait_beside_echo(client: Client, seconds: float) -> Array:
    """Measure the echo meanwhile, with the period of the session: the machine is then the same for both.

    Returns:
        Receipt to reply of the echo [s].
    """
    with ThreadPoolExecutor(1) as pool:
        echo = pool.submit(floor, min(seconds, _ECHO_TIME), period=client.state.period)
        _wait(client, seconds)
        return echo.result()


def _measure(client: Client, lost: int, missed: int, before: int) -> Measurement:
    stats, states = client.stats, client.history()
    messages = states[-max(1, min(len(states), stats.received - before)) :]
    period = messages[-1].period
    late = sum(message.latency > period for message in messages)
    good = messages[-1].quality >= Quality.GOOD and lost + missed + late <= _FAILED_FRACTION * len(messages)
    usual = float(np.percentile([message.latency for message in messages], 99))
    why = cause(stats, period, client.refused, late=usual)
    return Measurement(messages, lost, missed, period, why, good)


def _times(latency: Array) -> dict[str, float]:
    median, late, later = _percentiles(latency)
    return {"p50": median, "p99": late, "p999": later, "max": float(latency.max(initial=0.0))}


def _data(measured: Measurement) -> dict[str, Any]:
    echo = {"echo_s": _times(measured.echo)} if measured.echo.size else {}
    return {
        "messages": len(measured.messages),
        "period_s": measured.period,
        "lost": measured.lost,
        "missed": measured.missed,
        "latency_s": _times(measured.latency),
        **echo,
        "quality": _fractions(measured),
        "cause": measured.why,
        "good": measured.good,
    }


def _lines(measured: Measurement, plot: Path | None) -> list[str]:
    lines = [
        f"messages  {len(measured.messages)} every {measured.period * 1e3:g} ms, {measured.lost} lost",
        f"answers   {len(measured.latency)} sent, {measured.missed} missed by the cabinet",
        f"latency   {_micros(measured.latency)}",
        *([f"echo      {_micros(measured.echo)}, of a bare echo in C"] if measured.echo.size else []),
        "quality   " + ", ".join(f"{100 * part:.1f} % {name}" for name, part in _fractions(measured).items()),
        f"verdict   {'good' if measured.good else 'not good'}"
        + (f": {measured.why}" if measured.why else ""),
    ]
    return lines + ([f"plotted in {plot}"] if plot is not None else [])


def _micros(latency: Array) -> str:
    median, late, later, longest = (1e6 * time for time in (*_percentiles(latency), latency.max(initial=0.0)))
    return f"{median:.0f} us median, {late:.0f} us 99 %, {later:.0f} us 99.9 %, {longest:.0f} us longest"


def _percentiles(latency: Array) -> tuple[float, float, float]:
    if not latency.size:
        return 0.0, 0.0, 0.0
    median, late, later = np.percentile(latency, [50, 99, 99.9])
    return float(median), float(late), float(later)


def _fractions(measured: Measurement) -> dict[str, float]:
    seen = [message.quality for message in measured.messages]
    return {quality.name.lower(): seen.count(quality) / len(seen) for quality in Quality if quality in seen}


def draw(measured: Measurement, path: Path) -> None:
    """Save histograms of the latency and of the echo, and the latency over time with lost and late messages."""
    matplotlib = require("matplotlib", extra="viz")
    matplotlib.use("Agg")
    plt: Any = require("matplotlib.pyplot", extra="viz")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    micros = 1e6 * measured.latency
    top = max(50.0, 1.1 * float(np.percentile(micros, 99.9)) if micros.size else 0.0)
    bins = np.linspace(0.0, top, 120)
    left.hist(np.minimum(micros, top), bins=bins, color="steelblue", log=True, label="FRI answers")
    if measured.echo.size:  # as many in sum as answers, so that heights compare
        each = np.full(measured.echo.size, max(micros.size, 1) / measured.echo.size)
        echoes = np.minimum(1e6 * measured.echo, top)
        median = 1e6 * float(np.median(measured.echo))
        label = f"bare echo in C, 50 %: {median:.0f} us"
        left.hist(echoes, bins=bins, weights=each, label=label, histtype="step", color="darkorange")
    for percent, style in ((50, "-"), (99, "--"), (99.9, ":")):
        value = float(np.percentile(micros, percent)) if micros.size else 0.0
        left.axvline(
            value, color="black", linestyle=style, linewidth=1.0, label=f"{percent:g} %: {value:.0f} us"
        )
    left.set_xlabel("receipt of a message to its answer [us]; the last bar has all longer ones")
    left.set_ylabel("answers")
    left.legend(fontsize=9, framealpha=1.0)
    begin = measured.messages[0].received
    times = np.array([(message.received - begin) * 1e-9 for message in measured.messages])
    delays = np.array(
        [1e6 * message.latency if message.is_answered else np.nan for message in measured.messages]
    )
    right.plot(times, delays, ".", markersize=1.5, color="steelblue", rasterized=True)
    right.axhline(1e6 * measured.period, color="black", linewidth=0.8, linestyle=":")
    right.text(0.0, 1e6 * measured.period, " one period", fontsize=8, va="bottom")
    for quality, colour in _COLOURS.items():
        spans = np.array([message.quality == quality for message in measured.messages])
        if spans.any():
            across = right.get_xaxis_transform()
            right.fill_between(
                times, 0, 1, where=spans, color=colour, alpha=0.2, transform=across, label=quality.name
            )
            right.legend(frameon=False, fontsize=9)
    gaps = np.flatnonzero(np.diff([message.sequence for message in measured.messages]) > 1)
    right.plot(times[gaps], np.full(len(gaps), 1e6 * measured.period), "x", color="firebrick")
    right.set_yscale("log")
    right.set_xlabel("time [s]")
    right.set_ylabel("latency [us]")
    verdict = "good" if measured.good else "not good"
    figure.suptitle(
        f"FRI every {measured.period * 1e3:g} ms: {len(measured.messages)} messages, {measured.lost} lost, "
        f"{measured.missed} answers missed, {verdict}",
        fontsize=11,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
