"""Reads a goal: order of joints, duplicates, sizes, numbers, times, limits, a jump at its start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heptarm.bridge.goal import Code, Goal, GoalRefused, Point
from heptarm.bridge.trajectory import Sample, Trajectory
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

#: A velocity this small counts as rest [rad/s]: the last digit of a float32.
_STILL = float(np.finfo(np.float32).eps)
#: Numbers that come out of a planner may be beyond a limit by so much of it.
_ROOM = 1e-3
#: A way-point's fields, what they are called in a message, and whether every one must have them.
_FIELDS = (("q", "positions"), ("dq", "velocities"), ("ddq", "accelerations"))


@dataclass(frozen=True, slots=True)
class Rules:
    """What a goal may be.

    Attributes:
        partial: some joints may be missing; they hold where they are.
        moving_end: the last way-point may have a velocity.
        jump: how far from the arm a trajectory may begin that begins at once [rad].
        speed: ceiling, a fraction of each axis' maximum in (0, 1].
    """

    partial: bool = False
    moving_end: bool = False
    jump: float = 0.05
    speed: float = 1.0


def read(
    goal: Goal, names: Sequence[str], robot: RobotModel, *, here: Sample, now: float, rules: Rules
) -> Trajectory:
    """The trajectory of a goal, from where the arm is; its time 0 is the goal's start, or now if that is past.

    Args:
        goal: as it came.
        names: of the arm's joints, seven.
        robot: its limits.
        here: where the arm is when the trajectory starts.
        now: the time on the runner's clock [s].
        rules: what is allowed.

    Raises:
        GoalRefused: with the code for the client.
    """
    columns = _columns(goal, names, rules)
    _check_points(goal, rules)
    late = 0.0 if goal.start is None else max(0.0, now - goal.start)
    if goal.start is not None and goal.start + goal.points[-1].time < now:
        raise GoalRefused(
            f"the trajectory ended {now - goal.start - goal.points[-1].time:.3f} s ago",
            hint="are the clocks of both machines the same?",
        )
    times = np.array([point.time for point in goal.points]) - late
    q, dq, ddq = (_matrix(goal.points, name, columns) for name, _ in _FIELDS)
    held = [joint for joint in range(7) if joint not in columns]
    for values, still in ((q, here.q), (dq, np.zeros(7)), (ddq, np.zeros(7))):
        given = ~np.isnan(values).all(axis=1)
        for joint in held:
            values[given, joint] = still[joint]
    _check_limits(goal, q, dq, ddq, names, robot)
    times, q, dq, ddq = _joined(times, q, dq, ddq, here, late > 0.0, names, rules)
    trajectory = Trajectory(times, q, dq, ddq)
    _check_way(trajectory, names, robot, rules)
    return trajectory


def _columns(goal: Goal, names: Sequence[str], rules: Rules) -> list[int]:
    """Which of the arm's joints each of the goal's is."""
    wanted = f"the joints are {', '.join(names)}"
    if not goal.joints:
        raise GoalRefused("no joint is named", reason=Code.INVALID_JOINTS, hint=wanted)
    for name in goal.joints:
        if name not in names:
            raise GoalRefused(f"unknown joint {name!r}", reason=Code.INVALID_JOINTS, hint=wanted)
    if len(set(goal.joints)) != len(goal.joints):
        twice = next(name for name in goal.joints if goal.joints.count(name) > 1)
        raise GoalRefused(f"joint {twice!r} is named twice", reason=Code.INVALID_JOINTS, hint=wanted)
    if len(goal.joints) != len(names) and not rules.partial:
        missing = ", ".join(name for name in names if name not in goal.joints)
        raise GoalRefused(
            f"joints are missing: {missing}",
            reason=Code.INVALID_JOINTS,
            hint="name all joints, or set allow_partial_joints_goal",
        )
    return [list(names).index(name) for name in goal.joints]


def _check_points(goal: Goal, rules: Rules) -> None:
    if not goal.points:
        raise GoalRefused("the trajectory has no points")
    if goal.extras:
        raise GoalRefused(f"{', '.join(goal.extras)} cannot be followed", hint="leave it empty")
    if goal.start is not None and not math.isfinite(goal.start):
        raise GoalRefused("the time stamp is not finite")
    count, before = len(goal.joints), -math.inf
    for number, point in enumerate(goal.points):
        if not math.isfinite(point.time) or point.time < 0.0:
            raise GoalRefused(f"point {number}: time_from_start is {point.time:g} s; 0 or more is wanted")
        if point.time <= before:
            raise GoalRefused(
                f"point {number}: time_from_start is {point.time:g} s after {before:g} s; each must be later"
            )
        before = point.time
        if not point.q:
            raise GoalRefused(f"point {number} has no positions")
        if point.effort:
            raise GoalRefused(f"point {number} has effort, which this arm is not commanded by")
        for name, words in _FIELDS:
            values = getattr(point, name)
            if values and len(values) != count:
                raise GoalRefused(f"point {number} has {len(values)} {words}; {count} are wanted")
            for joint, value in zip(goal.joints, values):
                if not math.isfinite(value):
                    raise GoalRefused(f"point {number}: {words} of {joint} is {value}; it must be finite")
    if not rules.moving_end:
        for joint, value in zip(goal.joints, goal.points[-1].dq):
            if abs(value) > _STILL:
                raise GoalRefused(
                    f"the last point moves: {joint} at {value:g} rad/s",
                    hint="end at rest, or set allow_nonzero_velocity_at_trajectory_end",
                )


def _matrix(points: Sequence[Point], name: str, columns: list[int]) -> Array:
    """One field of all points in the arm's order, shape (n, 7); NaN: not given."""
    out = np.full((len(points), 7), np.nan)
    for row, point in enumerate(points):
        values = getattr(point, name)
        if values:
            out[row, columns] = values
    return out


