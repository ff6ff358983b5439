"""Tolerances of a trajectory, and the one algorithm that judges them, whichever execution moves the arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, Tolerance, TrajectoryGoal
from heptarm.ros.trajectory.trajectory import JointTrajectory, KinematicState
from heptarm.values.checks import Array, Value, frozen

#: In a goal's tolerance: do not enforce this one.
ERASED = -1.0


def _zeros() -> Array:
    return frozen(np.zeros(7))


@dataclass(frozen=True, slots=True, eq=False)
class StateTolerances(Value):
    """Largest allowed errors per joint; 0: not enforced.

    Attributes:
        position: shape (7,) [rad].
        velocity: shape (7,) [rad/s].
        acceleration: shape (7,) [rad/s²]; stored, but never checked: the robot reports no accelerations.
    """

    position: Array = field(default_factory=_zeros)
    velocity: Array = field(default_factory=_zeros)
    acceleration: Array = field(default_factory=_zeros)

    def violation(self, names: Sequence[str], desired: KinematicState, q: Array, dq: Array) -> str:
        """Describe the first joint outside its tolerance; empty: none is. NaN velocities are not checked."""
        for bound, error, what, unit in (
            (self.position, desired.q - q, "position", "rad"),
            (self.velocity, np.nan_to_num(desired.dq - dq), "velocity", "rad/s"),
        ):
            violated = (bound > 0.0) & ~(np.abs(error) <= bound)
            if violated.any():
                joint = int(np.argmax(violated))
                found = f"{what} error of {names[joint]} is {error[joint]:+.5f} {unit}"
                return f"{found}, allowed is {bound[joint]:g} {unit}"
        return ""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryTolerances(Value):
    """All tolerances of a trajectory.

    Attributes:
        path: while the trajectory is executed.
        goal: at its end.
        goal_time: how long after its end the arm may take to meet `goal` [s]; 0: no limit.
        cmd_timeout: likewise, independent of the goal's own `goal_time` [s]; 0: no limit.
    """

    path: StateTolerances = field(default_factory=StateTolerances)
    goal: StateTolerances = field(default_factory=StateTolerances)
    goal_time: float = 0.0
    cmd_timeout: float = 0.0

    def of(self, goal: TrajectoryGoal, names: Sequence[str]) -> tuple[TrajectoryTolerances, str]:
        """Override these defaults with the tolerances of a goal.

        A goal with an invalid tolerance (a negative number other than -1, an unknown joint) is not refused: all
        defaults apply, as in ros2_control, and the returned text gives the reason.

        Returns:
            The tolerances, and why those of the goal were ignored; empty: they were not.
        """
        if math.isnan(goal.goal_time) or (goal.goal_time < 0 and goal.goal_time != ERASED):
            return self, f"goal_time_tolerance must be -1, 0 or more, got {goal.goal_time:g} s"
        path, why = _overridden(self.path, goal.path_tolerance, names, "path_tolerance")
        if not why:
            final, why = _overridden(self.goal, goal.goal_tolerance, names, "goal_tolerance")
        if why:
            return self, why
        return replace(self, path=path, goal=final, goal_time=_chosen(goal.goal_time, self.goal_time)), ""


def _overridden(
    default: StateTolerances, given: Sequence[Tolerance], names: Sequence[str], label: str
) -> tuple[StateTolerances, str]:
    columns = {kind: np.array(getattr(default, kind)) for kind in ("position", "velocity", "acceleration")}
    for entry in given:
        if entry.joint not in names:
            return default, f"{label} names the unknown joint {entry.joint!r}"
        index = list(names).index(entry.joint)
        for kind, column in columns.items():
            value = getattr(entry, kind)
            if math.isnan(value) or (value < 0 and value != ERASED):
                return default, f"{label} of {entry.joint}: {kind} must be -1, 0 or more, got {value:g}"
            column[index] = _chosen(value, float(column[index]))
    return StateTolerances(*(frozen(column) for column in columns.values())), ""


def _chosen(value: float, default: float) -> float:
    if value == ERASED:
        return 0.0
    return value if value > 0.0 else default


@dataclass(frozen=True, slots=True)
class ToleranceVerdict:
    """Why the tolerances end a goal.

    Attributes:
        outcome: succeeded or aborted.
        code: for the client.
        text: what happened.
    """

    outcome: GoalOutcome
    code: ErrorCode
    text: str


class ToleranceMonitor:
    """Judges one trajectory: path tolerances while it is executed, then goal tolerances for `goal_time`.

    Args:
        names: of the joints, seven.
        tolerances: of this trajectory.
        trajectory: what is executed.
    """

    def __init__(
        self, names: Sequence[str], tolerances: TrajectoryTolerances, trajectory: JointTrajectory
    ) -> None:
        self._names, self._tolerances, self._end = names, tolerances, trajectory.end
        self._judged = False

    def judge(
        self, desired: KinematicState, q: Array, dq: Array, *, moving: bool, overdue: float
    ) -> ToleranceVerdict | None:
        """Compare a measurement with the trajectory.

        Args:
            desired: where the trajectory was at the time of the measurement.
            q: measured positions, shape (7,) [rad].
            dq: measured velocities, shape (7,) [rad/s]; NaN: not known.
            moving: whether the trajectory is still being executed; the goal cannot succeed before its end.
            overdue: time since the end of the trajectory [s]; negative: it has not been reached.

        Returns:
            How the goal ends; None: it goes on.
        """
        # the path is checked at least once: a trajectory of a single point is at its end from the beginning
        check_path, self._judged = moving or not self._judged, True
        if check_path:
            violation = self._tolerances.path.violation(self._names, desired, q, dq)
            if violation:
                text = f"path tolerance violated: {violation}"
                return ToleranceVerdict(GoalOutcome.ABORTED, ErrorCode.PATH_TOLERANCE_VIOLATED, text)
        if overdue < 0.0:
            return None
        violation = self._tolerances.goal.violation(self._names, self._end, q, dq)
        if self._end.dq.any() and violation:
            # the arm passes such an end, so it is compared with the trajectory at the time of the measurement; or it
            # is late and rests there
            ends = desired, KinematicState.at_rest(self._end.q)
            if not all(self._tolerances.goal.violation(self._names, end, q, dq) for end in ends):
                violation = ""
        if not violation:
            if moving:
                return None
            return ToleranceVerdict(GoalOutcome.SUCCEEDED, ErrorCode.SUCCESSFUL, "goal reached")
        if 0.0 < self._tolerances.goal_time < overdue:
            text = f"goal tolerance violated {overdue:.3f} s after the end of the trajectory: {violation}"
            return ToleranceVerdict(GoalOutcome.ABORTED, ErrorCode.GOAL_TOLERANCE_VIOLATED, text)
        if 0.0 < self._tolerances.cmd_timeout < overdue:
            text = f"cmd_timeout of {self._tolerances.cmd_timeout:g} s after the end of the trajectory: {violation}"
            return ToleranceVerdict(GoalOutcome.ABORTED, ErrorCode.GOAL_TOLERANCE_VIOLATED, text)
        return None
