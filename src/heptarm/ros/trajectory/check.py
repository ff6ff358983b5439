"""Checks a goal (names, sizes, numbers, times, limits, a jump at its start) and makes a trajectory of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalRefused, TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.trajectory import JointTrajectory, KinematicState
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Largest velocity that counts as rest [rad/s]: the last digit of a float32. Integrated ones add up rounding errors.
_REST, _INTEGRATED_REST = float(np.finfo(np.float32).eps), 1e-6
#: Longest trajectory, and longest wait for its start [s]; longer ones are mistakes, such as milliseconds for seconds.
_LONGEST_TRAJECTORY, _LONGEST_WAIT = 86400.0, 3600.0
#: Planners round: values may exceed a limit by this fraction of it.
_MARGIN = 1e-3
#: Fields of a point and their names in a message.
_FIELDS = (("q", "positions"), ("dq", "velocities"), ("ddq", "accelerations"))


@dataclass(frozen=True, slots=True)
class GoalRules:
    """Which goals are accepted.

    Attributes:
        partial: joints may be missing; they hold their positions.
        moving_end: the last point may have a velocity.
        integrate: points may lack positions; they are integrated from velocities, or from accelerations.
        jump: largest distance from the arm to a first point at time 0 [rad].
        speed: speed limit, a fraction of each axis' maximum in (0, 1].
    """

    partial: bool = False
    moving_end: bool = False
    integrate: bool = False
    jump: float = 0.05
    speed: float = 1.0


def check_goal(
    goal: TrajectoryGoal,
    names: Sequence[str],
    robot: RobotModel,
    *,
    here: KinematicState,
    now: float,
    rules: GoalRules,
) -> JointTrajectory:
    """Check a goal and make its trajectory, which begins where the arm is.

    Args:
        goal: as received.
        names: of the arm's joints, seven.
        robot: its limits.
        here: state of the arm when the trajectory starts.
        now: current time on the clock of the execution [s].
        rules: which goals are accepted.

    Returns:
        The trajectory; its time 0 is the goal's start, or now if that is in the past.

    Raises:
        GoalRefused: with the code for the client.
    """
    columns = _columns(goal, names, rules)
    _check_points(goal, rules)
    late = 0.0 if goal.start is None else max(0.0, now - goal.start)
    if goal.start is not None and goal.start + goal.points[-1].time < now:
        raise GoalRefused(
            f"the trajectory ended {now - goal.start - goal.points[-1].time:.3f} s ago; it must end in the future",
            hint="synchronise the clocks of both machines, or send a zero time stamp",
        )
    if goal.start is not None and goal.start - now > _LONGEST_WAIT:
        raise GoalRefused(
            f"the trajectory must start within {_LONGEST_WAIT:g} s, got {goal.start - now:g} s from now",
            hint="synchronise the clocks of both machines, or send a zero time stamp",
        )
    times = np.array([point.time for point in goal.points]) - late
    q, dq, ddq = (_matrix(goal.points, name, columns) for name, _ in _FIELDS)
    held = [joint for joint in range(7) if joint not in columns]
    for values, rest in ((q, here.q), (dq, np.zeros(7)), (ddq, np.zeros(7))):
        given = ~np.isnan(values).all(axis=1)
        for joint in held:
            values[given, joint] = rest[joint]
    if np.isnan(q).any():
        _integrate(times, q, dq, ddq, here)
        if not rules.moving_end and np.abs(np.nan_to_num(dq[-1])).max() > _INTEGRATED_REST:
            joint = int(np.argmax(np.abs(dq[-1])))
            raise GoalRefused(
                f"the last point must be at rest, got {dq[-1, joint]:g} rad/s for {names[joint]} by integration",
                hint="end with zero velocities, or set allow_nonzero_velocity_at_trajectory_end",
            )
    _check_limits(q, dq, ddq, names, robot)
    times, q, dq, ddq = _from_here(times, q, dq, ddq, here, late > 0.0, names, rules)
    trajectory = JointTrajectory(times, q, dq, ddq)
    check_between_points(trajectory, names, robot, rules)
    return trajectory


def check_form(goal: TrajectoryGoal, names: Sequence[str], rules: GoalRules) -> None:
    """Check what does not depend on the arm: names, sizes, numbers and times.

    Args:
        goal: as received.
        names: of the arm's joints, seven.
        rules: which goals are accepted; the last point may have a velocity in any case.

    Raises:
        GoalRefused: with the code for the client.
    """
    _columns(goal, names, rules)
    _check_points(goal, replace(rules, moving_end=True))


def check_points(
    goal: TrajectoryGoal, names: Sequence[str], robot: RobotModel, *, here: KinematicState, rules: GoalRules
) -> tuple[Array, Array | None]:
    """Check a goal that belongs to a stream.

    Args:
        goal: as received.
        names: of the arm's joints, seven.
        robot: its limits.
        here: state of the arm; missing joints keep its positions.
        rules: which goals are accepted; the last point may have a velocity in any case.

    Returns:
        Positions [rad], and velocities [rad/s] if all points have some, shape (n, 7).

    Raises:
        GoalRefused: with the code for the client.
    """
    columns = _columns(goal, names, rules)
    _check_points(goal, replace(rules, moving_end=True, integrate=False))
    q, dq, ddq = (_matrix(goal.points, name, columns) for name, _ in _FIELDS)
    _check_limits(q, dq, ddq, names, robot)
    moves = not np.isnan(dq).all(axis=1).any()
    return np.where(np.isnan(q), here.q, q), np.nan_to_num(dq) if moves else None


def _columns(goal: TrajectoryGoal, names: Sequence[str], rules: GoalRules) -> list[int]:
    """Map the goal's joints to the indices of the arm's."""
    allowed = f"the joints are {', '.join(names)}"
    if not goal.joints:
        raise GoalRefused("the goal names no joints", reason=ErrorCode.INVALID_JOINTS, hint=allowed)
    for name in goal.joints:
        if name not in names:
            raise GoalRefused(f"unknown joint {name!r}", reason=ErrorCode.INVALID_JOINTS, hint=allowed)
    if len(set(goal.joints)) != len(goal.joints):
        twice = next(name for name in goal.joints if goal.joints.count(name) > 1)
        raise GoalRefused(f"joint {twice!r} appears twice", reason=ErrorCode.INVALID_JOINTS, hint=allowed)
    if len(goal.joints) != len(names) and not rules.partial:
        missing = ", ".join(name for name in names if name not in goal.joints)
        raise GoalRefused(
            f"the goal lacks the joints {missing}",
            reason=ErrorCode.INVALID_JOINTS,
            hint="name all joints, or set allow_partial_joints_goal",
        )
    return [list(names).index(name) for name in goal.joints]


def _check_points(goal: TrajectoryGoal, rules: GoalRules) -> None:
    if not goal.points:
        raise GoalRefused("the trajectory has no points")
    if goal.extras:
        raise GoalRefused(f"{', '.join(goal.extras)} is not supported", hint="leave it empty")
    if goal.start is not None and not math.isfinite(goal.start):
        raise GoalRefused(f"the time stamp must be finite, got {goal.start} s")
    count, before = len(goal.joints), -math.inf
    for number, point in enumerate(goal.points):
        if not 0.0 <= point.time <= _LONGEST_TRAJECTORY:
            raise GoalRefused(
                f"point {number}: time_from_start must be in [0, {_LONGEST_TRAJECTORY:g}] s, got {point.time:g} s"
            )
        if point.time <= before:
            raise GoalRefused(
                f"point {number}: time_from_start must be later than that of the point before, {before:g} s, "
                f"got {point.time:g} s"
            )
        before = point.time
        if not point.q and not rules.integrate:
            raise GoalRefused(
                f"point {number} has no positions",
                hint="add them, or set allow_integration_in_goal_trajectories",
            )
        if not (point.q or point.dq or point.ddq):
            raise GoalRefused(f"point {number} has neither positions nor velocities nor accelerations")
        if point.effort:
            raise GoalRefused(
                f"point {number} has effort; trajectories command positions only", hint="leave it empty"
            )
        for name, words in _FIELDS:
            values = getattr(point, name)
            if values and len(values) != count:
                raise GoalRefused(f"point {number} must have {count} {words}, got {len(values)}")
            for joint, value in zip(goal.joints, values):
                if not math.isfinite(value):
                    raise GoalRefused(f"point {number}: {words} of {joint} must be finite, got {value}")
    if not rules.moving_end:
        for joint, value in zip(goal.joints, goal.points[-1].dq):
            if abs(value) > _REST:
                raise GoalRefused(
                    f"the last point must be at rest, got {value:g} rad/s for {joint}",
                    hint="give it zero velocities, or set allow_nonzero_velocity_at_trajectory_end",
                )


def _matrix(points: Sequence[TrajectoryPoint], name: str, columns: list[int]) -> Array:
    """Collect one field of all points in the arm's order, shape (n, 7); NaN: not given."""
    out = np.full((len(points), 7), np.nan)
    for row, point in enumerate(points):
        values = getattr(point, name)
        if values:
            out[row, columns] = values
    return out


