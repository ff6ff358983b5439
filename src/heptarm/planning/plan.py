"""A planned motion, and how one is made of a composite path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from math import ceil, inf, isnan

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.batch import jacobian_batch
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
#: Timings that are tried until the axes stay within their limits, and the factor up to which a path is slowed down.
_ATTEMPTS, _SLOWEST = 4, 4.0
#: Samples around a place at which an axis is too fast that are slowed down as well, and by how much more than needed.
_AROUND, _SPARE = 2, 1.05
#: Largest speed and acceleration of an axis, fractions of its maxima.
_MOST = 1.0 + 1e-6
#: Smallest singular value of the Jacobian from which on samples do not miss what the joints do.
_SINGULAR = 0.1
_JOINTS = 7
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
    sections = [constraints(robot, path, samples, a, b) for a, b in pairwise(edges)]
    slowed = [np.ones_like(section.s) for section in sections]
    for attempt in count(1):
        timing = PathTiming(
            tuple(path.marks[edge] for edge in edges[1:]),
            tuple(section.slower(factors) for section, factors in zip(sections, slowed, strict=True)),
        )
        found = _excess(robot, path, samples, timing)
        if found is None:
            break
        for section, factors in zip(sections, slowed, strict=True):
            found.slow(section.s, factors)
        if attempt == _ATTEMPTS or max(factors.max() for factors in slowed) > _SLOWEST:
            raise found.error
    fractions = [
        np.linspace(low, high, len(q)) for q, (low, high) in zip(samples.q, pairwise(path.marks), strict=True)
    ]
    lengths = PathLengths.through(np.concatenate(fractions), np.concatenate(samples.positions))
    table = MotionTable.of(path, timing.profile)
    return Plan(motion, start, samples.q[-1][-1], path, timing, lengths, tuple(marks), table)


@dataclass(frozen=True, slots=True)
class _Excess:
    """Where set-points are too fast for an axis.

    Attributes:
        axis: the worst, 1 to 7.
        place: s there.
        places: all s at which an axis is too fast, shape (n,).
        factors: by which the motion has to be slower at each, shape (n,).
        why: why set-points jump there.
    """

    axis: int
    place: float
    places: Array
    factors: Array
    why: str

    def slow(self, s: Array, factors: Array) -> None:
        """Make factors at the samples s, shape (n,), larger around the places."""
        here = (self.places >= s[0]) & (self.places <= s[-1])
        nearest, most = np.searchsorted(s, self.places[here]), np.ones_like(factors)
        for shift in range(-_AROUND, _AROUND + 1):
            np.maximum.at(most, np.clip(nearest + shift, 0, len(s) - 1), self.factors[here])
        factors *= most

    @property
    def error(self) -> PlanError:
        """What refuses the path."""
        return PlanError(
            "planning",
            f"Can not plan motion: A{self.axis} would have to jump at {100 * self.place:.0f} % of the path{self.why} "
            "(singularity); move there by a PTP, or give the end an E1",
        )


def _excess(
    robot: RobotModel, path: CompositePath, samples: PathSamples, timing: PathTiming
) -> _Excess | None:
    """Where set-points on a path near a singularity are too fast for an axis; None: nowhere.

    There the inverse kinematics turns joints fast within a short part of the path, and where A3 cannot stay each joint
    position depends on the one before: samples may miss both, so the set-points themselves are looked at. Paths in
    joint space have no such places.

    Raises:
        PlanError: a set-point has no joint position next to the one before.
    """
    each = zip(path.segments, samples.q, samples.followed, strict=True)
    followed = [(part.path, q) for part, q, is_followed in each if is_followed]
    does_a3_move = any(path.keeps_a3 and np.ptp(q[:, 2]) > _STAYS for path, q in followed)
    if not (does_a3_move or any(_is_near_singular(robot, q) for _, q in followed)):
        return None
    why = ", where A3 cannot stay at its angle" if does_a3_move else ""
    profile = timing.profile
    ticks = min(max(3, ceil(profile.duration / _TICK)), _MOST_TICKS)
    times = np.linspace(0.0, profile.duration, ticks + 1)
    places = np.array([profile.at(time)[0] for time in times.tolist()])
    joints, near = np.empty((ticks + 1, _JOINTS)), samples.q[0][0]
    for index, s in enumerate(places.tolist()):
        try:
            joints[index] = near = path.at(s, near)
        except Unreachable:
            raise _Excess(4, s, places, np.ones_like(places), why).error from None
    period = float(times[1])
    speeds = np.abs(np.diff(joints, axis=0)) / (period * robot.dq_max)
    changes = np.abs(np.diff(joints, 2, axis=0)) / (period**2 * robot.ddq_max)
    needed = np.maximum(speeds[1:], np.sqrt(changes))
    if needed.max() <= _MOST:
        return None
    index, axis = (int(n) for n in np.unravel_index(int(needed.argmax()), needed.shape))
    most = needed.max(axis=1)
    fast = most > _MOST
    return _Excess(axis + 1, float(places[index + 1]), places[1:-1][fast], most[fast] * _SPARE, why)


def _is_near_singular(robot: RobotModel, q: Array) -> bool:
    """Whether samples may miss what the joints do on a path in space, at joint positions of shape (n, 7) [rad]."""
    moving = jacobian_batch(robot, q)[:, :, [0, 1, 3, 4, 5, 6]]  # A3 is given
    return bool(np.linalg.svd(moving, compute_uv=False)[:, -1].min() < _SINGULAR)
