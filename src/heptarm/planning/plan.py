"""A planned motion, and how one is made of a composite path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf, isnan

import numpy as np

from heptarm.errors import Unreachable
from heptarm.planning import seam
from heptarm.planning.composite_path import CompositePath, PathSamples, constraints, sample
from heptarm.planning.motion import PlanError
from heptarm.planning.path import JointPath, PathLengths
from heptarm.planning.table import MotionTable
from heptarm.planning.time_scaling import PathTiming
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

_NEVER = 1e9
#: An axis that accelerates by more than this fraction of its maximum jumps between two arm positions.
_JUMPS = 2.0
#: A3 that moves by less stays [rad].
_STAYS = 1e-9
#: Time between two set-points that are tried [s], and most of them.
_TICK, _MOST_TICKS = 1e-3, 20_000


@dataclass(frozen=True, slots=True)
class Plan:
    """A motion that can be executed.

    Attributes:
        motion: what it executes.
        start: joint positions at its start, shape (7,) [rad].
        end: joint positions at its end, shape (7,) [rad].
        path: joint positions over s; None: it follows no path.
        timing: s over time, and stops on the path; None: it follows no path.
        lengths: distances of the tool frame along the path; None: it follows no path.
        marks: s at which the parts of a batch or a spline begin, without the first.
        table: computes many set-points at once; None: they have to be computed one by one.
    """

    motion: seam.PlantMotion
    start: Array
    end: Array
    path: JointPath | None = None
    timing: PathTiming | None = None
    lengths: PathLengths | None = None
    marks: tuple[float, ...] = ()
    table: MotionTable | None = None

    @property
    def duration(self) -> float:
        """Time at full speed [s]; infinite for an endless hold."""
        if self.timing is not None:
            return self.timing.profile.duration
        if isinstance(self.motion, seam.Hold) and not isnan(self.motion.duration):
            return self.motion.duration
        return _NEVER

    def span(self, part: int) -> tuple[float, float]:
        """Path parameter at which a part begins and ends; -1: the whole."""
        marks = (0.0, *self.marks, 1.0)
        return (0.0, 1.0) if part < 0 else (marks[part], marks[part + 1])

    def end_of(self, part: int) -> float:
        """Path parameter at which the next part begins; infinite: there is none."""
        return self.marks[part] if part < len(self.marks) else inf

    def measured(self, part: int) -> tuple[float, float]:
        """Path parameters between which progress is measured: of the motion of a batch, or of the whole."""
        return self.span(part if self.marks and isinstance(self.motion, seam.Batch) else -1)

    def progress(self, s: float, part: int) -> float:
        """Progress of the running motion of a batch at s in [0, 1]; any other motion is its only part."""
        if not self.marks:
            return s
        low, high = self.measured(part)
        return min(1.0, max(0.0, (s - low) / (high - low))) if high > low else 1.0


def timed(
    robot: RobotModel,
    motion: seam.PlantMotion,
    start: Array,
    tcp: Pose,
    path: CompositePath,
    rests: Sequence[int],
    marks: Sequence[float],
) -> Plan:
    """The fastest motion along a path.

    Args:
        robot: the robot.
        motion: what is executed.
        start: joint positions, shape (7,) [rad].
        tcp: flange to motion frame.
        path: the path.
        rests: segments behind which the arm rests, ascending; the last segment is the last of them.
        marks: s at which the parts begin, without the first.

    Raises:
        PlanError: the path leaves the workspace or the joint limits, or passes a singularity.
    """
    samples = sample(robot, path, start, tcp)
    edges = [0, *(index + 1 for index in rests)]
    sections = tuple(constraints(robot, path, samples, a, b) for a, b in pairwise(edges))
    timing = PathTiming(tuple(path.marks[edge] for edge in edges[1:]), sections)
    _check_jumps(robot, path, samples, timing)
    fractions = [
        np.linspace(low, high, len(q)) for q, (low, high) in zip(samples.q, pairwise(path.marks), strict=True)
    ]
    lengths = PathLengths.through(np.concatenate(fractions), np.concatenate(samples.positions))
    table = MotionTable.of(path, timing.profile)
    return Plan(motion, start, samples.q[-1][-1], path, timing, lengths, tuple(marks), table)


def _check_jumps(robot: RobotModel, path: CompositePath, samples: PathSamples, timing: PathTiming) -> None:
    """Refuse a path on which A3 cannot stay, if set-points would then jump between two arm positions.

    There each joint position depends on the one before, so the few samples of the path do not show the jumps.

    Raises:
        PlanError: a set-point jumps, or has no joint position next to the one before.
    """
    if not any(
        segment.path.keeps_a3 and np.ptp(q[:, 2]) > _STAYS
        for segment, q in zip(path.segments, samples.q, strict=True)
    ):
        return
    profile = timing.profile
    count = min(max(2, ceil(profile.duration / _TICK)), _MOST_TICKS)
    times = np.linspace(0.0, profile.duration, count + 1)
    places = [profile.at(time)[0] for time in times.tolist()]
    joints, axis, failed = np.zeros((count + 1, len(samples.q[0][0]))), 3, 0
    near = samples.q[0][0]
    try:
        for index, s in enumerate(places):
            failed = index
            joints[index] = near = path.at(s, near)
    except Unreachable:
        pass
    else:
        jumps = np.abs(np.diff(joints, 2, axis=0)) / (times[1] ** 2 * robot.ddq_max)
        if jumps.max() <= _JUMPS:
            return
        failed, axis = (int(n) + 1 for n in np.unravel_index(int(jumps.argmax()), jumps.shape))
    raise PlanError(
        "planning",
        f"Can not plan motion: A{axis} would have to jump at {100 * places[failed]:.0f} % of the path, where A3 cannot "
        "stay at its angle (singularity); move there by a PTP, or give the end an E1",
    )
