"""`heptarm plot`: a recording as a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import Json, Overwrite
from heptarm.cli.output import emit
from heptarm.record import plot as plots
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
    compare: Annotated[Path | None, Parameter(help="A second recording, drawn on the first one.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Plot a recording: joints, speeds and torques by their limits, wrench, path; motions and events as bands."""
    names = tuple(name.strip() for name in signals.split(",") if name.strip())
    target = file.with_suffix(".png") if out is None else out
    refuse_existing(target, overwrite=overwrite, name="out")
    run = load(file, arm=arm)
    figure = (
        plots.figure_of(run, names) if compare is None else plots.compare(run, load(compare, arm=arm), names)
    )
    written = plots.save(figure, target, overwrite=overwrite)
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
