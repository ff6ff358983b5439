"""`heptarm sim` and `heptarm demo`, and what a cabinet is made of."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from heptarm.cli.app import FRI, Json, Target, app

_APP = Group("Your own application")


@app.command
def sim(
    *,
    model: Annotated[Literal["iiwa7", "iiwa14"], Parameter(help="Robot.")] = "iiwa14",
    host: Annotated[str, Parameter(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, Parameter(help="Port; 0 takes a free one.")] = 30001,
    speed: Annotated[float, Parameter(help="Simulated seconds per second.")] = 1.0,
    view: Annotated[bool, Parameter(negative="", help="Open a live 3D view in the browser.")] = False,
    view_port: Annotated[int, Parameter(help="Port of the view; 0 takes a free one.")] = 8080,
    key: Annotated[str, Parameter(help="Pre-shared key that clients must know.")] = "",
    fault: Annotated[
        tuple[str, ...],
        Parameter(
            help="Let something go wrong at a simulated time, as NAME@SECONDS: emergency_stop, operator_safety, "
            "protective_stop, drive_error, joint_limit, singularity, t1, release, clear ...; may be given again. "
            "The same words can be typed while it runs."
        ),
    ] = (),
    payload: Annotated[
        str,
        Parameter(
            help="MASS or MASS,X,Y,Z: hangs on the flange whatever the controller is told [kg, m]. "
            "Default: what it is told."
        ),
    ] = "",
    project: Annotated[
        Path | None,
        Parameter(help="RoboticsAPI.data.xml of a Sunrise project: process data, tool templates, frames."),
    ] = None,
    verbose: Annotated[bool, Parameter(negative="", help="Show the cabinet's log.")] = False,
    application: Annotated[
        Path | None,
        Parameter(
            name="--app", group=_APP, help="Compile and run this folder's Sunrise application instead."
        ),
    ] = None,
    app_class: Annotated[
        str, Parameter(group=_APP, help="Its class, where there are several applications.")
    ] = "",
    app_data: Annotated[
        tuple[str, ...], Parameter(group=_APP, help="Process data as NAME=VALUE; may be given again.")
    ] = (),
    fri: Annotated[
        str | None,
        Parameter(
            group=FRI, help="Instead of a cabinet only its FRI, of this version, such as 1.15, 2.5 or 2.7."
        ),
    ] = None,
    fri_command: Annotated[
        Literal["monitor", "position", "torque", "wrench", "pose"],
        Parameter(group=FRI, help="What the client may command."),
    ] = "position",
    fri_client: Annotated[
        str, Parameter(group=FRI, help="HOST:PORT where the client listens.")
    ] = "127.0.0.1:30200",
    fri_period: Annotated[float, Parameter(group=FRI, help="Time between two messages [ms].")] = 5.0,
    fri_multiplier: Annotated[int, Parameter(group=FRI, help="The client answers every n-th message.")] = 1,
    fri_port: Annotated[
        int | None,
        Parameter(group=FRI, help="UDP port to send from. Default: the client's or its neighbour."),
    ] = None,
    fri_io: Annotated[
        tuple[str, ...],
        Parameter(
            group=FRI,
            help="GROUP.NAME<TYPE is an input that the client reads, GROUP.NAME>TYPE an output that it writes, "
            "TYPE bool, u8 (or other bits) or analog; may be given again. Type `set GROUP.NAME VALUE` while it runs.",
        ),
    ] = (),
    fri_frame: Annotated[
        tuple[str, ...],
        Parameter(group=FRI, help="Name of a frame that the client is asked for; may be given again."),
    ] = (),
    json: Json = False,
) -> int:
    """Run a virtual cabinet until Ctrl-C; with --fri, a bare FRI controller; with --app, your own application."""
    if application is not None:
        from heptarm.cli import sim as cabinet

        return cabinet.run_application(
            folder=application, main=app_class, data=app_data, model=model, speed=speed, as_json=json
        )
    if fri is not None:
        from heptarm.cli import fri as controller

        return controller.run(
            version=fri,
            model=model,
            command=fri_command,
            client=fri_client,
            period=fri_period,
            multiplier=fri_multiplier,
            port=fri_port,
            signals=fri_io,
            frames=fri_frame,
            speed=speed,
            verbose=verbose,
            as_json=json,
        )
    from heptarm.cli import sim as work

    return work.run(
        model=model,
        host=host,
        port=port,
        speed=speed,
        view=view,
        view_port=view_port,
        key=key,
        faults=fault,
        payload=payload,
        project=project,
        verbose=verbose,
        as_json=json,
    )


@app.command(name="install-cabinet")
def install_cabinet(
    *,
    out: Annotated[Path, Parameter(help="Folder to write; must be new or empty.")],
    json: Json = False,
) -> int:
    """Write the cabinet application for a Sunrise project, with the steps."""
    from heptarm.cli import install_cabinet as work

    return work.run(out=out, as_json=json)


@app.command
def demo(
    *,
    plot: Annotated[Path, Parameter(help="Where to save the plot.")] = Path("heptarm-demo.png"),
    target: Target = None,
    json: Json = False,
) -> int:
    """Move a virtual arm through the whole stack; a table and a plot show how it went."""
    from heptarm.cli import demo as work

    return work.run(target=target, plot=plot, as_json=json)
