"""Jobs of a command: where they run, a line for each that has ended, one table at the end."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from heptarm.cli.output import emit
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.rl.pool import Job, JobResult, run_jobs
from heptarm.rl.sweep import sweep
from heptarm.values.files import unwritable

JOBS = Group("Many at once")
Seeds = Annotated[
    str, Parameter(group=JOBS, help="Several seeds, each a job of its own: 0..4 or 0,3,7. Default: --seed.")
]
Sweeps = Annotated[
    tuple[str, ...],
    Parameter(
        group=JOBS,
        help="NAME=VALUE,VALUE: a job for each value of a setting of the task, such as clearance=1e-3,2e-4; of a "
        "training also of its algorithm, such as gamma=0.95,0.97; or randomisation. Repeat it for all combinations.",
    ),
]
#: Figures that are in files and JSON alone, since they would take the whole width of a table.
_HIDDEN = ("file",)
#: Width of a table that is not on a terminal [characters].
_WIDE = 240
#: How figures are shown to people, by their names; the others as they are.
_SHOWN: dict[str, Callable[[float], str]] = {
    "success_rate": lambda value: f"{100 * value:.1f} %",
    **dict.fromkeys(("mean", "median", "p95"), lambda value: f"{1e3 * value:.2f} mm"),
    **dict.fromkeys(("time_to_reach", "time_to_reach_p95"), lambda value: f"{value:.2f} s"),
    **dict.fromkeys(("peak_force", "peak_force_median"), lambda value: f"{value:.1f} N"),
    "seconds": lambda value: f"{value:.0f} s",
}


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class JobOptions:
    """Where the jobs of a command run."""

    workers: Annotated[
        int | None,
        Parameter(group=JOBS, help="Jobs at the same time on this machine. Default: one for each processor."),
    ] = None
    ray: Annotated[
        str,
        Parameter(
            group=JOBS,
            help="Run the jobs on a Ray cluster instead: auto, HOST:PORT or ray://HOST:PORT.",
        ),
    ] = ""

    def run(
        self,
        cases: Sequence[tuple[Mapping[str, object], Job[Any]]],
        figures: Callable[[Job[Any], Any], Mapping[str, object]],
        *,
        table: Path | None = None,
        as_json: bool = False,
    ) -> int:
        """Run jobs; print what they found, and write it as a table.

        Args:
            cases: the jobs, each with what distinguishes it from the others.
            figures: what a job has found, of the job and what it returned, called as soon as it has ended; the job has
                failed if it raises a HeptarmError or an OSError.
            table: CSV file for the table; None: none.
            as_json: print a JSON object for each job as it ends, and no table.

        Returns:
            Exit code of the command: 1 if a job has failed.

        Raises:
            CommandRejected: the table cannot be written, after it has been printed.
        """
        facts = {id(job): case for case, job in cases}
        rows: dict[int, dict[str, object]] = {}
        out = sys.stdout

        def show(result: JobResult[Any]) -> None:
            found: Mapping[str, object] = {}
            error = result.error
            if not error:
                try:
                    found = figures(result.job, result.value)
                except (HeptarmError, OSError) as failure:  # such as a full disk; the others go on
                    error = str(failure)
            about = {"seconds": result.seconds, "attempts": result.attempts, "worker": result.worker}
            row = rows[id(result.job)] = {**facts[id(result.job)], **found, **about, "error": error}
            if as_json:
                emit(row, file=out)
            else:
                shown = {name: _text(name, value) for name, value in found.items()}
                how = error or ", ".join(f"{name} {text}" for name, text in shown.items())
                print(f"{len(rows)} of {len(cases)}: {result.job.name}: {how}", file=sys.stderr, flush=True)

        with redirect_stdout(sys.stderr):  # Ray prints there what befalls its machines
            run_jobs([job for _, job in cases], workers=self.workers, ray=self.ray, progress=show)
        ordered = [rows[id(job)] for _, job in cases]
        names = list(dict.fromkeys(name for row in ordered for name in row))
        if not as_json:
            found = {name for row in ordered for name, value in row.items() if value not in ("", None)}
            _print(ordered, [name for name in names if name in found and name not in _HIDDEN])
        if table is not None:
            try:
                with table.open("w", encoding="utf-8", newline="") as file:
                    writer = csv.DictWriter(file, names)
                    writer.writeheader()
                    writer.writerows(ordered)
            except OSError as failure:
                raise unwritable(table, failure, name="out") from failure
            print(f"written: {table}", file=sys.stderr)
        return int(any(row["error"] for row in ordered))


#: Nothing was given on the command line.
HERE = JobOptions()


def _print(rows: Sequence[Mapping[str, object]], names: Sequence[str]) -> None:
    table = Table(box=None, pad_edge=False)
    for name in names:
        table.add_column(name.replace("_", " "), overflow="fold")
    for row in rows:
        table.add_row(*(escape(_text(name, row.get(name))) for name in names))
    console = Console()
    if not console.is_terminal:
        console.width = _WIDE
    console.print(table)


def _text(name: str, value: object) -> str:
    if value is None:
        return "-"
    return _SHOWN[name](value) if name in _SHOWN and isinstance(value, (int, float)) else str(value)


def seeds_of(text: str, seed: int) -> list[int]:
    """Seeds of the option `--seeds`, "0..4" or "0,3,7"; of an empty text the one of `--seed`.

    Raises:
        CommandRejected: the text has another form, or both options are given.
    """
    if not text:
        return [seed]
    if seed:
        raise CommandRejected("--seed and --seeds cannot be combined", parameter="seeds", value=text)
    first, dots, last = text.partition("..")
    try:
        found = list(range(int(first), int(last) + 1)) if dots else [int(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or min(found) < 0 or len(set(found)) < len(found):
        raise CommandRejected(
            f"seeds must be different numbers such as 0..4 or 0,3,7, got {text!r}",
            parameter="seeds",
            value=text,
        )
    return found


def cases_of(seeds: str, seed: int, sweeps: Sequence[str]) -> list[tuple[int, dict[str, str]]]:
    """All combinations of seeds and values of settings.

    Raises:
        CommandRejected: a text has another form.
    """
    return [(number, chosen) for chosen in sweep(sweeps) for number in seeds_of(seeds, seed)]


def name_of(case: Mapping[str, object]) -> str:
    """Name of a job: what distinguishes it."""
    return " ".join(f"{name}={value}" for name, value in case.items())
