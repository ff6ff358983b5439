"""`heptarm record` and `heptarm convert`: recordings to files, and from there to other formats."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from cyclopts import Parameter

from heptarm.arm.fri.settings import PORTS
from heptarm.cli.options import NO_TARGET, CommandTarget, FriListen, FriPort, FriVersion, Json, Overwrite
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.fri.loop.client import Client
from heptarm.record.convert import convert as convert_recording
from heptarm.record.demonstration import Demonstrations, SignalStatistics, load_episodes
from heptarm.record.fri_client import record_client
from heptarm.record.hdf5 import save_hdf5
from heptarm.record.lerobot import save_lerobot
from heptarm.record.recorder import Recorder
from heptarm.record.recording import Recording, load
from heptarm.values.camera import Camera
from heptarm.values.checks import within
from heptarm.values.files import refuse_existing
from heptarm.values.state import GROUP_NAMES
from heptarm.values.text import counted
from heptarm.viewers.live import LiveView
from heptarm.viewers.recorded import save_rerun

_Number = TypeVar("_Number", int, float)
CameraAsked = Annotated[
    bool,
    Parameter(negative="", help="Also record pictures of a simulated camera: of a model, no photographs."),
]
CameraSize = Annotated[str | None, Parameter(help="WIDTHxHEIGHT of its pictures [pixels]. Default: 640x480.")]
CameraRate = Annotated[float | None, Parameter(help="Pictures per second, at most 60. Default: 10.")]
CameraPlace = Annotated[
    str | None,
    Parameter(
        help="X,Y,Z of the camera [m]. Default: 1.5,-1.3,1.1. Write a negative X as --camera-place=-1,0,1."
    ),
]
CameraTarget = Annotated[str | None, Parameter(help="X,Y,Z that it looks at [m]. Default: 0.2,0,0.5.")]
CameraFrame = Annotated[
    str | None, Parameter(help="Frame of both: base, or flange, with which the camera moves. Default: base.")
]
CameraScene = Annotated[
    str | None,
    Parameter(
        help="What is around the arm: table, peg-in-hole, bins, shelf, table-and-post, cage, narrow-slot, two-arms, "
        "or a file (MJCF); nothing of it moves."
    ),
]
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
    camera: CameraAsked = False,
    camera_size: CameraSize = None,
    camera_rate: CameraRate = None,
    camera_place: CameraPlace = None,
    camera_target: CameraTarget = None,
    camera_frame: CameraFrame = None,
    camera_scene: CameraScene = None,
    listen: FriListen = False,
    fri_port: FriPort = None,
    fri_version: FriVersion = None,
    overwrite: Overwrite = False,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Record everything that a robot reports to a file, beside the program that controls it.

    With --listen it records every FRI message of the application that runs on the cabinet, and mirrors its positions.

    With --camera, or any other option of the camera, it also records pictures of a model of the arm.
    """
    limit = None if seconds is None else within(seconds, "for", 0.0, 1e7, above=True, unit="s")
    given = camera_settings(
        size=camera_size,
        rate=camera_rate,
        place=camera_place,
        target=camera_target,
        frame=camera_frame,
        scene=camera_scene,
    )
    lens = Camera(**given) if camera or given else None
    if listen:
        if lens is not None:
            raise CommandRejected(
                "a camera shows pushed states, and --listen records FRI messages alone",
                parameter="camera",
                hint="leave out --listen or the options of the camera",
            )
        settings = {"port": fri_port, "version": fri_version}
        return _record_fri(out, limit, note, settings, overwrite=overwrite, as_json=as_json)
    refuse_existing(out, overwrite=overwrite, name="out")
    with target.connect(control=False, state_rate=rate) as arm:
        offered = arm.connection.welcome.groups
        arm.subscribe(rate=rate, groups=[name for name in GROUP_NAMES if name.upper() in _names(offered)])
        with arm.record(out, camera=lens, overwrite=overwrite) as recorder:
            if not as_json:
                print(
                    f"recording {arm.robot.title} to {out}{'' if limit else '; Ctrl-C ends it'}", flush=True
                )
            wait_until_over(recorder, limit, note)
    size = out.stat().st_size
    if as_json:
        counts = {"states": recorder.states, "lost": recorder.lost}
        if lens is not None:
            counts |= {"pictures": recorder.pictures, "pictures_dropped": recorder.pictures_dropped}
        emit({"file": str(out), **counts, "bytes": size})
    else:
        drawn = f"{recorder.pictures} pictures, {recorder.pictures_dropped} dropped, " if lens else ""
        print(f"{recorder.states} states, {recorder.lost} lost, {drawn}{size / 1e6:.1f} MB in {out}")
    return 0


