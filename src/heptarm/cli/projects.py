"""`heptarm check --projects`: which classes of a folder of Sunrise projects compile, and which applications run."""

from __future__ import annotations

import subprocess
import threading
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.markup import escape

from heptarm.cli.output import emit
from heptarm.cli.sim.child import Child, cabinet_command, first_line, relay_answers
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.sim.runtime.application import Application, Survey, find_projects, missing_options, survey
from heptarm.values.simulator_options import SimulatorOptions


class _Outcome(Enum):
    """What became of a class."""

    COMPILES = "compiles"
    FAILS = "fails"
    ENDED = "ended"
    RUNS = "runs"


_STYLES = {
    _Outcome.COMPILES: "green",
    _Outcome.ENDED: "green",
    _Outcome.RUNS: "yellow",
    _Outcome.FAILS: "red",
}


@dataclass(frozen=True, slots=True)
class _Row:
    name: str
    outcome: _Outcome
    text: str = ""


def run(folder: Path, *, jars: tuple[Path, ...], seconds: float, as_json: bool) -> int:
    """Print a line for each class of the projects in a folder; return the exit code, 1 if a class fails.

    Args:
        folder: that contains the projects.
        jars: libraries of all projects.
        seconds: longest time of each application on a virtual cabinet [s]; 0: none is run.
        as_json: print JSON.

    Raises:
        HeptarmError: there are no projects, or no compiler.
    """
    if not 0.0 <= seconds <= 3600.0:
        raise CommandRejected(
            f"--run must be in [0, 3600] s, got {seconds:g} s", parameter="run", value=seconds
        )
    console = Console()
    whole = compiled = total = failed = 0
    projects = find_projects(folder)
    for project in projects:
        with TemporaryDirectory(prefix="heptarm-") as out:
            found = survey(project, Path(out), jars=jars)
            rows = _rows(found, seconds)
        name = project.relative_to(folder.parent).as_posix()
        whole += not found.failed
        compiled += len(found.compiled)
        total += len(found.compiled) + len(found.failed)
        failed += sum(row.outcome is _Outcome.FAILS for row in rows)
        for row in rows:
            if as_json:
                emit({"project": name, "class": row.name, "outcome": row.outcome.value, "text": row.text})
            else:
                text = f"  {escape(row.text)}" if row.text else ""
                console.print(
                    f"[{_STYLES[row.outcome]}]{row.outcome.value:8}[/] {name}: {row.name}{text}",
                    soft_wrap=True,
                )
        if not as_json:
            for note in (*filter(None, [found.hint]), *missing_options(project)):
                console.print(f"         {name}: {escape(note)}", soft_wrap=True)
    if as_json:
        emit(
            {
                "projects": len(projects),
                "whole": whole,
                "classes": total,
                "compiled": compiled,
                "failed": failed,
            }
        )
    else:
        console.print(f"{whole} of {len(projects)} projects compile wholly; {compiled} of {total} classes")
    return 1 if failed else 0


def _rows(found: Survey, seconds: float) -> list[_Row]:
    rows = {name: _Row(name, _Outcome.COMPILES) for name in found.compiled}
    rows |= {name: _Row(name, _Outcome.FAILS, text) for name, text in found.failed}
    if seconds > 0.0:
        rows |= {application.main: _tried(application, seconds) for application in found.applications}
    return [rows[name] for name in sorted(rows)]


def _tried(application: Application, seconds: float) -> _Row:
    """Run an application on a virtual cabinet of its own; one that waits for a client or the operator is ended."""
    options = SimulatorOptions(
        speed=0.0,
        application=application.main,
        background=application.background,
        classpath=(str(application.classes), *map(str, application.jars)),
        project=application.project,
        station=application.station,
    )
    ran_out = threading.Event()
    with ExitStack() as stack:
        cabinet = stack.enter_context(Child(cabinet_command(options), None))
        timer = threading.Timer(seconds, _end, (cabinet, ran_out))
        stack.callback(timer.cancel)
        timer.start()
        try:
            ready = first_line(cabinet, "the virtual cabinet does not start")
            failure = str(ready.get("error", "")) or relay_answers(cabinet, as_json=True)
        except HeptarmError as error:
            failure = str(error)
        cabinet.wait()
    if ran_out.is_set():
        return _Row(application.main, _Outcome.RUNS, f"after {seconds:g} s")
    return _Row(application.main, _Outcome.FAILS if failure else _Outcome.ENDED, failure)


def _end(cabinet: subprocess.Popen[str], ran_out: threading.Event) -> None:
    ran_out.set()
    cabinet.terminate()
