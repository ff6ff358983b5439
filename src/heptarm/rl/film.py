"""A short film, or a row of pictures, of episodes: drawn from the recording of a report with matplotlib alone."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, LimitError, require
from heptarm.rl.report import EpisodeReport
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

_SILVER, _ORANGE = "#9aa0a6", "#ff6a13"
#: Thickness of the links as drawn [points].
_WIDTHS = (13.0, 11.0, 9.0, 7.0)


def film(report: EpisodeReport, path: str | os.PathLike[str], *, episodes: int = 4, every: int = 2) -> Path:
    """Draw the first episodes of a report one after the other; return the path.

    Args:
        report: with its recording.
        path: `.gif` for a film that plays at the task's speed, `.png` for a row of pictures of the first episode.
        episodes: how many the film shows.
        every: decisions from one picture to the next.

    Raises:
        MissingExtra: matplotlib (with Pillow) is not installed.
        CommandRejected: another kind of file.
        LimitError: no episodes, or no decisions.
    """
    target = Path(path)
    if target.suffix not in (".gif", ".png"):
        raise CommandRejected(f"path must end in .gif or .png, got {target.name!r}", parameter="path")
    for name, value in (("episodes", episodes), ("every", every)):
        if value < 1:
            raise LimitError(f"{name} must be at least 1, got {value}", code=2, parameter=name)
    figures = require("matplotlib.figure", extra="rl")
    return (
        _row(report, target, figures)
        if target.suffix == ".png"
        else _gif(report, target, figures, episodes, every)
    )


def _gif(report: EpisodeReport, target: Path, figures: Any, episodes: int, every: int) -> Path:
    animation = require("matplotlib.animation", extra="rl")
    require("PIL", extra="rl")
    figure = figures.Figure(figsize=(4.2, 4.2))
    axes = figure.add_subplot(projection="3d")
    figure.subplots_adjust(0, 0, 1, 1)
    count = report.joints.shape[1]
    moments = [(e, t) for e in range(min(episodes, len(report.joints))) for t in range(0, count, every)]
    writer = animation.PillowWriter(fps=report.task.rate / every)
    with writer.saving(figure, str(target), dpi=80):
        for episode, step in moments:
            _draw(axes, report, episode, step)
            writer.grab_frame()
    return target


def _row(report: EpisodeReport, target: Path, figures: Any, pictures: int = 6) -> Path:
    figure = figures.Figure(figsize=(3.0 * pictures, 3.2))
    last = report.joints.shape[1] - 1
    # the largest motion is in the first second
    steps = np.unique(np.round(last * np.linspace(0, 1, pictures) ** 2).astype(int))
    for index, step in enumerate(steps.tolist()):
        axes = figure.add_subplot(1, len(steps), index + 1, projection="3d")
        _draw(axes, report, 0, step)
    figure.subplots_adjust(0, 0, 1, 0.95, wspace=0)
    figure.savefig(target, dpi=80)
    return target


def _draw(axes: Any, report: EpisodeReport, episode: int, step: int) -> None:
    axes.clear()
    points = chain(report.task.model, report.joints[episode, step])
    for index, width in enumerate(_WIDTHS):
        piece = points[index : index + 2].T
        axes.plot(*piece, color=_SILVER, linewidth=width, solid_capstyle="round")
        axes.plot(*piece[:, :1], color=_ORANGE, marker="o", markersize=0.9 * width)
    axes.plot(*report.paths[episode, : step + 1].T, color="#1a73e8", linewidth=1.2)
    axes.plot(*report.targets[episode][:, None], color="#d93025", marker="o", markersize=7)
    distance = report.task.distance(report.paths[episode, step], report.targets[episode])
    axes.set_title(f"{step / report.task.rate:.2f} s, {1e3 * float(distance):.0f} mm", y=0.96, fontsize=10)
    axes.set(xlim=(-0.25, 0.85), ylim=(-0.55, 0.55), zlim=(0.0, 1.1))
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.view_init(elev=18, azim=-60)
    axes.set_axis_off()


def chain(robot: RobotModel, q: Array) -> Array:
    """Positions of base, shoulder, elbow, wrist and flange at joint positions q [rad], shape (5, 3) [m]."""
    turn, points = np.eye(3), [np.zeros(3), np.array([0.0, 0.0, robot.d_bs])]
    axes = "zyzyzyz"
    signs = (1, 1, 1, -1, 1, 1, 1)
    for index, (axis, sign) in enumerate(zip(axes, signs, strict=True)):
        turn = turn @ _rotation(axis, sign * float(q[index]))
        length = {1: robot.d_se, 3: robot.d_ew, 6: robot.d_wf}.get(index)
        if length is not None:
            points.append(points[-1] + length * turn[:, 2])
    return np.array(points)


def _rotation(axis: str, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    if axis == "z":
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return np.array([[c, 0, s], [0, 1.0, 0], [-s, 0, c]])