def camera_settings(
    *,
    size: str | None = None,
    place: str | None = None,
    target: str | None = None,
    **others: float | str | None,
) -> dict[str, Any]:
    """Arguments of a `Camera` from the options of it that were given.

    Raises:
        CommandRejected: one of them has other numbers.
    """
    pixels, metres = "WIDTHxHEIGHT in pixels, such as 640x480", "X,Y,Z in metres, such as 1.5,-1.3,1.1"
    found: dict[str, Any] = {name: value for name, value in others.items() if value is not None}
    if size is not None:
        found["size"] = numbers_of(size, "camera-size", "x", int, form=pixels)
    for name, text in (("place", place), ("target", target)):
        if text is not None:
            found[name] = numbers_of(text, f"camera-{name}", ",", float, form=metres)
    return found


def numbers_of(text: str, name: str, between: str, kind: type[_Number], *, form: str) -> tuple[_Number, ...]:
    """Numbers of an option's text, as many as its form has.

    Raises:
        CommandRejected: it has others.
    """
    try:
        found = tuple(kind(part) for part in text.split(between))
    except ValueError:
        found = ()
    if len(found) != len(form.split()[0].split(between)):
        raise CommandRejected(f"{name} must be {form}, got {text!r}", parameter=name, value=text)
    return found


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


def _record_fri(
    out: Path, limit: float | None, note: str, settings: dict[str, Any], *, overwrite: bool, as_json: bool
) -> int:
    """Record the FRI messages of any application."""
    port = settings["port"]
    with Client(PORTS[0] if port is None else port, version=settings["version"]) as client:
        with record_client(client, out, overwrite=overwrite) as recorder:
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
    return {group.name for group in kind if group & groups and group.name}  # type: ignore[attr-defined]