def _check_limits(
    goal: Goal, q: Array, dq: Array, ddq: Array, names: Sequence[str], robot: RobotModel
) -> None:
    for values, low, high, unit in (
        (q, robot.q_min, robot.q_max, "rad"),
        (dq, -robot.dq_max, robot.dq_max, "rad/s"),
        (ddq, -robot.ddq_max, robot.ddq_max, "rad/s²"),
    ):
        room = _ROOM * (high - low) / 2 if unit != "rad" else 0.0
        beyond = (values < low - room) | (values > high + room)  # NaN is not beyond
        if beyond.any():
            row, joint = (int(i) for i in np.argwhere(beyond)[0])
            raise GoalRefused(
                f"point {row}: {names[joint]} is {values[row, joint]:.4f} {unit}; "
                f"allowed is [{low[joint]:.4f}, {high[joint]:.4f}] {unit}",
                hint="keep the trajectory inside the limits",
            )


def _joined(
    times: Array,
    q: Array,
    dq: Array,
    ddq: Array,
    here: Sample,
    late: bool,
    names: Sequence[str],
    rules: Rules,
) -> tuple[Array, Array, Array, Array]:
    """The way-points with the arm's own place before them; those of the past are left out."""
    first = int(np.searchsorted(times, 0.0, side="right"))
    if first > 0 and not late:  # the first point is now: the arm has to be there
        away = np.abs(q[first - 1] - here.q)
        worst = int(np.argmax(away))
        if away[worst] > rules.jump:
            raise GoalRefused(
                f"the trajectory begins {away[worst]:.4f} rad away from where {names[worst]} is; "
                f"allowed is {rules.jump:g} rad",
                hint="plan from the present state, or give the first point time to get there",
            )
    if first == len(times):  # one point, now
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


def _check_way(trajectory: Trajectory, names: Sequence[str], robot: RobotModel, rules: Rules) -> None:
    """Between the way-points limits hold as well: a cubic can overshoot."""
    q, dq = trajectory.extremes()
    ceiling = rules.speed * robot.dq_max * (1.0 + _ROOM)
    fast = np.abs(dq) > ceiling
    if fast.any():
        row, joint = (int(i) for i in np.argwhere(fast)[0])
        raise GoalRefused(
            f"{names[joint]} would have to move at {abs(dq[row, joint]):.3f} rad/s on its way; "
            f"allowed is {ceiling[joint]:.3f} rad/s",
            hint="give the points more time",
        )
    out = (q < robot.q_min - _ROOM) | (q > robot.q_max + _ROOM)
    out[: 16 if len(trajectory.times) > 1 else 0] &= False  # where the arm is, it is
    if out.any():
        row, joint = (int(i) for i in np.argwhere(out)[0])
        raise GoalRefused(
            f"{names[joint]} would overshoot to {q[row, joint]:.4f} rad between two points; allowed is "
            f"[{robot.q_min[joint]:.4f}, {robot.q_max[joint]:.4f}] rad",
            hint="give more points or smaller velocities",
        )
