"""`heptarm plot`: a recording as a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import Json, Overwrite
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.record import plot as plots
from heptarm.record.plot.content import Style
from heptarm.record.plot.signals import Kind
from heptarm.record.recording import load
from heptarm.values.files import refuse_existing


def plot(
    file: Annotated[Path, Parameter(help="Recording, MCAP.")],
    /,
    *,
    signals: Annotated[
        str, Parameter(help="Names with commas between, such as q,wrench,path. Default: the usual ones.")
    ] = "",
    out: Annotated[
        Path | None,
        Parameter(
            name=["--out", "-o"],
            help="File to write: .png, .svg, .pdf or .html. Default: beside the recording.",
        ),
    ] = None,
    arm: Annotated[str, Parameter(help="Which arm, in a recording of several.")] = "",
    kind: Annotated[
        Kind, Parameter(help="Over time, how often each value occurs, or amplitude over frequency.")
    ] = "time",
    style: Annotated[
        Style, Parameter(help="For the screen, or one column of a journal, as .pdf or .svg.")
    ] = "screen",
    compare: Annotated[
        tuple[Path, ...], Parameter(help="Another recording, drawn on the first one; up to three.")
    ] = (),
    at: Annotated[
        str,
        Parameter(
            help="Compare from this note or event on, such as ConditionFired. Default: the first motion."
        ),
    ] = "",
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Plot a recording: joints, speeds and torques by their limits, wrench, path; motions and events as bands.

    With .html: an interactive page that needs no network.
    """
    names = tuple(name.strip() for name in signals.split(",") if name.strip())
    target = file.with_suffix(".pdf" if style == "paper" else ".png") if out is None else out
    refuse_existing(target, overwrite=overwrite, name="out")
    run = load(file, arm=arm)
    if compare:
        others = [load(other, arm=arm) for other in compare]
        chart = plots.compare([run, *others], signals=names, kind=kind, at=at)
    elif at:
        raise CommandRejected(
            "at must be given with compare",
            parameter="at",
            value=at,
            hint="heptarm plot run.mcap --compare other.mcap --at NAME",
        )
    else:
        chart = plots.chart_of(run, signals=names, kind=kind)
    written = chart.save(target, style=style, overwrite=overwrite)
    if as_json:
        emit(
            {
                "file": str(written),
                "states": len(run),
                "duration_s": run.duration,
                "motions": len(run.motions),
            }
        )
    else:
        print(f"{run}\n{written}")
    return 0
