"""Plans motions as one program, with the blending of each; a motion by itself is a program of one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, isnan

import numpy as np

from heptarm.model.kinematics import Vec
from heptarm.planning import seam
from heptarm.planning.composite_path import (
    UNBOUND,
    CompositePath,
    Segment,
    SegmentLimits,
    SubPath,
    sample,
    turns,
)
from heptarm.planning.geometry import Geometry, Quat, blend_weight, product
from heptarm.planning.motion import (
    PlanError,
    check_numbers,
    fractions,
    inherited,
    kind_of,
)
from heptarm.planning.path import CartesianPath, JointLine, JointPath, Sequential
from heptarm.planning.plan import Plan, timed
from heptarm.planning.targets import (
    STILL,
    JointMotion,
    PathMotion,
    cartesian_path,
    e1_of,
    joint_target,
    programmed_speed,
    segment_limits,
)
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel


class JointBlend(Sequential):
    """Blend of two paths by their joint positions.

    Args:
        before: the first path.
        after: the second path.
        last: fraction of the first path that lies in the blend.
        first: fraction of the second path that does.
        corner: joint positions between them, shape (7,) [rad].
    """

    __slots__ = ("_after", "_before", "_corner", "_first", "_last")

    def __init__(self, before: JointPath, after: JointPath, last: float, first: float, corner: Array) -> None:
        self._before, self._after = before, after
        self._last, self._first, self._corner = last, first, corner

    def at(self, s: float, near: Array) -> Array:
        """Joint positions, shape (7,) [rad].

        Both paths are followed next to the corner: `near` is beside both of them, and what a path leaves free, such as
        A3, would then follow the blend and be counted twice.
        """
        before = self._before.at(1.0 - self._last * blend_weight(s), self._corner)
        return before + self._after.at(self._first * blend_weight(1.0 - s), self._corner) - self._corner


class GeometryBlend:
    """Blend of two paths of the tool frame.

    Args:
        before: the first path.
        after: the second path.
        last: fraction of the first path that lies in the blend.
        first: fraction of the second path that does.
    """

    def __init__(self, before: Geometry, after: Geometry, last: float, first: float) -> None:
        self._before, self._after, self._last, self._first = before, after, last, first
        self.length = before.length * last + after.length * first
        self.angle = before.angle * last + after.angle * first
        self._corner: Vec = before.point(1.0)
        x, y, z, w = before.quat(1.0)
        self._back: Quat = (-x, -y, -z, w)

    def point(self, s: float) -> Vec:
        """Position in the base [m]."""
        (x, y, z), (u, v, w) = self._before.point(1.0 - self._last * blend_weight(s)), self._corner
        i, j, k = self._after.point(self._first * blend_weight(1.0 - s))
        return x + i - u, y + j - v, z + k - w

    def quat(self, s: float) -> Quat:
        """Orientation in the base."""
        before = self._before.quat(1.0 - self._last * blend_weight(s))
        return product(product(before, self._back), self._after.quat(self._first * blend_weight(1.0 - s)))


def blending_zone(positions: Array, rotations: Array, blending: seam.Blending, *, backwards: bool) -> float:
    """Fraction of a path that a blending allows at one of its ends.

    Args:
        positions: of the tool frame at even samples, shape (n, 3) [m].
        rotations: likewise, shape (n, 3, 3).
        blending: what is zero or not given does not count.
        backwards: at its end.
    """
    if backwards:
        positions, rotations = positions[::-1], rotations[::-1]
    found = [blending.relative] if blending.relative > 0 else []
    for most, distances in (
        (blending.distance, np.linalg.norm(positions - positions[0], axis=1)),
        (blending.orientation, turns(rotations, rotations[0])),
    ):
        if most > 0:
            beyond = np.flatnonzero(distances > most)
            if len(beyond):
                k = int(beyond[0])
                part = (most - distances[k - 1]) / (distances[k] - distances[k - 1])
                found.append((k - 1 + float(part)) / (len(distances) - 1))
            else:
                found.append(1.0)
    return min(found, default=0.0)


#: Samples of a motion to find its blending zones with.
_ZONE_SAMPLES = 65
#: Samples of a whole motion, at least of a part of one, and of a blend.
_SAMPLES, _FEWEST, _BLEND_SAMPLES = 81, 17, 41
#: A blend shorter than this at programmed speed is a rest [s].
_SHORTEST = 2e-3
#: Fraction of a motion that a blend may take where another takes the other end of it.
_HALF = 0.5
#: A PTP over less than this does not move [rad].
_STILL_JOINTS = 1e-9


@dataclass(slots=True)
class _Motion:
    """A motion of a program.

    Attributes:
        path: joint positions; None: the arm is there already.
        time: duration at programmed speed, without acceleration [s].
        limits: what it allows, beside its speed.
        speed_limit: what it allows as a fraction of the programmed speed.
        end: joint positions at its end, shape (7,) [rad].
        positions: of the tool frame, shape (n, 3) [m]; empty where the motion is alone.
        rotations: likewise, shape (n, 3, 3).
        begin: fraction that the blend at its beginning takes.
        finish: fraction that the blend at its end takes.
    """

    path: CartesianPath | JointLine | None
    time: float
    limits: SegmentLimits
    speed_limit: float
    end: Array
    positions: Array
    rotations: Array
    begin: float = 0.0
    finish: float = 0.0


def plan_motion(robot: RobotModel, motion: JointMotion | PathMotion, start: Array, tcp: Pose) -> Plan:
    """Plan a motion by itself from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: it cannot be planned.
    """
    return _program(robot, motion, start, tcp, [_motion(robot, motion, start, tcp, is_alone=True)])


def plan_batch(robot: RobotModel, batch: seam.Batch, start: Array, tcp: Pose) -> Plan:
    """Plan a batch of motions from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: one of the motions cannot be planned; the error names it.
    """
    motions: list[_Motion] = []
    zones: list[seam.Blending] = []
    here = start
    for index, part in enumerate(batch.motions):
        try:
            check_numbers(part)
            if not isinstance(part, JointMotion | PathMotion):
                raise PlanError(
                    "planning", f"Can not plan motion: a batch cannot have a motion of kind {kind_of(part)}"
                )
            whole = inherited(part, batch)
            motion = _motion(robot, whole, here, tcp, is_alone=len(batch.motions) == 1)
        except PlanError as error:
            raise PlanError(error.kind, f"{error} (motion {index + 1} of the batch)") from None
        motions.append(motion)
        zones.append(whole.blending)
        here = motion.end
    for before, after, zone in zip(motions, motions[1:], zones, strict=False):
        _blend_ends(before, after, zone)
    return _program(robot, batch, start, tcp, motions)


def _program(
    robot: RobotModel, whole: seam.PlantMotion, start: Array, tcp: Pose, motions: list[_Motion]
) -> Plan:
    path, rests, marks = _composed(motions)
    if path is None:
        return Plan(whole, start, motions[-1].end, marks=(0.0,) * (len(motions) - 1))
    return timed(robot, whole, start, tcp, path, rests, marks)


def _motion(
    robot: RobotModel, motion: JointMotion | PathMotion, start: Array, tcp: Pose, *, is_alone: bool
) -> _Motion:
    path: CartesianPath | JointLine | None
    if isinstance(motion, JointMotion):
        end = joint_target(robot, motion, start, tcp)
        path = JointLine(start, end)
        fastest = robot.dq_max * fractions(motion.dynamics.velocity)
        speed = float((fastest / np.maximum(np.abs(end - start), 1e-12)).min())
        is_still = float(np.abs(end - start).max()) < _STILL_JOINTS
    else:
        end = start
        path = cartesian_path(robot, motion, start, tcp)
        speed = programmed_speed(motion.dynamics, path)
        is_still = path.length < STILL and path.angle < STILL and isnan(e1_of(motion))
    limits, nothing = segment_limits(motion), (np.zeros((0, 3)), np.zeros((0, 3, 3)))
    if is_still:
        return _Motion(None, 0.0, limits, 1.0, end, *nothing)
    # where only the elbow moves, the joints' limits alone count
    time, speed_limit = (1.0 / speed, 1.0) if speed < inf else (1.0, UNBOUND)
    if is_alone:
        return _Motion(path, time, limits, speed_limit, end, *nothing)
    segment = Segment(path, 1.0, limits, samples=_ZONE_SAMPLES)
    samples = sample(robot, CompositePath([segment]), start, tcp)
    (q,), (positions,), (rotations,) = samples.q, samples.positions, samples.rotations
    return _Motion(path, time, limits, speed_limit, q[-1], positions, rotations)


def _blend_ends(before: _Motion, after: _Motion, blending: seam.Blending) -> None:
    """Give the blend of two motions a fraction of both, equally long at programmed speed."""
    if before.path is None or after.path is None:
        return
    zone = blending_zone(before.positions, before.rotations, blending, backwards=True)
    other = blending_zone(after.positions, after.rotations, blending, backwards=False)
    most = min(before.time * min(zone, 1.0 - before.begin), after.time * min(other, _HALF))
    if most >= _SHORTEST:
        before.finish, after.begin = most / before.time, most / after.time


def _composed(motions: list[_Motion]) -> tuple[CompositePath | None, list[int], list[float]]:
    """The path, the segments behind which the arm rests, and s at which the motions after the first begin."""
    segments: list[Segment] = []
    rests: list[int] = []
    begins: list[tuple[int, float]] = []  # segment and fraction of it
    for index, motion in enumerate(motions):
        if motion.begin > 0.0:
            begins.append((len(segments) - 1, 0.5))
        else:
            if segments and motion.path is not None:
                rests.append(len(segments) - 1)
            begins.append((len(segments), 0.0))
        if motion.path is None:
            continue
        rest = 1.0 - motion.begin - motion.finish
        if rest * motion.time > _SHORTEST / 10 or not (motion.begin or motion.finish):
            part = SubPath(motion.path, motion.begin, 1.0 - motion.finish)
            samples = max(_FEWEST, int(_SAMPLES * rest))
            segments.append(
                Segment(part, rest * motion.time, motion.limits, (motion.speed_limit,) * 2, samples)
            )
        if motion.finish > 0.0:
            segments.append(_blend(motion, motions[index + 1]))
    if not segments:
        return None, [], []
    path = CompositePath(segments)
    rests.append(len(segments) - 1)
    marks = [
        1.0
        if index >= len(segments)
        else path.marks[index] + fraction * (path.marks[index + 1] - path.marks[index])
        for index, fraction in begins[1:]
    ]
    return path, rests, marks


def _blend(before: _Motion, after: _Motion) -> Segment:
    one, other = before.path, after.path
    assert one is not None and other is not None
    length, limits = 2 * before.finish * before.time, before.limits.least(after.limits)
    speed_limit = (min(before.speed_limit, after.speed_limit),) * 2
    if isinstance(one, CartesianPath) and isinstance(other, CartesianPath) and one.status == other.status:
        geometry = GeometryBlend(one.geometry, other.geometry, before.finish, after.begin)
        path: JointPath = one.joined(other, geometry, before.finish, after.begin)
    else:
        path = JointBlend(one, other, before.finish, after.begin, before.end)
        limits = replace(limits, line=(inf, inf), turn=(inf, inf))
    return Segment(path, length, limits, speed_limit, _BLEND_SAMPLES)