def _integrate(times: Array, q: Array, dq: Array, ddq: Array, here: KinematicState) -> None:
    """Fill in positions, and velocities where there are only accelerations, by the trapezoidal rule.

    joint_trajectory_controller integrates in the same way. A point of the past is where the arm is.

    Args:
        times: of the points from now on, shape (n,) [s].
        q: positions, shape (n, 7) [rad]; NaN: to fill in.
        dq: velocities, likewise [rad/s].
        ddq: accelerations, likewise [rad/s²].
        here: state of the arm at time 0.
    """
    before, q0, v0, a0 = 0.0, here.q, here.dq, here.ddq
    for row, time in enumerate(times):
        span = max(0.0, float(time) - before)
        missing = np.isnan(q[row])
        if missing.any():
            a1 = np.nan_to_num(ddq[row])
            speed = np.where(np.isnan(dq[row]), v0 + span * (a0 + a1) / 2.0, dq[row])
            q[row] = np.where(missing, q0 + span * (v0 + speed) / 2.0, q[row])
            dq[row] = speed
        before, q0 = max(0.0, float(time)), q[row]
        v0, a0 = np.nan_to_num(dq[row]), np.nan_to_num(ddq[row])


def _check_limits(q: Array, dq: Array, ddq: Array, names: Sequence[str], robot: RobotModel) -> None:
    for values, low, high, unit in (
        (q, robot.q_min, robot.q_max, "rad"),
        (dq, -robot.dq_max, robot.dq_max, "rad/s"),
        (ddq, -robot.ddq_max, robot.ddq_max, "rad/s²"),
    ):
        margin = _MARGIN * (high - low) / 2 if unit != "rad" else 0.0
        beyond = (values < low - margin) | (values > high + margin)  # NaN is not beyond
        if beyond.any():
            row, joint = (int(i) for i in np.argwhere(beyond)[0])
            raise GoalRefused(
                f"point {row}: {names[joint]} must be in [{low[joint]:.4f}, {high[joint]:.4f}] {unit}, "
                f"got {values[row, joint]:.4f} {unit}",
                hint="keep the trajectory inside the limits",
            )


