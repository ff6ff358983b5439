"""`heptarm record` and `heptarm convert`: recordings to files, and from there to other formats."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from heptarm.arm.fri.settings import PORTS
from heptarm.cli.options import NO_TARGET, CommandTarget, FriListen, FriPort, FriVersion, Json
from heptarm.cli.output import emit
from heptarm.fri.loop.client import Client
from heptarm.record.convert import convert as convert_recording
from heptarm.record.fri_client import record_client
from heptarm.record.recorder import Recorder
from heptarm.record.recording import load
from heptarm.values.arrays import within
from heptarm.values.state import GROUP_NAMES
from heptarm.viewers.live import LiveView

#: Pause between two looks whether the time is over [s].
_PAUSE = 0.1


def record(
    out: Annotated[Path, Parameter(help="File to write, MCAP.")] = Path("run.mcap"),
    /,
    *,
    rate: Annotated[float, Parameter(help="States per second; a real cabinet pushes about 100.")] = 100.0,
    seconds: Annotated[
        float | None, Parameter(name="--for", help="How long [s]. Default: until Ctrl-C.")
    ] = None,
    note: Annotated[str, Parameter(help="A mark at the beginning.")] = "",
    listen: FriListen = False,
    fri_port: FriPort = None,
    fri_version: FriVersion = None,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Record everything that a robot reports to a file, beside the program that controls it.

    With --listen it records every FRI message of the application that runs on the cabinet, and mirrors its positions.
    """
    limit = None if seconds is None else within(seconds, "for", 0.0, 1e7, above=True, unit="s")
    if listen:
        return _record_fri(out, limit, note, {"port": fri_port, "version": fri_version}, as_json=as_json)
    with target.connect(control=False, state_rate=rate) as arm:
        offered = arm.connection.welcome.groups
        arm.subscribe(rate=rate, groups=[name for name in GROUP_NAMES if name.upper() in _names(offered)])
        with arm.record(out) as recorder:
            if not as_json:
                print(
                    f"recording {arm.robot.title} to {out}{'' if limit else '; Ctrl-C ends it'}", flush=True
                )
            wait_until_over(recorder, limit, note)
    size = out.stat().st_size
    if as_json:
        emit({"file": str(out), "states": recorder.states, "lost": recorder.lost, "bytes": size})
    else:
        print(f"{recorder.states} states, {recorder.lost} lost, {size / 1e6:.1f} MB in {out}")
    return 0


def wait_until_over(recorder: Recorder | LiveView, limit: float | None, note: str = "") -> None:
    """Let a recorder or a view run for so many seconds, None: until Ctrl-C; with a mark at the beginning."""
    if note:
        recorder.note(note)
    began = time.monotonic()
    try:
        while recorder.is_running and (limit is None or time.monotonic() - began < limit):
            time.sleep(_PAUSE if limit is None else min(_PAUSE, max(0.0, began + limit - time.monotonic())))
    except KeyboardInterrupt:
        pass


def _record_fri(out: Path, limit: float | None, note: str, settings: dict[str, Any], *, as_json: bool) -> int:
    """Record the FRI messages of any application."""
    port = settings["port"]
    with Client(PORTS[0] if port is None else port, version=settings["version"]) as client:
        with record_client(client, out) as recorder:
            if not as_json:
                ending = "" if limit else "; Ctrl-C ends it"
                print(f"recording FRI on UDP port {client.port} to {out}{ending}", flush=True)
            wait_until_over(recorder, limit, note)
        cycles = client.count
    size = out.stat().st_size
    if as_json:
        emit({"file": str(out), "cycles": cycles, "lost": recorder.lost, "bytes": size})
    else:
        print(f"{cycles} cycles, {recorder.lost} lost, {size / 1e6:.1f} MB in {out}")
    return 0


def _names(groups: object) -> set[str]:
    """Names of the flags that are set."""
    kind = type(groups)
    return {one.name for one in kind if one & groups and one.name}  # type: ignore[attr-defined]


def convert(
    file: Annotated[Path, Parameter(help="Recording, MCAP.")],
    out: Annotated[Path, Parameter(help="File to write: .parquet, .csv or .npz.")],
    /,
    *,
    arm: Annotated[str, Parameter(help="Which arm, in a recording of several.")] = "",
    as_json: Json = False,
) -> int:
    """Convert a recording to Parquet, CSV or NumPy."""
    run = load(file, arm=arm)
    files = convert_recording(run, out)
    if as_json:
        emit({"files": [str(one) for one in files], "states": len(run), "complete": run.complete})
    else:
        print(f"{len(run)} states in {', '.join(map(str, files))}")
        if not run.complete:
            print(f"{file} was cut off at its end; everything before was converted")
    return 0
