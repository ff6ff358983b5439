"""Runs goals without threads, sockets or clocks: what is commanded, what is reported, how a goal ends.

::

    runner.accept(goal, now=now, state=state)          # raises GoalRefused
    while runner.busy:
        step = runner.advance(now, state)              # command, feedback, results
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from heptarm.errors import LimitError
from heptarm.ros.trajectory.check import GoalRules, check_between_points, check_goal, check_points
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalResult, TrajectoryGoal
from heptarm.ros.trajectory.point_stream import PointStream, is_streamed
from heptarm.ros.trajectory.tolerances import StateTolerances, ToleranceMonitor, TrajectoryTolerances
from heptarm.ros.trajectory.trajectory import (
    BrakingTrajectory,
    JointTrajectory,
    KinematicState,
    Preview,
    PreviewSegment,
    TrajectorySample,
)
from heptarm.values.checks import Array, Value, frozen
from heptarm.values.robot import RobotModel

#: Largest acceleration to join a stream and to settle after it, a fraction of each axis' maximum.
_STREAM_ACCELERATION = 0.5


def _default_tolerances() -> TrajectoryTolerances:
    position, velocity = frozen(np.full(7, 0.01)), frozen(np.full(7, 0.02))
    return TrajectoryTolerances(goal=StateTolerances(position=position, velocity=velocity), goal_time=2.0)


def _default_deceleration() -> Array:
    return frozen(np.full(7, 2.0))


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionSettings(Value):
    """How goals are executed; may change between goals.

    Attributes:
        rules: which goals are accepted.
        tolerances: defaults.
        deceleration: of a cancelled goal, shape (7,) [rad/s²].
        lookahead: delay from a command to its motion [s]; commands are sampled this much ahead.
    """

    rules: GoalRules = field(default_factory=GoalRules)
    tolerances: TrajectoryTolerances = field(default_factory=_default_tolerances)
    deceleration: Array = field(default_factory=_default_deceleration)
    lookahead: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredJoints(Value):
    """A measurement of the arm.

    Attributes:
        time: of the measurement, on the clock of the execution [s].
        q: positions, shape (7,) [rad].
        dq: velocities, shape (7,) [rad/s]; NaN: not known.
        scaling: speed override of the cabinet, 0 or more; 0 while it pauses.
    """

    time: float
    q: Array
    dq: Array
    scaling: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class GoalFeedback(Value):
    """Progress of a goal at one instant, that of the measurement.

    Attributes:
        number: of the goal.
        stamp: the instant, on the clock of the execution [s].
        desired: where the arm should be.
        actual: where it is; its acceleration is not known and given as 0.
        time: on the trajectory, scaled by the override [s].
        elapsed: since its start [s].
        index: how many of its points are before `time`, so the one that is approached.
    """

    number: int
    stamp: float
    desired: KinematicState
    actual: KinematicState
    time: float
    elapsed: float
    index: int


@dataclass(frozen=True, slots=True)
class ControlStep:
    """Output of one step.

    Attributes:
        command: current set-point.
        preview: set-points from now on.
        feedback: of the active goal; None: there is none.
        results: of goals that ended since the last step.
    """

    command: KinematicState
    preview: Preview
    feedback: GoalFeedback | None
    results: tuple[GoalResult, ...]


@dataclass(slots=True, eq=False)
class _ActiveGoal:
    number: int
    trajectory: JointTrajectory
    monitor: ToleranceMonitor
    begin: float | None  # None: with the next step
    tau: float = 0.0
    finished: float | None = None  # when the end of the trajectory was reached
    offset: int = 0  # points that were dropped or put before the goal's own
    late: float = 0.0  # how long ago the goal's start was when it was received
    streamed: bool = False  # further points extend it
    reported: float = 0.0  # time on the trajectory of the last feedback


class TrajectoryRunner:
    """Executes one goal at a time; a new one preempts the old one.

    Args:
        names: of the joints, seven, in the arm's order.
        robot: its limits.
        settings: see `ExecutionSettings`.

    Attributes:
        settings: may be replaced; the active goal keeps its tolerances.
        warning: why the tolerances of the last goal were ignored; empty: they were not.
    """

    def __init__(
        self, names: Sequence[str], robot: RobotModel, settings: ExecutionSettings | None = None
    ) -> None:
        self.names = tuple(names)
        self.settings = settings or ExecutionSettings()
        self.warning = ""
        self._robot = robot
        self._active: _ActiveGoal | None = None
        self._brake: tuple[float, BrakingTrajectory] | None = None
        self._command: KinematicState | None = None
        self._now: float | None = None
        self._scaling = 1.0
        self._results: list[GoalResult] = []
        self._number = 0
        self._stream = PointStream(robot)
        self._revision = 0  # of the active trajectory, counted over all goals

    @property
    def busy(self) -> bool:
        """Whether a goal is active or the arm is braking."""
        return self._active is not None or self._brake is not None

    @property
    def goal(self) -> int:
        """Number of the active goal; 0: none."""
        return 0 if self._active is None else self._active.number

    @property
    def has_results(self) -> bool:
        """Whether goals ended since the last call of `take_results` or step."""
        return bool(self._results)

    def accept(self, goal: TrajectoryGoal, *, now: float, state: MeasuredJoints) -> int:
        """Accept a goal; it preempts the active one. What belongs to a stream extends its goal.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it is invalid; the active goal continues.
        """
        self._revision += 1
        if is_streamed(goal, now):
            return self._extend(goal, now, state)
        now = self._takes_effect(now)
        later = goal.start is not None and goal.start > now
        brake = self._braking(now) if later and self.busy else self._brake
        here = self._start_state(now, state)
        if later and goal.start is not None:
            here = (
                brake[1].sample(goal.start - brake[0])
                if brake is not None
                else KinematicState.at_rest(here.q)
            )
        trajectory = check_goal(goal, self.names, self._robot, here=here, now=now, rules=self.settings.rules)
        tolerances, self.warning = self.settings.tolerances.of(goal, self.names)
        self._end(GoalOutcome.PREEMPTED, ErrorCode.INVALID_GOAL, "preempted by another goal")
        self._brake = brake if later else None
        self._number += 1
        self._active = _ActiveGoal(
            self._number,
            trajectory,
            ToleranceMonitor(self.names, tolerances, trajectory),
            begin=goal.start if later else None if self._now is None else now,
            offset=len(trajectory.times) - len(goal.points),
            late=0.0 if goal.start is None or later else now - goal.start,
        )
        return self._number

    def _extend(self, goal: TrajectoryGoal, now: float, state: MeasuredJoints) -> int:
        """Continue the trajectory of a stream."""
        effective = self._takes_effect(now)
        here, settings = self._start_state(effective, state), self.settings
        q, dq = check_points(goal, self.names, self._robot, here=here, rules=settings.rules)
        times = np.array([point.time for point in goal.points])
        acceleration = np.maximum(settings.deceleration, _STREAM_ACCELERATION * self._robot.ddq_max)
        if len(times) == 1:
            speed = None if dq is None else dq[0]
            trajectory = self._stream.add_point(
                now, effective, here, float(times[0]), q[0], speed, acceleration, goal.sent
            )
        else:
            late = 0.0 if goal.start is None else effective - goal.start
            trajectory = self._stream.add_window(here, times - late, q, dq, acceleration)
        check_between_points(trajectory, self.names, self._robot, settings.rules)
        if self._active is None or not self._active.streamed:
            self._end(GoalOutcome.PREEMPTED, ErrorCode.INVALID_GOAL, "preempted by a stream of points")
            self._number += 1
        self._brake = None
        self._active = _ActiveGoal(
            self._number,
            trajectory,
            ToleranceMonitor(self.names, settings.tolerances, trajectory),
            begin=None if self._now is None else effective,
            offset=len(trajectory.times) - 1,
            streamed=True,
        )
        return self._number

    def at(self, time: float) -> TrajectorySample | None:
        """Evaluate the active goal at a time [s]; None: there is none, or the time is outside its trajectory."""
        active = self._active
        if active is None or active.begin is None or time < active.begin:
            return None
        last = active.begin if self._now is None else max(self._now, active.begin)
        tau = active.tau + self._scaling * (time - last)
        if not 0.0 <= tau <= active.trajectory.duration:
            return None
        desired = active.trajectory.sample(tau)
        return TrajectorySample(desired, tau + active.late, time - active.begin + active.late)

    def cancel(self, number: int, now: float) -> bool:
        """Cancel a goal; the arm brakes. False: it is not active."""
        if self._active is None or self._active.number != number:
            return False
        self._brake = self._braking(now)
        self._end(GoalOutcome.CANCELED, ErrorCode.SUCCESSFUL, "cancelled; the arm brakes")
        return True

    def abort(self, text: str, *, now: float | None = None) -> None:
        """End the active goal for an external reason.

        Args:
            text: why.
            now: brake from here; None: the arm no longer follows commands.
        """
        self._brake = None if now is None else self._braking(now)
        self._end(GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL, text)
        if now is None:
            self.forget()

    def forget(self) -> None:
        """Forget the last command: the arm no longer follows, so the next goal starts where it is measured."""
        self._brake, self._command, self._now = None, None, None

    def take_results(self) -> tuple[GoalResult, ...]:
        """Take the results of goals that ended since the last call or step."""
        results, self._results = tuple(self._results), []
        return results

    def advance(self, now: float, state: MeasuredJoints) -> ControlStep:
        """Compute one step.

        Args:
            now: current time [s]; never earlier than before.
            state: the newest measurement.

        Raises:
            LimitError: the scaling is negative or not a number.
        """
        if not state.scaling >= 0.0:
            raise LimitError(f"scaling must be 0 or more, got {state.scaling}", parameter="scaling")
        passed = 0.0 if self._now is None else max(0.0, now - self._now)
        self._now = now
        self._scaling = state.scaling
        feedback = None
        if self._active is not None:
            feedback = self._follow(self._active, now, passed, state)
        if self._brake is not None and (self._active is None or self._is_pending(now)):
            self._command = self._brake[1].sample(now - self._brake[0])
            if now - self._brake[0] >= self._brake[1].duration:
                self._brake = None
        if self._command is None:
            self._command = KinematicState.at_rest(state.q)
        return ControlStep(self._command, self._preview(now, self._command), feedback, self.take_results())

    # ------------------------------------------------------------------------------------ inside

    def _is_pending(self, now: float) -> bool:
        """Whether the active goal has a start time in the future."""
        return self._active is not None and self._active.begin is not None and now < self._active.begin

    def _preview(self, now: float, command: KinematicState) -> Preview:
        """Collect the set-points from this step on."""
        active, brake, rate = self._active, self._brake, self._scaling
        segments: list[PreviewSegment] = []
        pending = self._is_pending(now)
        if active is None or pending:
            path = brake[1] if brake is not None else self._braking_from(KinematicState.at_rest(command.q))
            segments.append(PreviewSegment(now if brake is None else brake[0], path))
        if active is not None:
            begin = active.begin if pending and active.begin is not None else now
            tau = active.tau + rate * self.settings.lookahead
            segments.append(PreviewSegment(begin, active.trajectory, tau, rate))
        key = (0.0 if active is None else self._revision, pending, 0.0 if brake is None else brake[0], rate)
        return Preview(key, tuple(segments))

    def _takes_effect(self, now: float) -> float:
        """When a request that is received now takes effect: everything before the last step is commanded already."""
        return now if self._now is None else self._now

    def _follow(
        self, active: _ActiveGoal, now: float, passed: float, state: MeasuredJoints
    ) -> GoalFeedback | None:
        """Advance the active goal by one step."""
        if active.begin is None:
            active.begin = now
        elif now > active.begin:
            active.tau += state.scaling * min(passed, now - active.begin)
        elif now < active.begin:
            return None
        else:
            active.tau = 0.0
        self._brake = None
        trajectory = active.trajectory
        self._command = trajectory.sample(active.tau + state.scaling * self.settings.lookahead)
        # the measurement is older than now: compare it with the trajectory at its own time
        age = min(max(0.0, now - state.time), now - active.begin)
        tau = active.reported = max(active.reported, active.tau - state.scaling * age)
        desired = trajectory.sample(tau)
        feedback = GoalFeedback(
            active.number,
            now - age,
            desired,
            KinematicState(state.q, state.dq, np.zeros(7)),
            time=tau + active.late,
            elapsed=now - age - active.begin + active.late,
            index=max(trajectory.index(tau), min(1, len(trajectory.times) - 1)) - active.offset,
        )
        self._judge(active, now, desired, state)
        return feedback

    def _judge(self, active: _ActiveGoal, now: float, desired: KinematicState, state: MeasuredJoints) -> None:
        """End the goal if the tolerances say so."""
        end = active.trajectory.end
        arrived = active.tau >= active.trajectory.duration
        if arrived and active.finished is None:
            active.finished = now
        overdue = -1.0 if active.finished is None else now - active.finished
        verdict = active.monitor.judge(desired, state.q, state.dq, moving=not arrived, overdue=overdue)
        if verdict is not None:
            self._end(verdict.outcome, verdict.code, verdict.text)
            if verdict.outcome is not GoalOutcome.SUCCEEDED or end.dq.any():
                self._brake = self._braking(now)
        elif arrived:  # wait for the arm at rest, even where the trajectory ends with a velocity
            self._command = KinematicState.at_rest(end.q)

    def _start_state(self, now: float, state: MeasuredJoints) -> KinematicState:
        """Where a new trajectory begins: at the current command, or where the arm is if there is none."""
        active = self._active
        if active is not None and (active.begin is None or now >= active.begin):
            return active.trajectory.sample(active.tau)
        if self._brake is not None:
            return self._brake[1].sample(now - self._brake[0])
        if self._command is not None:
            return KinematicState.at_rest(self._command.q)
        return KinematicState.at_rest(state.q)

    def _braking(self, now: float) -> tuple[float, BrakingTrajectory] | None:
        """Brake from the current command."""
        if self._brake is not None:
            return self._brake
        if self._command is None:
            return None
        begin = replace(self._command, dq=self._scaling * self._command.dq, ddq=np.zeros(7))
        return self._takes_effect(now), self._braking_from(begin)

    def _braking_from(self, begin: KinematicState) -> BrakingTrajectory:
        return BrakingTrajectory(begin, self.settings.deceleration, self._robot.q_min, self._robot.q_max)

    def _end(self, outcome: GoalOutcome, code: ErrorCode, text: str) -> None:
        if self._active is not None:
            self._results.append(GoalResult(self._active.number, outcome, code, text))
            self._active = None