def _from_here(
    times: Array,
    q: Array,
    dq: Array,
    ddq: Array,
    here: KinematicState,
    late: bool,
    names: Sequence[str],
    rules: GoalRules,
) -> tuple[Array, Array, Array, Array]:
    """Put the state of the arm before the points, and drop the points of the past."""
    first = int(np.searchsorted(times, 0.0, side="right"))
    # the arm has to be at a first point that is now, and at a last one whose time is over
    if first > 0 and (not late or first == len(times)):
        away = np.abs(q[first - 1] - here.q)
        worst = int(np.argmax(away))
        if away[worst] > rules.jump:
            raise GoalRefused(
                f"the {'last' if late else 'first'} point is due now, so it must be within {rules.jump:g} rad "
                f"of the arm, got {away[worst]:.4f} rad for {names[worst]}",
                hint="plan from the current state, or give the point a later time",
            )
    if first == len(times):  # the last point is now
        begin, end = here, slice(first - 1, None)
        gap = np.abs(q[-1] - begin.q).max()
        return (
            np.array([0.0]),
            q[end],
            np.where(gap > 0, np.nan, dq[end]),
            np.full((1, 7), np.nan),
        )
    rest = slice(first, None)
    speed = here.dq if not np.isnan(dq[first]).any() else np.full(7, np.nan)
    change = here.ddq if not np.isnan(ddq[first]).any() else np.full(7, np.nan)
    return (
        np.concatenate([[0.0], times[rest]]),
        np.vstack([here.q, q[rest]]),
        np.vstack([speed, dq[rest]]),
        np.vstack([change, ddq[rest]]),
    )


def check_between_points(
    trajectory: JointTrajectory, names: Sequence[str], robot: RobotModel, rules: GoalRules
) -> None:
    """Check the limits between the points, where a cubic may overshoot."""
    q, dq = trajectory.extremes()
    limit = rules.speed * robot.dq_max * (1.0 + _MARGIN)
    fast = np.abs(dq) > limit
    if fast.any():
        row, joint = (int(i) for i in np.argwhere(fast)[0])
        raise GoalRefused(
            f"speed of {names[joint]} between two points must be at most {limit[joint]:.3f} rad/s, "
            f"got {abs(dq[row, joint]):.3f} rad/s",
            hint="give the points more time",
        )
    out = (q < robot.q_min - _MARGIN) | (q > robot.q_max + _MARGIN)
    out[: 16 if len(trajectory.times) > 1 else 0] &= False  # the arm itself may already be beyond a limit
    if out.any():
        row, joint = (int(i) for i in np.argwhere(out)[0])
        raise GoalRefused(
            f"{names[joint]} must stay in [{robot.q_min[joint]:.4f}, {robot.q_max[joint]:.4f}] rad between two points, "
            f"got {q[row, joint]:.4f} rad",
            hint="send more points or smaller velocities",
        )
