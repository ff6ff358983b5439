"""What shows a state, checks or measures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.cli.app import FRI, Json, Target, Yes, app

FriPort = Annotated[
    int | None, Parameter(group=FRI, help="Own UDP port. Default: the first free one of 30200 to 30209.")
]
FriPeriod = Annotated[int, Parameter(group=FRI, help="Time between two messages [ms].")]
FriVersion = Annotated[
    str | None, Parameter(group=FRI, help="FRI release that the cabinet speaks. Default: whichever it is.")
]
FriListen = Annotated[
    bool,
    Parameter(
        group=FRI,
        negative="",
        help="Open no session; listen to the FRI application that runs on the cabinet.",
    ),
]


@app.command
def state(
    *,
    watch: Annotated[bool, Parameter(negative="", help="Go on until Ctrl-C.")] = False,
    rate: Annotated[float, Parameter(help="States per second.")] = 10.0,
    duration: Annotated[float | None, Parameter(help="Watch for this long [s].")] = None,
    target: Target = None,
    json: Json = False,
) -> int:
    """Show the state of the arm."""
    from heptarm.cli import state as work

    return work.run(target=target, watch=watch, rate=rate, duration=duration, as_json=json)


@app.command
def doctor(
    *,
    fri: Annotated[bool, Parameter(group=FRI, negative="", help="Also look at FRI.")] = False,
    listen: FriListen = False,
    fri_port: FriPort = None,
    fri_period: FriPeriod = 1,
    fri_version: FriVersion = None,
    seconds: Annotated[float, Parameter(group=FRI, help="How long to look at FRI [s].")] = 5.0,
    target: Target = None,
    json: Json = False,
) -> int:
    """Check the installation, and a target if one is given: one verdict and one remedy a line.

    With --fri also the connection for FRI: a session of the target, or with --listen what some other application
    on the cabinet sends.
    """
    from heptarm.cli import doctor as work

    listens = listen or (target is None and not os.environ.get("HEPTARM_TARGET"))
    look = work.Look(listens, fri_port, fri_period, fri_version, seconds)
    return work.run(target=target, as_json=json, fri=look if fri else None)


@app.command
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
    plot: Annotated[Path | None, Parameter(help="Save histogram and course as a picture.")] = None,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Measure how fast and how reliably FRI messages are answered, and name what spoils it; exit code for CI."""
    from heptarm.cli import fri_bench as work

    return work.run(
        fri=fri,
        listen=listen,
        command=fri_command,
        port=fri_port,
        period_ms=fri_period,
        version=fri_version,
        duration=duration,
        plot=plot,
        yes=yes,
        target=target,
        as_json=json,
    )


@app.command
def check(
    *only: Annotated[
        str, Parameter(help="Scenarios: names, groups, or patterns such as 'motions.*'. None: all.")
    ],
    list_only: Annotated[bool, Parameter(name="--list", negative="", help="Name them, run nothing.")] = False,
    contact: Annotated[
        bool, Parameter(negative="", help="On a robot, also those that touch something.")
    ] = False,
    faults: Annotated[
        bool, Parameter(negative="", help="On a robot, also those in which something goes wrong.")
    ] = False,
    sim_speed: Annotated[float, Parameter(help="Without a target: simulated seconds per second.")] = 2.0,
    junit: Annotated[Path | None, Parameter(help="Write a report for CI systems, JUnit XML.")] = None,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Show what a robot can do, scenario by scenario, by measurement; exit code 1 if one fails.

    Without a target a simulator with a table, signals and tools is started. A real robot moves at a tenth of its speed,
    and every scenario that moves it asks first.
    """
    from heptarm.cli import check as work

    return work.run(
        only=only,
        list_only=list_only,
        contact=contact,
        faults=faults,
        sim_speed=sim_speed,
        junit=junit,
        yes=yes,
        target=target,
        as_json=json,
    )