def convert(
    file: Annotated[Path, Parameter(help="Recording, MCAP; or a folder of episodes.")],
    out: Annotated[
        Path,
        Parameter(
            help="File to write: .parquet, .csv, .npz, or .rrd for rerun; or a folder for pictures, or a data set."
        ),
    ],
    /,
    *,
    to: Annotated[
        Literal["lerobot", "hdf5"] | None,
        Parameter(
            help="Make a data set of a folder of episodes: a folder for LeRobot (version 3.0), or an HDF5 file in the "
            "layout of robomimic."
        ),
    ] = None,
    label: Annotated[
        tuple[str, ...],
        Parameter(
            help="Of a folder of episodes, those with this label: success, failure, unlabelled, unfinished; may be "
            "repeated. Default: success."
        ),
    ] = (),
    rate: Annotated[
        float | None, Parameter(help="Steps per second of a data set [Hz]. Default: as recorded.")
    ] = None,
    arm: Annotated[str, Parameter(help="Which arm, in a recording of several.")] = "",
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Convert a recording to Parquet, CSV, NumPy or rerun, its pictures to JPEG files, or episodes to a data set.

    For example:

        heptarm convert run.mcap run.parquet

        heptarm convert insert/ data/insert --to lerobot
    """
    if to is not None:
        chosen = load_episodes(file, labels=label or ("success",), rate=rate)
        save = save_lerobot if to == "lerobot" else save_hdf5
        return _made(chosen, save(chosen, out, overwrite=overwrite), as_json=as_json)
    if label or rate is not None:
        raise CommandRejected(
            "label and rate are of data sets",
            parameter="label" if label else "rate",
            hint="give --to lerobot or --to hdf5, or leave them out",
        )
    run = load(file, arm=arm)
    if out.suffix == ".rrd":
        return _for_rerun(run, out, overwrite=overwrite, as_json=as_json)
    files = convert_recording(run, out, overwrite=overwrite)
    count = len(run.pictures)
    if as_json:
        found = {"files": [str(file) for file in files], "states": len(run), "pictures": count}
        emit(found | {"complete": run.complete})
    elif not out.suffix:
        print(f"{count} pictures in {out}")
    else:
        print(f"{len(run)} states in {', '.join(map(str, files))}")
        if count:
            print(f"{count} pictures were left out; a path without a suffix is a folder for them")
    if not as_json and not run.complete:
        print(f"{file} was cut off at its end; everything before was converted")
    return 0


def _for_rerun(run: Recording, out: Path, *, overwrite: bool, as_json: bool) -> int:
    """Write a recording for the rerun viewer."""
    save_rerun(run, out, overwrite=overwrite)
    if as_json:
        emit({"files": [str(out)], "states": len(run), "complete": run.complete})
    else:
        print(f"{len(run)} states in {out}; `rerun {out}` shows them")
    return 0


def _made(found: Demonstrations, where: Path, *, as_json: bool) -> int:
    """Report the data set that was made of episodes."""
    steps = sum(map(len, found))
    if as_json:
        unreadable = [str(path) for path in found.unreadable]
        emit({"out": str(where), "episodes": len(found), "steps": steps, "unreadable": unreadable})
    else:
        print(f"{counted(len(found), 'episode')}, {counted(steps, 'step')} in {where}")
        if found.unreadable:
            print(
                f"left out, as not readable: {counted(len(found.unreadable), 'file')}; the warnings name them"
            )
    return 0


def episodes(
    folder: Annotated[
        Path, Parameter(help="Folder of episodes, as arm.episodes or heptarm teleop records them.")
    ],
    /,
    *,
    statistics: Annotated[
        bool,
        Parameter(
            negative="", help="Also how each number is spread: least, largest, mean, standard deviation."
        ),
    ] = False,
    as_json: Json = False,
) -> int:
    """List the episodes of a folder: label, duration, steps, what was dropped or corrected.

    `heptarm panel --play FOLDER/episode-00000.mcap` plays one.
    """
    found = load_episodes(folder)
    for episode in found:
        if as_json:
            emit(
                {
                    "file": str(episode.path),
                    "label": episode.label,
                    "reason": episode.reason,
                    "task": episode.task,
                }
                | {"duration": episode.duration, "steps": len(episode), "dropped": dict(episode.dropped)}
                | {"corrected": int(episode.corrected.sum())}
            )
        else:
            print(episode)
    if not as_json:
        print(found)
    if statistics:
        _show(found.statistics(), as_json=as_json)
    return 0


def _show(statistics: Mapping[str, SignalStatistics], *, as_json: bool) -> None:
    """Show how the numbers of a set are spread."""
    columns = ("min", "max", "mean", "std")
    if as_json:
        rows = {
            name: {column: getattr(spread, column).tolist() for column in columns}
            for name, spread in statistics.items()
        }
        emit({"statistics": rows})
        return
    print("".join([f"{'':14}", *(f"{column:>11}" for column in columns)]))
    for name, spread in statistics.items():
        for number in range(len(spread.min)):
            label = name if len(spread.min) == 1 else f"{name}[{number}]"
            print(f"{label:14}" + "".join(f"{getattr(spread, column)[number]:11.4g}" for column in columns))
