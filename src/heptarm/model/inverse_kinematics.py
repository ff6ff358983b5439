"""Inverse kinematics of an LBR with KUKA's redundancy: E1, Status and Turn; and the arm angle.

E1 is the angle of A3, as in Sunrise. Status: bit 0, the wrist is behind A1's x axis; bit 1, A4 < 0; bit 2, A6 <= 0.
Turn: bit i, A(i+1) < 0. E1 and Status belong to one arm position of a pose. The arm angle is the elbow's turn about
the shoulder-wrist line, from the arm with A3 = 0 in the same Status. `native/redundancy.c` computes all of it and
names its sources.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from math import isnan, nan, sqrt

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError, Unreachable
from heptarm.model.native import Joints, Matrix, Reals, Spans, constants, one, values_of
from heptarm.values.checks import Array, array, finite, finite_entries, instance, integer, numbers
from heptarm.values.pose import NOT_GIVEN, Pose, Redundancy, check_rotation
from heptarm.values.robot import RobotModel

#: Outcomes of a solution in C.
FOUND, TOO_FAR = 1, 0
#: Solutions this far outside the joint limits are on them [rad].
_ON_LIMIT = 1e-9
#: Where a joint position is undetermined and nothing is known.
_MIDDLE = Joints()


def _matrix(pose: Pose | Array) -> Reals:
    """A pose or a homogeneous matrix for C.

    Raises:
        ShapeError: it has another shape, or is no rotation.
    """
    if isinstance(pose, Pose):
        return Matrix(*pose.matrix.ravel().tolist())
    given = finite_entries(numbers(pose, "pose", "a Pose or a matrix of shape (4, 4)"), "pose")
    if given.shape not in ((4, 4), (3, 4)):
        raise ShapeError(f"pose must have shape (4, 4), got {given.shape}", parameter="pose", value=pose)
    check_rotation(given[:3, :3], "pose")
    return Matrix(*given.ravel().tolist())


def _robot(robot: RobotModel) -> RobotModel:
    return instance(robot, RobotModel, "robot")


def too_far(robot: RobotModel, pose: Reals) -> Unreachable:
    """The refusal of a pose, 16 numbers, whose wrist is too far from the shoulder, or too near."""
    wrist = [pose[4 * i + 3] - robot.d_wf * pose[4 * i + 2] for i in range(3)]
    away = sqrt(wrist[0] ** 2 + wrist[1] ** 2 + (wrist[2] - robot.d_bs) ** 2)
    near, far = abs(robot.d_se - robot.d_ew), robot.d_se + robot.d_ew
    return Unreachable(
        f"the wrist would be {away:.3f} m from the shoulder; the {robot.title} reaches {near:.3f} to {far:.3f} m",
        code=51,
        value=round(away, 4),
        allowed=f"[{near:.3f}, {far:.3f}] m",
        hint="bring the target nearer, or change its orientation",
    )


def _no_posture(robot: RobotModel, e1: float, status: int, fixed: str) -> Unreachable:
    low, high = robot.q_min[2], robot.q_max[2]
    if not isnan(e1) and not low <= e1 <= high:
        return Unreachable(
            f"E1 is the angle of A3, which must be in [{np.degrees(low):.0f}, {np.degrees(high):.0f}] deg on the "
            f"{robot.title}, got {np.degrees(e1):.2f} deg",
            code=51,
            value=e1,
            allowed=f"[{low:.4f}, {high:.4f}] rad",
            hint="keep E1 inside the limits of A3, or leave it free",
        )
    return Unreachable(
        f"the pose is within reach, but every arm position that reaches it{fixed} violates a joint limit",
        code=51,
        hint="change the orientation" + (f", or leave{fixed.partition(' that')[2]} free" if fixed else ""),
    )


def inside(robot: RobotModel, q: Sequence[float], tolerance: float = _ON_LIMIT) -> bool:
    """Whether all joints are within their limits."""
    return all(
        low - tolerance <= value <= high + tolerance
        for low, value, high in zip(robot.q_min.tolist(), q, robot.q_max.tolist(), strict=True)
    )


def status_of(robot: RobotModel, q: Sequence[float]) -> int:
    """Status bits of a joint position."""
    return int(one().hi_status(constants(robot), Joints(*q)))


def arm_angle(robot: RobotModel, q: npt.ArrayLike) -> float:
    """Arm angle of a joint position: the elbow's turn about the shoulder-wrist line.

    It is measured from the arm that reaches the wrist with A3 = 0 in the same Status (Shimizu et al. 2008). It is not
    Sunrise's E1, which is the angle of A3. Where the arm is straight, or the wrist above the shoulder, the posture
    does not determine it well.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].

    Returns:
        In (-pi, pi] [rad].
    """
    return float(one().hi_arm_angle(constants(_robot(robot)), Joints(*array(q, 7, "q").tolist())))


def redundancy(robot: RobotModel, q: npt.ArrayLike) -> Redundancy:
    """E1 (the angle of A3), Status and Turn of a joint position, shape (7,) [rad]."""
    _robot(robot)
    values = array(q, 7, "q").tolist()
    turn = sum((value < 0) << index for index, value in enumerate(values))
    return Redundancy(values[2], status_of(robot, values), turn)


def intervals(robot: RobotModel, pose: Pose | Array, status: int) -> list[tuple[float, float]]:
    """Arm angles at which a flange pose can be held in a Status within the joint limits.

    `solve(..., arm_angle=, status=)` gives the joint positions for one of them.

    Args:
        robot: the robot.
        pose: of the flange in the base frame.
        status: bits 0-2.

    Returns:
        Closed intervals of arm angles [rad], ascending, the lower end in (-pi, pi]; one that passes through pi goes
        on above it.

    Raises:
        Unreachable: out of reach.
    """
    given, spans = _matrix(pose), Spans()
    count = one().hi_intervals(constants(_robot(robot)), given, integer(status, "status", 0, 7), spans)
    if count < 0:
        raise too_far(robot, given)
    return [(spans[2 * index], spans[2 * index + 1]) for index in range(count)]


def solve(
    robot: RobotModel,
    pose: Pose | Array,
    *,
    e1: float | None = None,
    status: int | None = None,
    near: npt.ArrayLike | None = None,
    arm_angle: float | None = None,
) -> Array:
    """Solve the inverse kinematics: joint positions within the limits for a flange pose.

    E1, Status and arm angle are kept if given. Otherwise A3 and Status stay those of `near`, unless another arm
    position needs less than a fifth of that way: then it is the one nearest to `near`. If there is a solution within
    the limits, one is found. Where axes coincide, so that the pose does not determine joints (A2, A4 or A6 near 0),
    those joints stay as near to `near` as the pose allows within 1e-9 m and rad. Without `near`, a usual bent arm takes
    its place.

    Args:
        robot: the robot.
        pose: of the flange in the base frame.
        e1: angle of A3 [rad]; None: not given.
        status: bits 0-2; None or -1: not given.
        near: joint positions, shape (7,) [rad].
        arm_angle: see `model.arm_angle` [rad]; None: not given.

    Returns:
        Shape (7,) [rad]. A joint that the pose needs up to 2e-5 rad beyond its limit, as by noise, is on the limit.

    Raises:
        CommandRejected: both E1 and an arm angle are given.
        LimitError: a value is outside its range, such as Status 8.
        ShapeError: a wrong shape, or a matrix whose rotation is none.
        Unreachable: no solution within the joint limits; the text names the cause.
    """
    _robot(robot)
    matrix = _matrix(pose)
    hint = None if near is None else Joints(*array(near, 7, "near").tolist())
    given = Redundancy(NOT_GIVEN if e1 is None else e1, -1 if status is None else status)
    if arm_angle is not None:
        if not isnan(given.e1):
            raise CommandRejected(
                "both e1 and arm_angle are given",
                parameter="arm_angle",
                hint="give one of them: each fixes the elbow",
            )
        angle = finite(arm_angle, "arm_angle", unit="rad")
        return _with_arm_angle(robot, matrix, angle, given.status, hint)
    outcome, found = _solved(robot, matrix, given.e1, given.status, hint)
    if outcome == FOUND:
        return values_of(found)
    if outcome == TOO_FAR:
        raise too_far(robot, matrix)
    fixed = " with that E1 or Status" if not isnan(given.e1) or given.status >= 0 else ""
    raise _no_posture(robot, given.e1, given.status, fixed)


def _solved(
    robot: RobotModel, matrix: Reals, e1: float, status: int, near: Reals | None
) -> tuple[int, Reals]:
    outcome, found = ctypes.c_int(), Joints()
    one().hi_solve(
        constants(robot),
        1,
        matrix,
        ctypes.byref(ctypes.c_double(e1)),
        ctypes.byref(ctypes.c_int(status)),
        near,
        not isnan(e1),
        found,
        ctypes.byref(outcome),
    )
    return outcome.value, found


def at_arm_angle(
    robot: RobotModel, matrix: Reals, angle: float, status: int, near: Reals | None
) -> tuple[float, ...]:
    """Joint positions of a pose for an arm angle and a Status; limits are not checked.

    Raises:
        Unreachable: out of reach.
    """
    found = Joints()
    if not one().hi_with_arm_angle(constants(robot), matrix, angle, status, near or _MIDDLE, found):
        raise too_far(robot, matrix)
    return tuple(found)


def _with_arm_angle(robot: RobotModel, matrix: Reals, angle: float, status: int, near: Reals | None) -> Array:
    """The solution with an arm angle that is nearest to `near`; without it, in the lowest Status."""
    states = range(8) if status < 0 else (status,)
    found = [q for s in states if inside(robot, q := at_arm_angle(robot, matrix, angle, s, near))]
    if not found:
        raise _no_posture(robot, nan, status, " with that arm angle or Status")
    goal = np.array(found[0] if near is None else near)
    best = min(found, key=lambda q: float(np.sum((np.array(q) - goal) ** 2)))
    return np.clip(best, robot.q_min, robot.q_max)


def solve_all(robot: RobotModel, pose: Pose | Array, *, e1: float | None = None) -> list[Array]:
    """Find solutions within the joint limits.

    Args:
        robot: the robot.
        pose: of the flange in the base frame.
        e1: angle of A3 [rad]; None: the middle of each interval of arm angles.

    Returns:
        For an E1: one for each Status that has one, up to 8. Without: one for each interval of each
        Status. Each has shape (7,) [rad].

    Raises:
        Unreachable: out of reach.
    """
    matrix = _matrix(pose)
    if e1 is not None:
        angle = finite(e1, "e1", unit="rad")
        solved = [_solved(_robot(robot), matrix, angle, status, None) for status in range(8)]
        if solved[0][0] == TOO_FAR:
            raise too_far(robot, matrix)
        return [np.array(found) for outcome, found in solved if outcome == FOUND]
    middles = [(status, (a + b) / 2) for status in range(8) for a, b in intervals(robot, pose, status)]
    solutions = [at_arm_angle(robot, matrix, angle, status, None) for status, angle in middles]
    return [np.array(q) for q in solutions if inside(robot, q)]


class PathInverse:
    """Joint positions along a path of the tool frame, each next to the ones before; limits are not checked.

    Args:
        robot: the robot.
        tcp: flange to tool frame.
    """

    __slots__ = ("_arm", "_robot", "_solve", "_tool")

    def __init__(self, robot: RobotModel, tcp: Pose) -> None:
        back = tcp.inverse()
        self._robot, self._arm, self._solve = robot, constants(robot), one().hi_joints
        self._tool = Joints(*back.xyz.tolist(), *back.quat.tolist())

    def joints(self, point: Sequence[float], quat: Sequence[float], near: Array, *, a3: float = nan) -> Array:
        """Joint positions next to `near` for the tool frame at a point with an orientation, shape (7,) [rad].

        Args:
            point: in the base, 3 [m].
            quat: in the base, x y z w.
            near: joint positions, shape (7,) [rad]; A3 stays, unless another arm position is much nearer.
            a3: angle that A3 must have [rad]; NaN: any.

        Raises:
            Unreachable: out of reach, or not with this A3.
        """
        found = Joints()
        fixed = not isnan(a3)
        outcome = self._solve(self._arm, self._tool, *point, *quat, a3, fixed, Joints(*near.tolist()), found)
        if outcome == FOUND:
            return values_of(found)
        if outcome == TOO_FAR:
            place = Pose(np.array(point), np.array(quat)) @ Pose(
                np.array(self._tool[:3]), np.array(self._tool[3:])
            )
            raise too_far(self._robot, _matrix(place))
        raise Unreachable(
            f"no arm position has A3 at {np.degrees(a3):.1f} deg there",
            code=51,
            hint="leave E1 free, or change it",
        )
