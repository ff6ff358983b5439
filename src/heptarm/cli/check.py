"""`heptarm check`: runs scenarios and prints a table of the results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from heptarm import testing
from heptarm.arm.watchdog import CHECK
from heptarm.cli.options import (
    NO_TARGET,
    CommandTarget,
    Json,
    Overwrite,
    Yes,
)
from heptarm.cli.output import confirm, emit
from heptarm.errors import CommandRejected
from heptarm.testing import Outcome, Report, Scenario, Verdict
from heptarm.values.files import writable_file

#: Longest wait for an answer [s]: a machine that also simulates may be late.
_TIMEOUT = 20.0
_STYLES = {Verdict.SHOWN: "green", Verdict.FAILED: "red", Verdict.LEFT_OUT: "yellow"}


def check(
    *only: Annotated[
        str, Parameter(help="Scenarios: names, groups, or patterns such as 'motions.*'. None: all.")
    ],
    list_only: Annotated[
        bool, Parameter(name="--list", negative="", help="List the scenarios, run nothing.")
    ] = False,
    contact: Annotated[
        bool, Parameter(negative="", help="On a robot, also those that touch something.")
    ] = False,
    faults: Annotated[bool, Parameter(negative="", help="On a robot, also those that cause faults.")] = False,
    sim_speed: Annotated[
        float | None,
        Parameter(help="Without a target: simulated seconds per second. Default: 2, with --commission 1."),
    ] = None,
    noisy: Annotated[
        bool,
        Parameter(negative="", help="Without a target: sensors with noise and offset, joints with friction."),
    ] = False,
    junit: Annotated[Path | None, Parameter(help="Write a report for CI systems, JUnit XML.")] = None,
    commission: Annotated[
        bool,
        Parameter(
            negative="",
            help="Compare a robot in T1 with what the simulator assumes, step by step; NAMES are steps or groups.",
        ),
    ] = False,
    report: Annotated[
        Path | None,
        Parameter(
            help="With --commission: write this file with .md and .json. Default: commissioning-ROBOT-DATE."
        ),
    ] = None,
    projects: Annotated[
        Path | None,
        Parameter(
            help="Folder of Sunrise projects: show which of their classes compile, in place of scenarios."
        ),
    ] = None,
    run: Annotated[
        float,
        Parameter(
            help="With --projects: also run each application on a virtual cabinet, for at most so many seconds."
        ),
    ] = 0.0,
    jar: Annotated[
        tuple[Path, ...], Parameter(help="With --projects: a library of the projects; may be repeated.")
    ] = (),
    overwrite: Overwrite = False,
    yes: Yes = False,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Show what a robot can do, scenario by scenario, by measurement; exit code 1 if one fails.

    Without a target, a simulator with a table, signals and tools is started, by default with ideal sensors. A real
    robot moves at a tenth of its speed, and every scenario that moves it asks first.
    """
    if commission:
        from heptarm.cli import commissioning

        where = target.or_else(testing.stage(speed=1.0 if sim_speed is None else sim_speed))
        return commissioning.run(
            only, where, file=report, overwrite=overwrite, list_only=list_only, yes=yes, as_json=as_json
        )
    if projects is not None:
        from heptarm.cli import projects as surveyed

        return surveyed.run(projects, jars=jar, seconds=run, as_json=as_json)
    if run or jar:
        name = "run" if run else "jar"
        raise CommandRejected(
            f"--{name} needs --projects", parameter=name, hint="name a folder of Sunrise projects"
        )
    if report is not None:
        raise CommandRejected(
            "--report needs --commission", parameter="report", hint="use --junit for a report on scenarios"
        )
    if junit is not None:
        writable_file(junit, overwrite=overwrite, name="junit")
    chosen = testing.find(only)
    if noisy and target.or_else(None).text:
        raise CommandRejected(
            "--noisy is for the simulator that is started without a target",
            parameter="noisy",
            hint="leave out the target, or name a simulator with noisy sensors: sim://iiwa14?sensors=noisy",
        )
    if list_only:
        _list(chosen, as_json)
        return 0
    console = Console()
    stage = testing.stage(
        speed=2.0 if sim_speed is None else sim_speed, sensors="noisy" if noisy else "ideal"
    )
    with target.or_else(stage).connect(watchdog=CHECK.default, timeout=_TIMEOUT) as arm:
        if not as_json:
            console.print(
                f"{len(chosen)} scenarios on {arm.robot.title}{' (virtual)' if arm.is_virtual else ''}"
            )

        def ended(outcome: Outcome) -> None:
            if as_json:
                emit(outcome.data)
            else:
                style = _STYLES[outcome.verdict]
                console.print(f"[{style}]{outcome.verdict.value:8}[/] {outcome.scenario.name}")

        outcome = testing.run(
            arm,
            only=only,
            contact=contact,
            faults=faults,
            ask=(lambda _: True) if yes else confirm,
            on_end=ended,
        )
    if junit is not None:
        junit.write_text(outcome.junit(), encoding="utf-8")
    if as_json:
        emit({"ok": outcome.ok, "summary": outcome.summary})
    else:
        console.print(_table(outcome))
        console.print(outcome.summary)
    return 0 if outcome.ok else 1


def _list(chosen: tuple[Scenario, ...], as_json: bool) -> None:
    if as_json:
        for scenario in chosen:
            emit(
                {
                    "scenario": scenario.name,
                    "title": scenario.title,
                    "risk": scenario.risk.value,
                    "space_m": scenario.space,
                }
            )
        return
    table = Table(box=None, pad_edge=False)
    for name in ("scenario", "shows", "risk"):
        table.add_column(name, overflow="fold")
    for scenario in chosen:
        table.add_row(
            scenario.name,
            escape(scenario.title),
            f"{scenario.risk.value}{', simulator' if scenario.virtual else ''}",
        )
    Console().print(table)


def _table(report: Report) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("", "scenario", "s", "shows"):
        table.add_column(name, overflow="fold")
    for outcome in report.outcomes:
        words = outcome.scenario.title if not outcome.text else f"{outcome.scenario.title}: {outcome.text}"
        style = _STYLES[outcome.verdict]
        table.add_row(
            f"[{style}]{outcome.verdict.value}[/]",
            outcome.scenario.name,
            f"{outcome.seconds:.1f}",
            escape(words),
        )
    return table
