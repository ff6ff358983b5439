"""`heptarm check --commission`: asks the person beside the robot, shows each step, and writes the report."""

from __future__ import annotations

import datetime
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from heptarm.arm.arm import Arm
from heptarm.arm.watchdog import CHECK
from heptarm.cli.options import CommandTarget
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.testing.commissioning import (
    Agreement,
    AskedPerson,
    CommissioningReport,
    Person,
    SimulatedPerson,
    commission,
    find_steps,
)
from heptarm.testing.stage import has_operator
from heptarm.values.files import writable_file

_TIMEOUT = 20.0
_STYLES = {Agreement.AGREES: "green", Agreement.DIFFERS: "red", Agreement.SKIPPED: "yellow"}


def run(
    only: Sequence[str],
    target: CommandTarget,
    *,
    file: Path | None,
    overwrite: bool,
    list_only: bool,
    yes: bool,
    as_json: bool,
) -> int:
    """Run the steps, or list them; the exit code is 1 if one differs.

    Raises:
        CommandRejected: there is no such step, the report exists, or nobody can be asked on a real robot.
        ModeConflict: the robot is not in T1.
    """
    chosen = find_steps(only)
    if list_only:
        table = Table(box=None, pad_edge=False)
        for name in ("step", "settles", "moves"):
            table.add_column(name, overflow="fold")
        for step in chosen:
            moves = step.movement
            text = "" if moves is None else f"{moves.what}, {moves.far}, {moves.fast}"
            if as_json:
                emit({"step": step.name, "question": step.question, "moves": text})
            table.add_row(step.name, escape(step.question), escape(text))
        if not as_json:
            Console().print(table)
        return 0
    console = Console()
    with target.connect(watchdog=CHECK.default, timeout=_TIMEOUT) as arm:
        base = file or Path(_default_name(arm))
        for suffix in ("md", "json"):
            writable_file(_with(base, suffix), overwrite=overwrite, name="report")

        def ended(report: CommissioningReport) -> None:
            _write(base, report)
            last = report.outcomes[-1]
            if as_json:
                emit(last.data)
                return
            style = _STYLES[last.verdict]
            console.print(f"[{style}]{last.verdict.value:8}[/] {last.step.name}  {escape(last.text)}")
            for comparison in last.comparisons:
                agrees = "" if comparison.agrees else "[red]differs[/] "
                words = f"{comparison.quantity}: {comparison.measured} (expected: {comparison.expected})"
                console.print(f"         {agrees}{escape(words)}")

        report = commission(arm, person(arm, yes=yes, console=console), only=only, on_end=ended)
    if as_json:
        emit({"ok": report.ok, "summary": report.summary, "report": str(base)})
    else:
        console.print(f"{report.summary}; written to {_with(base, 'md')} and {_with(base, 'json')}")
    return 0 if report.count(Agreement.DIFFERS) == 0 else 1


def person(arm: Arm, *, yes: bool, console: Console) -> Person:
    """Who is beside the robot.

    Raises:
        CommandRejected: `--yes` on a real robot, or no terminal.
    """
    if yes and not arm.is_virtual:
        raise CommandRejected(
            "--yes is refused with --commission on a real robot: a person beside it answers each question",
            parameter="yes",
            hint="leave out --yes",
        )
    if yes or has_operator(arm):
        return SimulatedPerson(arm)
    if not sys.stdin.isatty():
        raise CommandRejected(
            "--commission needs a terminal at which a person answers",
            parameter="commission",
            hint="run it in a terminal beside the robot; --yes is for a virtual cabinet",
        )
    return AskedPerson(input, lambda words: console.print(escape(words)))


def _default_name(arm: Arm) -> str:
    robot = re.sub(r"[^a-z0-9]+", "-", arm.robot.title.lower()).strip("-")
    return f"commissioning-{robot}-{datetime.date.today().isoformat()}"


def _with(base: Path, suffix: str) -> Path:
    """A file beside others of the same base name, whatever suffix was given."""
    given = base.with_suffix("") if base.suffix in (".md", ".json") else base
    return given.with_name(f"{given.name}.{suffix}")


def _write(base: Path, report: CommissioningReport) -> None:
    _with(base, "md").write_text(report.markdown(), encoding="utf-8")
    _with(base, "json").write_text(report.json(), encoding="utf-8")
