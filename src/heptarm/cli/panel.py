"""`heptarm panel`: a page in the browser for looking at arms and jogging them."""

from __future__ import annotations

import signal
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import NO_TARGETS, CommandTargets, Json
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected, require
from heptarm.panel.guard import free_port, is_local
from heptarm.panel.model import PanelArm
from heptarm.panel.player import open_player
from heptarm.panel.process import STATE_RATE, Panel, PanelOptions, model_of


def panel(
    *,
    host: Annotated[str, Parameter(help="Address to listen on; 0.0.0.0 lets in the network.")] = "127.0.0.1",
    port: Annotated[int, Parameter(help="Port; 0 takes a free one.")] = 8080,
    read_only: Annotated[bool, Parameter(negative="", help="Look and stop only; no control.")] = False,
    allow_control: Annotated[
        bool,
        Parameter(
            negative="",
            help="Let pages control the arms although the panel listens beyond this machine. Who has the URL then "
            "moves the robot.",
        ),
    ] = False,
    scene: Annotated[str, Parameter(help="NAME or FILE (MJCF) of what is drawn around the first arm.")] = "",
    meshes: Annotated[
        str, Parameter(help="DIR with link_0.stl to link_7.stl, or .obj, in place of heptarm's own.")
    ] = "",
    recordings: Annotated[Path, Parameter(help="Folder for recordings.")] = Path(),
    gripper: Annotated[
        str,
        Parameter(
            help='Signals of a gripper: "open=OUTPUT close=OUTPUT is_open=INPUT is_closed=INPUT", those that are not '
            "named on the media flange. Default: the gripper of the scene."
        ),
    ] = "",
    light: Annotated[bool, Parameter(negative="", help="A light page instead of a dark one.")] = False,
    play: Annotated[
        Path | None,
        Parameter(
            help="Play this recording (MCAP), or the episodes of this folder, instead of connecting to an arm; a "
            "recording that heptarm twin --save wrote has the twin as a ghost."
        ),
    ] = None,
    target: CommandTargets = NO_TARGETS,
    as_json: Json = False,
) -> int:
    """Open a page in the browser for looking at arms and jogging them; runs until Ctrl-C.

    For example:

        heptarm panel --target sim://iiwa14

        heptarm panel --play run.mcap
    """
    require("viser", extra="viz")
    options = PanelOptions(
        host=host,
        port=port,
        allow_control=allow_control,
        read_only=read_only,
        scene=scene,
        meshes=meshes,
        recordings=recordings,
        gripper=gripper,
        light=light,
    )
    if allow_control and read_only:
        raise CommandRejected(
            "--allow-control and --read-only contradict each other",
            parameter="read-only",
            hint="give one of them",
        )
    free_port(host, port)  # before a simulator starts
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if play is not None:
        return _play(play, options, as_json=as_json)
    with ExitStack() as stack:
        models: list[PanelArm] = []
        for text, own in target.each():
            arm = stack.enter_context(own.connect(control=False, state_rate=STATE_RATE))
            alone = replace(options, scene="", gripper="")  # these are the first arm's
            models.append(model_of(arm, text, alone if models else options))
        page = Panel(models, options)
        stack.callback(page.close)
        if as_json:
            emit({"panel": page.url, "may_control": options.may_control})
        else:
            print(f"The panel is at {page.url}")
            if not options.may_control and not read_only:
                print(
                    "It only shows, since it listens beyond this machine; --allow-control lets its pages move the arm."
                )
            elif options.may_control and not is_local(host):
                print("Who has this URL moves the robot. The connection is not encrypted.")
            print("Ctrl-C ends it.", flush=True)
        try:
            page.run()
        except KeyboardInterrupt:
            pass
    return 0


def _play(file: Path, options: PanelOptions, *, as_json: bool) -> int:
    """Play a recording until Ctrl-C."""
    player = open_player(file, options)
    if as_json:
        emit({"panel": player.url, "may_control": False})
    else:
        print(f"{file} plays at {player.url}\nCtrl-C ends it.", flush=True)
    try:
        player.run()
    except KeyboardInterrupt:
        pass
    finally:
        player.close()
    return 0
