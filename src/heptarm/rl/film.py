"""A short film, or a row of pictures, of episodes: drawn from the recording of a report, without a graphics driver."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, LimitError, require
from heptarm.rl.report import EpisodeReport
from heptarm.rl.task import ReachTask
from heptarm.sim.picture import ArmPicture, Viewpoint
from heptarm.values.checks import flag
from heptarm.values.files import refuse_existing


def film(
    report: EpisodeReport,
    path: str | os.PathLike[str],
    *,
    episodes: int = 4,
    every: int = 2,
    overwrite: bool = False,
) -> Path:
    """Draw the first episodes of a report one after the other; return the path.

    Args:
        report: with its recording.
        path: `.gif` for a film that plays at the task's speed, `.png` for a row of pictures of the first episode.
        episodes: how many the film shows.
        every: decisions from one picture to the next.
        overwrite: replace a file that exists.

    Raises:
        MissingExtra: matplotlib (with Pillow) is not installed.
        CommandRejected: another kind of file or task, or the file exists.
        LimitError: no episodes, or no decisions.
    """
    target = Path(path)
    if target.suffix not in (".gif", ".png"):
        raise CommandRejected(f"path must end in .gif or .png, got {target.name!r}", parameter="path")
    for name, value in (("episodes", episodes), ("every", every)):
        if value < 1:
            raise LimitError(f"{name} must be at least 1, got {value}", code=2, parameter=name)
    if not isinstance(report.task, ReachTask):
        raise CommandRejected(
            f"a film is drawn of the reach task alone, got episodes of {report.task.name}",
            parameter="report",
            hint="EpisodeReport.plot draws these",
        )
    refuse_existing(target, overwrite=flag(overwrite, "overwrite"))
    figures = require("matplotlib.figure", extra="rl")
    return (
        _row(report, target, figures)
        if target.suffix == ".png"
        else _gif(report, target, figures, episodes, every)
    )


#: Of all pictures: the whole workspace in front of the arm, from its right.
_VIEWPOINT = Viewpoint(target=(0.30, 0.0, 0.50), distance=2.1, azimuth=-1.05, elevation=0.31)
_SIZE = (360, 360)


def _gif(report: EpisodeReport, target: Path, figures: Any, episodes: int, every: int) -> Path:
    animation = require("matplotlib.animation", extra="rl")
    require("PIL", extra="rl")
    figure = figures.Figure(figsize=(4.2, 4.2))
    axes = figure.add_axes((0, 0, 1, 0.93))
    arm = ArmPicture(report.task.robot, _VIEWPOINT, _SIZE)
    count = report.joints.shape[1]
    moments = [(e, t) for e in range(min(episodes, len(report.joints))) for t in range(0, count, every)]
    writer = animation.PillowWriter(fps=report.task.rate / every)
    with writer.saving(figure, str(target), dpi=80):
        for episode, step in moments:
            _draw(axes, arm, report, episode, step)
            writer.grab_frame()
    return target


def _row(report: EpisodeReport, target: Path, figures: Any, pictures: int = 6) -> Path:
    figure = figures.Figure(figsize=(3.0 * pictures, 3.2))
    arm = ArmPicture(report.task.robot, _VIEWPOINT, _SIZE)
    last = report.joints.shape[1] - 1
    # the largest motion is in the first second
    steps = np.unique(np.round(last * np.linspace(0, 1, pictures) ** 2).astype(int))
    for index, step in enumerate(steps.tolist()):
        _draw(figure.add_subplot(1, len(steps), index + 1), arm, report, 0, step)
    figure.subplots_adjust(0, 0, 1, 0.92, wspace=0)
    figure.savefig(target, dpi=80)
    return target


def _draw(axes: Any, arm: ArmPicture, report: EpisodeReport, episode: int, step: int) -> None:
    """Draw one moment: the arm, the path of its flange until then, and the target."""
    axes.clear()
    picture = arm.draw(report.joints[episode, step])
    height, width = picture.shape[:2]
    axes.imshow(picture, extent=(-0.5 * width / height, 0.5 * width / height, -0.5, 0.5))
    path, goal = report.paths[episode, : step + 1], report.targets[episode]
    axes.plot(*arm.viewpoint.seen(path)[:, :2].T, color="#1a73e8", linewidth=1.2)
    axes.plot(*arm.viewpoint.seen(goal[None])[:, :2].T, color="#d93025", marker="o", markersize=7)
    distance = float(np.linalg.norm(path[-1] - goal))
    axes.set_title(f"{step / report.task.rate:.2f} s, {1e3 * distance:.0f} mm", fontsize=10)
    axes.set(xlim=(-0.5, 0.5), ylim=(-0.5, 0.5))
    axes.set_axis_off()
