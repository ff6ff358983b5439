"""Report of episodes of a policy, simulated or real: figures, a plot, and the recording."""

from __future__ import annotations

import json
import os
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError, require
from heptarm.rl.tasks import Task, task_from_dict
from heptarm.values.checks import Array, flag, frozen
from heptarm.values.files import read_arrays, refuse_existing, unreadable


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeReport:
    """Record of n episodes of a policy, of t decisions each.

    Attributes:
        task: the task.
        targets: as the task draws them, shape (n, m): points in the base frame [m], or where holes truly are in the
            frame of the presumed one [m, rad].
        distances: from the target after each decision, or depth that is missing, shape (n, t) [m].
        paths: of the flange, or of the tool's tip, with where it began, shape (n, t + 1, 3) [m].
        joints: measured positions, with where it began, shape (n, t + 1, 7) [rad]; for a film.
        forces: on the tip, the mean of each decision, shape (n, t) [N]; empty: all 0.
        facts: where and how: engine, randomisation, seed.
    """

    task: Task
    targets: Array
    distances: Array
    paths: Array
    _: KW_ONLY
    joints: Array
    forces: Array = field(default_factory=lambda: np.zeros(0))
    facts: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not np.size(self.forces):
            object.__setattr__(self, "forces", np.zeros(np.shape(self.distances)))
        for name in ("targets", "distances", "paths", "joints", "forces"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=np.float64)))
        n, t = self.distances.shape if self.distances.ndim == 2 else (0, 0)
        if (
            not n
            or not t
            or self.targets.ndim != 2
            or len(self.targets) != n
            or self.paths.shape != (n, t + 1, 3)
            or self.joints.shape != (n, t + 1, 7)
            or np.shape(self.forces) != (n, t)
        ):
            names = ("distances", "targets", "paths", "joints", "forces")
            shapes = ", ".join(f"{name} {np.shape(getattr(self, name))}" for name in names)
            raise ShapeError(f"{shapes} do not belong to the same episodes")

    @property
    def final(self) -> Array:
        """Distance at the end, shape (n,) [m]."""
        return self.distances[:, -1]

    @property
    def time_to_reach(self) -> Array:
        """Time at which the flange first was within the radius, shape (n,) [s]; inf: never."""
        near = self.distances <= self.task.radius
        return np.where(near.any(axis=1), (near.argmax(axis=1) + 1) / self.task.rate, np.inf)

    @property
    def success(self) -> npt.NDArray[np.bool_]:
        """Whether an episode ended within the radius, shape (n,)."""
        result: npt.NDArray[np.bool_] = self.final <= self.task.radius
        return result

    @property
    def success_rate(self) -> float:
        """Fraction of `success`."""
        return float(self.success.mean())

    @property
    def mean(self) -> float:
        """Of the final distances [m]."""
        return float(self.final.mean())

    @property
    def median(self) -> float:
        """Of the final distances [m]."""
        return float(np.median(self.final))

    @property
    def p95(self) -> float:
        """95th percentile of the final distances [m]."""
        return float(np.percentile(self.final, 95))

    @property
    def peak_force(self) -> Array:
        """Largest force of each episode, shape (n,) [N]."""
        result: Array = self.forces.max(axis=1)
        return result

    def reached_within(self, seconds: float) -> float:
        """Fraction of the episodes that reached the radius within a time."""
        return float((self.time_to_reach <= seconds + 1e-9).mean())

    def as_dict(self) -> dict[str, Any]:
        """The figures, for a file; None: never reached."""
        reached = self.time_to_reach[np.isfinite(self.time_to_reach)]
        return {
            "episodes": len(self.final),
            "radius": self.task.radius,
            "success_rate": self.success_rate,
            "mean": self.mean,
            "median": self.median,
            "p95": self.p95,
            "worst": float(self.final.max()),
            "time_to_reach": float(np.median(reached)) if len(reached) else None,
            "time_to_reach_p95": float(np.percentile(reached, 95)) if len(reached) else None,
            "peak_force": float(self.peak_force.max()),
            "peak_force_median": float(np.median(self.peak_force)),
            "facts": self.facts,
        }

    def summary(self) -> str:
        """The figures as text, a few lines."""
        entries = self.as_dict()
        reach = "never"
        if entries["time_to_reach"] is not None:
            reach = f"{entries['time_to_reach']:.2f} s (median), {entries['time_to_reach_p95']:.2f} s (95 %)"
        rows = [
            f"episodes         {entries['episodes']}",
            f"success          {100 * self.success_rate:.1f} % within {1e3 * self.task.radius:.3g} mm at the end",
            f"final distance   {1e3 * self.mean:.2f} mm mean, {1e3 * self.median:.2f} mm median, "
            f"{1e3 * self.p95:.2f} mm (95 %), {1e3 * entries['worst']:.2f} mm worst",
            f"time to reach    {reach}",
        ]
        if self.peak_force.any():
            rows.append(
                f"peak force       {entries['peak_force_median']:.1f} N median, {entries['peak_force']:.1f} N worst"
            )
        return "\n".join(rows)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write to a `.json` file (figures and per-target numbers) or a `.npz` file (everything).

        Args:
            path: the file.
            overwrite: replace a file that exists.

        Raises:
            CommandRejected: another kind of file, or the file exists.
        """
        target = Path(path)
        refuse_existing(target, overwrite=flag(overwrite, "overwrite"))
        if target.suffix == ".json":
            reached = [None if np.isinf(t) else float(t) for t in self.time_to_reach]
            per_target = {
                "target": self.targets.tolist(),
                "final": self.final.tolist(),
                "time_to_reach": reached,
                "peak_force": self.peak_force.tolist(),
            }
            entries = {**self.as_dict(), "task": self.task.as_dict(), "per_target": per_target}
            target.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")
        elif target.suffix == ".npz":
            about = json.dumps({"task": self.task.as_dict(), "facts": self.facts})
            np.savez_compressed(
                target,
                about=np.array(about),
                targets=self.targets,
                distances=self.distances,
                paths=self.paths,
                joints=self.joints,
                forces=self.forces,
            )
        else:
            raise CommandRejected(f"path must end in .json or .npz, got {target.name!r}", parameter="path")
        return target

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> EpisodeReport:
        """Read a `.npz` file of `save`.

        Raises:
            CommandRejected: it cannot be read, or is no report.
        """
        where, what = Path(path), "a report of episodes"
        file = read_arrays(where, what)
        try:
            about = json.loads(str(file["about"]))
            return cls(
                task_from_dict(about["task"]),
                file["targets"],
                file["distances"],
                file["paths"],
                joints=file["joints"],
                forces=file.get("forces", np.zeros(0)),
                facts=about["facts"],
            )
        except Exception as error:  # of any numbers and texts in place of a report's
            raise unreadable(where, f"{type(error).__name__}: {error}", what=what) from None

    def plot(self, path: str | os.PathLike[str], *, most: int = 60, overwrite: bool = False) -> Path:
        """Plot paths, and distance over time; return the path of the picture.

        Args:
            path: file to write, `.png`, `.svg` or `.pdf`.
            most: episodes that are drawn; the distribution is of all.
            overwrite: replace a file that exists.

        Raises:
            MissingExtra: matplotlib is not installed.
            CommandRejected: the file exists.
        """
        file = refuse_existing(Path(path), overwrite=flag(overwrite, "overwrite"))
        figures = require("matplotlib.figure", extra="rl")
        figure = figures.Figure(figsize=(13, 4.2), layout="constrained")
        side, above, over = figure.subplots(1, 3)
        goals = self.task.goals(self.targets)
        for axes, (x, y), names in ((side, (0, 2), "xz"), (above, (0, 1), "xy")):
            for line in self.paths[:most]:
                axes.plot(line[:, x], line[:, y], linewidth=0.7, alpha=0.7)
            if goals is not None:
                axes.plot(goals[:most, x], goals[:most, y], "k+", markersize=5)
            axes.set_xlabel(f"{names[0]} [m]")
            axes.set_ylabel(f"{names[1]} [m]")
            axes.set_aspect("equal")
        side.set_title("paths, from the side")
        above.set_title("from above" if goals is None else "from above; + targets")
        time = np.arange(1, self.distances.shape[1] + 1) / self.task.rate
        mm = 1e3 * self.distances
        over.fill_between(
            time, np.percentile(mm, 5, axis=0), np.percentile(mm, 95, axis=0), alpha=0.3, label="5 to 95 %"
        )
        over.plot(time, np.median(mm, axis=0), label="median")
        over.axhline(1e3 * self.task.radius, color="k", linestyle="--", linewidth=0.8, label="radius")
        over.set_yscale("log")
        over.set_xlabel("time [s]")
        over.set_ylabel("distance to the target [mm]")
        over.set_title(f"{len(self.final)} episodes, {1e3 * self.mean:.1f} mm at the end")
        over.grid(which="both", alpha=0.3)
        over.legend()
        figure.savefig(file, dpi=110)
        return file
