"""Joint paths of motions, for checks before they are sent: the geometry alone, without time.

Lines and arcs keep the arm angle, as on the robot. Blending is left out: the path goes into the corners. Splines are
taken as straight from point to point; the curve of the robot may leave that by some millimetres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import acos, ceil, pi, sin

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.inverse_kinematics import redundancy, solve
from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.frames import TOOL
from heptarm.values.motion.circle import Circ
from heptarm.values.motion.line import Lin, LinRel
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import Ptp, PtpHome, PtpPose
from heptarm.values.motion.spline import JointSpline, Spl, Spline
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

#: Distance between two poses of a path [m], and their largest rotation [rad].
STEP, TURN = 0.01, 0.05
#: Below this sine of the angle between the chords of three points they are on a line.
_STRAIGHT = 1e-9


@dataclass(frozen=True, slots=True)
class PathGeometry:
    """What turns motions into joint paths.

    Attributes:
        robot: the robot.
        tip: pose of a motion frame in the flange frame, by its name.
        fixed: pose of a reference frame in the base, by its name; None: it is a frame on the flange.
    """

    robot: RobotModel
    tip: Callable[[str], Pose]
    fixed: Callable[[str], Pose | None]

    def joint_path(self, start: Array, motion: Motion) -> Array:
        """Joint positions along a motion, the start included; those of a motion without a path are the start alone.

        A path that leaves the workspace or the joint limits ends there: the cabinet refuses it with its own reasons.

        Args:
            start: joint positions at its start, shape (7,) [rad].
            motion: a hold and hand guiding have no path.

        Returns:
            Shape (n, 7) [rad].
        """
        points = [start]
        try:
            if isinstance(motion, Ptp):
                points.append(motion.q)
            elif isinstance(motion, PtpHome):
                points.append(np.zeros(7))
            elif isinstance(motion, JointSpline):
                points += [point.q for point in motion.points]
            elif isinstance(motion, PtpPose):
                points.append(self._target(motion, start))
            elif isinstance(motion, Lin | LinRel | Circ | Spline):
                self._follow(points, motion)
        except Unreachable:
            pass
        return np.array(points)

    def _target(self, motion: PtpPose, start: Array) -> Array:
        flange = motion.target @ self.tip(motion.moving).inverse()
        given = motion.redundancy
        near = start if motion.near is None else motion.near
        if given is None:
            return solve(self.robot, flange, near=near.tolist())
        return solve(self.robot, flange, e1=given.e1, status=given.status, near=near.tolist())

    def _follow(self, points: list[Array], motion: Lin | LinRel | Circ | Spline) -> None:
        """Append the joint positions along a path of the motion frame."""
        tip = self.tip(motion.moving)
        back = tip.inverse()
        start = Pose.from_matrix(forward(self.robot, points[0])) @ tip
        own = redundancy(self.robot, points[0].tolist())
        last_e1 = _given_e1(self.robot, motion)
        poses = self._poses(start, motion, points[0])
        for number, pose in enumerate(poses, 1):
            e1 = own.e1
            if last_e1 is not None:
                e1 += number / len(poses) * ((last_e1 - own.e1 + pi) % (2.0 * pi) - pi)
            near = points[-1].tolist()
            points.append(solve(self.robot, pose @ back, e1=(e1 + pi) % (2.0 * pi) - pi, near=near))

    def _poses(self, start: Pose, motion: Lin | LinRel | Circ | Spline, q: Array) -> list[Pose]:
        if isinstance(motion, Lin):
            return _line(start, motion.target)
        if isinstance(motion, Circ):
            return _arc(start, motion.via, motion.end)
        if isinstance(motion, LinRel):
            return _line(start, self._moved(start, motion, q))
        found: list[Pose] = []
        for segment in motion.segments:
            last = found[-1] if found else start
            if isinstance(segment, Circ):
                found += _arc(last, segment.via, segment.end)
            else:
                assert isinstance(segment, Spl | Lin)
                found += _line(last, segment.target)
        return found

    def _moved(self, start: Pose, motion: LinRel, q: Array) -> Pose:
        """Target of a relative line: the offset in the axes of its frame."""
        if motion.frame in (TOOL, motion.moving):
            return start @ motion.offset
        frame = self.fixed(motion.frame)
        if frame is None:
            frame = Pose.from_matrix(forward(self.robot, q)) @ self.tip(motion.frame)
        axes = Pose.of((0.0, 0.0, 0.0), frame.quat)
        turn = axes @ Pose.of((0.0, 0.0, 0.0), motion.offset.quat) @ axes.inverse()
        place = start.xyz + axes.rotation @ motion.offset.xyz
        return Pose.of(place, (turn @ Pose.of((0.0, 0.0, 0.0), start.quat)).quat)


def _given_e1(robot: RobotModel, motion: Lin | LinRel | Circ | Spline) -> float | None:
    """Arm angle of the target, where the motion gives one [rad]."""
    near, given = getattr(motion, "near", None), getattr(motion, "redundancy", None)
    if near is not None:
        return redundancy(robot, near.tolist()).e1
    return None if given is None or np.isnan(given.e1) else float(given.e1)


def _line(start: Pose, end: Pose) -> list[Pose]:
    """Poses on a straight line behind its start, up to its end."""
    count = max(1, ceil(start.distance_to(end) / STEP), ceil(start.angle_to(end) / TURN))
    parts = [number / count for number in range(1, count + 1)]
    return [
        Pose.of(start.xyz + part * (end.xyz - start.xyz), _between(start.quat, end.quat, part))
        for part in parts
    ]


def _arc(start: Pose, via: Pose, end: Pose) -> list[Pose]:
    """Poses on an arc behind its start, through a point, up to its end."""
    a, b = via.xyz - start.xyz, end.xyz - start.xyz
    normal = np.cross(a, b)
    square = float(normal @ normal)
    if square < _STRAIGHT**2:
        return _line(start, via) + _line(via, end)
    # circumcentre of the triangle, from the start
    middle = (float(b @ b) * np.cross(normal, a) + float(a @ a) * np.cross(b, normal)) / (2.0 * square)
    first = -middle
    across = np.cross(normal / np.sqrt(square), first)
    lever = b - middle
    angle = float(np.arctan2(lever @ across, lever @ first)) % (2.0 * pi)
    count = max(2, ceil(angle * float(np.linalg.norm(first)) / STEP), ceil(angle / TURN))
    parts = [number / count for number in range(1, count + 1)]
    return [
        Pose.of(
            start.xyz + middle + np.cos(part * angle) * first + np.sin(part * angle) * across,
            _between(start.quat, end.quat, part),
        )
        for part in parts
    ]


def _between(first: Array, last: Array, part: float) -> Array:
    """Quaternion between two, on the shorter side."""
    cosine = float(first @ last)
    if cosine < 0.0:
        last, cosine = -last, -cosine
    if cosine > 1.0 - 1e-9:
        return last if part >= 0.5 else first
    angle = acos(cosine)
    return np.asarray((sin((1.0 - part) * angle) * first + sin(part * angle) * last) / sin(angle))


def joint_paths(geometry: PathGeometry, start: Array, motions: Sequence[Motion]) -> list[Array]:
    """Joint paths of motions that follow each other, each from the end of the one before; see `PathGeometry`."""
    paths = []
    for motion in motions:
        paths.append(geometry.joint_path(start, motion))
        start = paths[-1][-1]
    return paths
