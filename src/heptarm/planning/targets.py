"""What a motion asks for: target joints, path of the tool frame, limits along it.

Speed parameters are applied as the cabinet does: relative ones scale each axis' limit before the smallest counts,
Cartesian ones bound the path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, isnan, nan, sqrt
from typing import TypeAlias

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.inverse_kinematics import PathInverse, inside, solve
from heptarm.model.kinematics import forward
from heptarm.planning import seam
from heptarm.planning.composite_path import LARGEST_STEP, SegmentLimits, check_limits
from heptarm.planning.geometry import Arc, Geometry, JointOrientation, OrientationPath, Slerp, Straight
from heptarm.planning.motion import (
    CARTESIAN_DEFAULT,
    ORIENTATION_DEFAULT,
    PlanError,
    fractions,
    or_default,
    orientation_of,
)
from heptarm.planning.path import CartesianPath
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.robot import RobotModel

#: To a place in joint space, or along a path of the motion frame: what may be alone or in a batch.
JointMotion: TypeAlias = seam.Ptp | seam.PtpPose
PathMotion: TypeAlias = seam.Lin | seam.LinRel | seam.Circ
#: What a spline consists of.
SplineSegment: TypeAlias = seam.Spl | seam.Lin | seam.Circ

#: A path shorter than this [m or rad] does not move.
STILL = 1e-7
#: Cosine of half the angle between two orientations above which they are the same.
_SAME_TURN = 0.99
#: Samples of a path that tell whether the arm can follow it.
_LOOKS = 101


def pose_of(given: seam.Pose) -> Pose:
    """A pose of the seam as a value."""
    return Pose.of(given.xyz, given.quat)


def joint_target(robot: RobotModel, motion: JointMotion, start: Array, tcp: Pose) -> Array:
    """Joint positions at the end of a PTP, shape (7,) [rad].

    Raises:
        PlanError: they are outside the limits, or the pose is not reachable.
    """
    if isinstance(motion, seam.Ptp):
        target = np.array(motion.q)
    else:
        given = motion.redundancy
        try:
            target = solve(
                robot,
                pose_of(motion.target) @ tcp.inverse(),
                e1=None if isnan(given.e1) else given.e1,
                status=None if given.status < 0 else given.status,
                near=start.tolist(),
            )
        except Unreachable as error:
            raise PlanError(
                "unreachable", f"Can not plan motion: frame is not reachable: {error.text}"
            ) from None
    check_limits(robot, target)
    return target


def _offset_end(motion: seam.LinRel, origin: Pose) -> Pose:
    """Where a relative line from a pose ends."""
    offset = pose_of(motion.offset)
    if motion.axes is None:
        return origin @ offset
    axes = np.array(motion.axes)
    back = axes * np.array([-1.0, -1.0, -1.0, 1.0])
    turn = multiply(multiply(axes, offset.quat), back)
    return Pose(origin.xyz + rotation(axes) @ offset.xyz, multiply(turn, origin.quat))


def _end(motion: PathMotion, origin: Pose) -> Pose:
    if isinstance(motion, seam.LinRel):
        return _offset_end(motion, origin)
    return pose_of(motion.end if isinstance(motion, seam.Circ) else motion.target)


def e1_of(motion: PathMotion) -> float:
    """E1 at its end [rad]; NaN: as at the start."""
    return nan if isinstance(motion, seam.LinRel) else motion.redundancy.e1


def geometry_of(
    robot: RobotModel, motion: PathMotion, start: Array, origin: Pose, tcp: Pose, *, is_other: bool = False
) -> Geometry:
    """Path of the motion frame that begins at a pose; `is_other`: see `Slerp`.

    Raises:
        PlanError: there is no such arc, or no joint position at its end.
    """
    target, control = _end(motion, origin), orientation_of(motion.orientation)
    if control.type == "ignore":
        raise PlanError(
            "planning",
            "Can not plan motion: only a spline segment may ignore its orientation; use variable, constant or joint",
        )
    turn: OrientationPath | None = None
    if control.type == "joint":
        turn = _joint_orientation(robot, e1_of(motion), start, target, tcp)
    if isinstance(motion, seam.Circ):
        arc = Arc(origin.xyz, pose_of(motion.via).xyz, target.xyz)
        if turn is None:
            return arc.oriented(origin.quat, target.quat, control, is_other=is_other)
        return arc.turning(turn, follows=False)
    if turn is None:
        end = origin.quat if control.type == "constant" else target.quat
        turn = Slerp(origin.quat, end, is_other=is_other)
    return Straight(origin.xyz, target.xyz, turn)


def _joint_orientation(
    robot: RobotModel, e1: float, start: Array, target: Pose, tcp: Pose
) -> JointOrientation:
    """The orientation as a PTP to the target would turn it."""
    place = target @ tcp.inverse()
    try:
        inverse = PathInverse(robot, Pose.of((0.0, 0.0, 0.0)))
        end = inverse.joints(place.xyz.tolist(), place.quat.tolist(), start, a3=e1)
    except Unreachable as error:
        raise PlanError("unreachable", f"Can not plan motion: frame is not reachable: {error.text}") from None
    return JointOrientation(robot, start, end, tcp.quat)


def cartesian_path(robot: RobotModel, motion: PathMotion, start: Array, tcp: Pose) -> CartesianPath:
    """Path of a motion of the motion frame; half a turn goes in the direction in which the arm can follow.

    Raises:
        PlanError: see `geometry_of`.
    """
    origin = Pose.from_matrix(forward(robot, start)) @ tcp
    e1 = None if isnan(e1_of(motion)) else e1_of(motion)
    path, other = (
        CartesianPath(
            robot, start, geometry_of(robot, motion, start, origin, tcp, is_other=is_other), tcp, e1
        )
        for is_other in (False, True)
    )
    middle, middle_of_other = (np.array(candidate.geometry.quat(0.5)) for candidate in (path, other))
    is_free = abs(float(middle @ middle_of_other)) < _SAME_TURN
    return (
        other if is_free and not goes_on(robot, path.at, start) and goes_on(robot, other.at, start) else path
    )


def goes_on(
    robot: RobotModel,
    at: Callable[[float, Array], Array],
    start: Array,
    *,
    end: float = 1.0,
    looks: int = _LOOKS,
) -> bool:
    """Whether the arm can follow a path within its joint limits, by samples.

    Args:
        robot: the robot.
        at: joint positions at a path parameter, next to others, shape (7,) [rad]; Unreachable: there are none.
        start: joint positions at 0, shape (7,) [rad].
        end: last path parameter.
        looks: number of samples.
    """
    near = start
    for s in np.linspace(0.0, end, looks)[1:].tolist():
        try:
            q = at(s, near)
        except Unreachable:
            return False
        if float(np.abs(q - near).max()) > LARGEST_STEP or not inside(robot, q.tolist()):
            return False
        near = q
    return True


def programmed_speed(dynamics: seam.CartesianDynamics, path: CartesianPath) -> float:
    """Largest ds/dt that a motion allows along its path; infinite where only the elbow moves."""
    speeds = (
        (or_default(dynamics.velocity, CARTESIAN_DEFAULT[0]), path.length),
        (or_default(dynamics.orientation_velocity, ORIENTATION_DEFAULT[0]), path.angle),
    )
    fastest = min((speed / size for speed, size in speeds if size > STILL), default=inf)
    if isinstance(path.geometry, Arc):
        acceleration = or_default(dynamics.acceleration, CARTESIAN_DEFAULT[1])
        fastest = min(fastest, sqrt(acceleration * path.geometry.radius) / path.length)
    return fastest


def segment_limits(motion: JointMotion | PathMotion | SplineSegment) -> SegmentLimits:
    """What a motion allows, beside its speed along the path."""
    if isinstance(motion, JointMotion):
        return _joint_limits(motion.dynamics)
    _, *line = CARTESIAN_DEFAULT
    _, *turn = ORIENTATION_DEFAULT
    given = motion.dynamics
    return replace(
        _joint_limits(motion.joints),
        line=(or_default(given.acceleration, line[0]), or_default(given.jerk, line[1])),
        turn=(
            or_default(given.orientation_acceleration, turn[0]),
            or_default(given.orientation_jerk, turn[1]),
        ),
    )


def _joint_limits(given: seam.JointDynamics) -> SegmentLimits:
    return SegmentLimits(
        np.array(fractions(given.velocity)),
        np.array(fractions(given.acceleration)),
        np.array(fractions(given.jerk)),
    )
