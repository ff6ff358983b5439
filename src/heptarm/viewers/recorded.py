"""Recordings for rerun: what the live view shows of an arm while it moves, of one that was recorded, with pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.record.demonstration import in_steps
from heptarm.record.episodes import LABEL, NUMBER
from heptarm.record.recording import Recording
from heptarm.values.checks import Array, flag, instance
from heptarm.values.files import path_of, refuse_existing, unwritable
from heptarm.viewers.live import blueprint

#: Entity that everything is below.
_NAME = "arm"


def save_rerun(recording: Recording, file: str | Path, *, overwrite: bool = False) -> Path:
    """Write a recording as a file of the rerun viewer, .rrd: `rerun FILE` opens it. Returns the file.

    Beside what `heptarm.live` shows it has streams below `stream`, pictures below `camera`, and of an episode the
    actions of its steps and its label. Times are from its beginning, on the time line "time".

    Args:
        recording: of a known robot.
        file: to write.
        overwrite: replace a file that is there.

    Raises:
        CommandRejected: the robot is unknown, there are no states, or the file exists or cannot be written.
        MissingExtra: the package rerun or mujoco is not installed.
    """
    run = instance(recording, Recording, "recording")
    path = refuse_existing(path_of(file, "file"), overwrite=flag(overwrite, "overwrite"), name="file")
    if run.robot is None or not len(run):
        raise CommandRejected(
            f"{run.path.name} cannot be shown: it has no states of a known robot",
            parameter="recording",
            value=str(run.path),
        )
    require("mujoco", extra="rerun")
    rerun = require("rerun", extra="rerun")
    from heptarm.viewers.rerun_stream import RerunStream

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise unwritable(path, error, name="file") from error
    stream = rerun.RecordingStream("heptarm")
    pictures = {**run.views, **({"simulated": run.pictures} if len(run.pictures) else {})}
    stream.set_sinks(
        rerun.FileSink(str(path)), default_blueprint=_blueprint(tuple(pictures), tuple(run.streams))
    )
    out = RerunStream(stream, run.robot.name, name=_NAME, epoch=None)
    out.signals(_nanos(run.t), run.signals)
    for name, numbers in run.streams.items():
        out.numbers(f"stream/{name}", _nanos(numbers.t), numbers.values)
    for name, view in pictures.items():
        out.pictures(f"camera/{name}", _nanos(view.t), view.files)
    lines = [(event.t, event.text) for event in run.events if event.kind != "signals"]
    if NUMBER in run.facts:
        steps = in_steps(run)
        if len(steps):
            out.numbers("action", _nanos(steps.t), steps.action)
        lines.append((float(run.t[-1]), f"label: {run.outcome.get(LABEL, 'unfinished')}"))
    if lines:
        out.text("events", _nanos(np.array([t for t, _ in lines])), [text for _, text in lines])
    out.finish({})
    return path


def _blueprint(cameras: Sequence[str], streams: Sequence[str]) -> Any:
    """What the viewer shows first: the view of a live arm, pictures, and plots of the streams."""
    views = require("rerun.blueprint", extra="rerun")
    more = [views.Spatial2DView(origin=f"/{_NAME}/camera/{name}", name=name) for name in cameras]
    more += [views.TimeSeriesView(origin=f"/{_NAME}/stream/{name}", name=name) for name in streams]
    return blueprint((_NAME,), more=more)


def _nanos(t: Array) -> npt.NDArray[np.int64]:
    return np.round(np.asarray(t) * 1e9).astype(np.int64)
