"""`heptarm live`: an arm in the rerun viewer while it moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import NO_TARGET, CommandTarget, Json, Overwrite
from heptarm.cli.output import emit
from heptarm.cli.record import wait_until_over
from heptarm.errors import require
from heptarm.panel.model import groups_for
from heptarm.values.checks import within
from heptarm.values.files import refuse_existing
from heptarm.viewers.live import live as live_view


def live(
    *,
    rerun: Annotated[
        bool,
        Parameter(
            negative="", help="Open the rerun viewer here. Default: if neither --save nor --to is given."
        ),
    ] = False,
    save: Annotated[Path | None, Parameter(help="File to write, .rrd; `rerun FILE` opens it.")] = None,
    to: Annotated[
        str,
        Parameter(help="URL of a viewer that runs elsewhere, such as rerun+http://192.168.0.5:9876/proxy."),
    ] = "",
    rate: Annotated[float, Parameter(help="States per second; a real cabinet pushes about 100.")] = 100.0,
    seconds: Annotated[
        float | None, Parameter(name="--for", help="How long [s]. Default: until Ctrl-C.")
    ] = None,
    target: CommandTarget = NO_TARGET,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Show a robot in the rerun viewer while it moves, beside the program that controls it.

    For example:

        heptarm live --rerun

        heptarm live --save run.rrd --for 30
    """
    limit = None if seconds is None else within(seconds, "for", 0.0, 1e7, above=True, unit="s")
    require("rerun", extra="rerun")
    if save is not None:
        refuse_existing(save, overwrite=overwrite, name="save")
    with target.connect(control=False, state_rate=rate) as arm:
        arm.subscribe(rate=rate, groups=groups_for(arm.connection.welcome.groups))
        with live_view(arm, save=save, to=to, viewer=True if rerun else None, overwrite=overwrite) as view:
            if not as_json:
                places = [str(save)] * (save is not None) + [to] * bool(to)
                if rerun or not places:
                    places.insert(0, "the rerun viewer")
                print(
                    f"showing {arm.robot.title} in {' and '.join(places)}"
                    f"{'' if limit else '; Ctrl-C ends it'}",
                    flush=True,
                )
            wait_until_over(view, limit)
    if as_json:
        size = None if save is None else save.stat().st_size
        emit({"states": view.states, "lost": view.lost, "file": str(save or "") or None, "bytes": size})
    else:
        print(f"{view.states} states, {view.lost} lost")
    return 0
