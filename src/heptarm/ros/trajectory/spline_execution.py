"""Execution `spline`: one joint spline of the cabinet through the points of the trajectory.

The cabinet plans it within its limits on speed, acceleration and jerk, independent of the network. A spline has speeds
but no times: it takes those of the trajectory between its points, arrives a little late where the limits of the cabinet
are narrower, and begins and ends at rest.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import ArrivalError, HeptarmError
from heptarm.io.clock import Clock
from heptarm.ros.trajectory.check import check_goal
from heptarm.ros.trajectory.execution import ExecutionThread, GoalListener, measured_state
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalRefused, GoalResult, TrajectoryGoal
from heptarm.ros.trajectory.runner import ExecutionSettings, GoalFeedback
from heptarm.ros.trajectory.tolerances import ToleranceMonitor
from heptarm.ros.trajectory.trajectory import JointTrajectory, KinematicState, TrajectorySample
from heptarm.values.checks import Array
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import JointSpline, spline_joints
from heptarm.values.result import Cause
from heptarm.values.robot import RobotModel
from heptarm.values.state import State

_log = logging.getLogger("heptarm.ros")

#: Period of monitoring [s].
_PERIOD = 0.02
#: Factor on the speed of the trajectory between two points: the spline is slower elsewhere.
_SPEED_FACTOR = 1.4
#: Slowest speed, a fraction of each axis' maximum.
_SLOWEST = 0.01
#: How far ahead on the trajectory the arm is searched for [s], and at how many samples.
_WINDOW, _SAMPLES = 0.5, 51
#: Largest joint velocity that counts as rest at the end [rad/s].
_REST = 1e-6
#: How long the arm may take to come to rest [s].
_REST_TIMEOUT = 10.0


def as_spline(trajectory: JointTrajectory, robot: RobotModel, limit: float) -> JointSpline:
    """Make a joint spline through the points of a trajectory, as fast between them as the trajectory is.

    Args:
        trajectory: of a single point: a motion there at the speed limit.
        robot: its limits.
        limit: speed limit, a fraction of each axis' maximum.
    """
    points: list[Any] = []
    for begin, end, q in zip(trajectory.times, trajectory.times[1:], trajectory.points[1:]):
        fastest = max(
            float(np.max(np.abs(trajectory.sample(t).dq) / robot.dq_max)) for t in np.linspace(begin, end, 5)
        )
        points.append(ptp(q, speed=min(max(_SPEED_FACTOR * fastest, _SLOWEST), limit)))
    return spline_joints(points or [ptp(trajectory.end.q, speed=limit)])


@dataclass(slots=True, eq=False)
class _SplineGoal:
    number: int
    goal: TrajectoryGoal
    trajectory: JointTrajectory
    monitor: ToleranceMonitor
    handle: MotionHandle | None = None
    begin: float = 0.0
    finished: float | None = None  # when its motion ended
    tau: float = 0.0
    commanded: tuple[int, Array] | None = None  # the last stamp and commanded positions

    def command_speed(self, stamp: int, commanded: Array) -> Array:
        """Speed of the commanded positions since the last call, shape (7,) [rad/s]; NaN: not known."""
        last, self.commanded = self.commanded, (stamp, commanded)
        if last is None or stamp <= last[0]:
            return np.full(7, np.nan)
        return np.asarray((commanded - last[1]) / (1e-9 * (stamp - last[0])))

    def advance_to(self, commanded: Array) -> None:
        """Move `tau` to where the commanded positions are on the trajectory; never backwards."""
        times = np.linspace(self.tau, self.tau + _WINDOW, _SAMPLES)
        distances = np.abs(self.trajectory.positions(times) - commanded).max(axis=1)
        self.tau = min(float(times[int(distances.argmin())]), self.trajectory.duration)


def _joint_stamp(state: State) -> int:
    """Cabinet time of the joint positions [ns]."""
    return state.stamp if state.joints is None else state.joints.stamp


class SplineExecution(ExecutionThread):
    """Executes goals as joint splines of the cabinet; a new one waits until the arm is at rest. See `Execution`.

    Args:
        arm: in control.
        names: of its joints, seven.
        listener: receives feedback and results.
        speed: speed limit, a fraction of each axis' maximum.
        settings: how goals are executed.
        clock: the arm's.
    """

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: GoalListener,
        *,
        speed: float = 1.0,
        settings: ExecutionSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(arm, listener, clock)
        self.settings = settings or ExecutionSettings()
        self._names, self._speed = tuple(names), speed
        self._active: _SplineGoal | None = None  # the goal that is executed
        self._moving: _SplineGoal | None = None  # the goal whose motion moves the arm
        self._results: list[GoalResult] = []
        self._number = 0
        self._scaling = 1.0
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether a goal is active or the arm brakes after one."""
        return self._active is not None or self._moving is not None

    @property
    def goal(self) -> int:
        """Number of the active goal; 0: none."""
        active = self._active
        return 0 if active is None else active.number

    def accept(self, goal: TrajectoryGoal) -> int:
        """Accept a goal; it preempts the active one, whose motion brakes.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it is invalid, or a spline cannot execute it.
        """
        try:
            here = KinematicState.at_rest(self._arm.state.q_cmd)
        except HeptarmError as error:
            raise GoalRefused(f"no robot state: {error}") from error
        trajectory = check_goal(
            goal, self._names, self._arm.robot, here=here, now=self.now, rules=self.settings.rules
        )
        if np.abs(trajectory.end.dq).max() > _REST:
            raise GoalRefused("a spline must end at rest", hint="give the last point zero velocities")
        tolerances, warning = self.settings.tolerances.of(goal, self._names)
        with self._changed:
            if self._closing:
                raise GoalRefused("the execution is closed")
            if warning:
                _log.warning("goal %d uses the default tolerances: %s", self._number + 1, warning)
            self._end(GoalOutcome.PREEMPTED, ErrorCode.INVALID_GOAL, "preempted by another goal")
            self._number += 1
            monitor = ToleranceMonitor(self._names, tolerances, trajectory)
            self._active = _SplineGoal(self._number, goal, trajectory, monitor)
            self._changed.notify_all()
            return self._number

    def at(self, time: float) -> TrajectorySample | None:
        """Evaluate the active goal at a time [s]; see `Execution`."""
        active = self._active
        if active is None or active.handle is None or time < active.begin:
            return None
        tau = active.tau + self._scaling * (time - self.now)
        if not 0.0 <= tau <= active.trajectory.duration:
            return None
        return TrajectorySample(active.trajectory.sample(tau), tau, time - active.begin)

    def cancel(self, number: int) -> bool:
        """Cancel a goal; the arm brakes. False: it is not active."""
        with self._changed:
            if self._active is None or self._active.number != number:
                return False
            self._end(GoalOutcome.CANCELED, ErrorCode.SUCCESSFUL, "cancelled; the arm brakes")
            self._changed.notify_all()
            return True

    def abort(self, text: str) -> None:
        """End the active goal, if there is one, for an external reason; the arm brakes."""
        with self._changed:
            self._end(GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL, text)
            self._changed.notify_all()

    def drop(self, text: str) -> None:
        """End the active goal: a safety stop already holds the arm."""
        self.abort(text)

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing is executed; False: not within `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.busy, timeout)

    def _end(self, outcome: GoalOutcome, code: ErrorCode, text: str) -> None:
        """Under the lock: end the active goal; the thread cancels its motion."""
        if self._active is not None:
            self._results.append(GoalResult(self._active.number, outcome, code, text))
            self._active = None

    # ------------------------------------------------------------------------------------ thread

    def _wait(self) -> bool:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._active is not None or self._results)
                self._moving = self._active
            self._notify_results()
            if self._moving is not None:
                return True
            if self._closing:
                return False

    def _execute(self) -> None:
        assert self._moving is not None
        self._run_motion(self._moving)
        self._finish(self._moving)

    def _fail(self, text: str) -> None:
        assert self._moving is not None
        self._abort_if_active(self._moving, text)
        self._finish(self._moving)

    def _run_motion(self, active: _SplineGoal) -> None:
        """Start the spline, monitor it, and wait until the arm has reached the goal."""
        if active.goal.start is not None and not self._wait_for_start(active, active.goal.start):
            return
        motion = as_spline(active.trajectory, self._arm.robot, self._speed)
        if self._active is not active:  # it ended while the last one braked, or in the planning
            return
        active.handle = handle = self._arm.start(motion, speed=1.0, when="queue")
        active.begin = self.now
        while self._active is active and not handle.done:
            self._monitor(active, self._arm.state)
            with self._changed:
                self._changed.wait_for(lambda: self._active is not active, _PERIOD)
            self._notify_results()
        if self._active is active:
            with contextlib.suppress(ArrivalError):  # the goal's own tolerances decide about that
                result = handle.wait(timeout=_REST_TIMEOUT)
                if result.cause is not Cause.FINISHED:
                    self._abort_if_active(active, f"the motion ended: {result.cause.value} {result.text}")
            active.finished = self.now
        while self._active is active:
            self._judge(active, active.trajectory.end, self._arm.state, moving=False)
            if self._active is active:
                self._clock.sleep(_PERIOD)

    def _wait_for_start(self, active: _SplineGoal, start: float) -> bool:
        """Wait for the start time of a goal; False: it ended before."""
        with self._changed:
            self._changed.wait_for(lambda: self._active is not active, max(0.0, start - self.now))
            return self._active is active

    def _monitor(self, active: _SplineGoal, state: State) -> None:
        """Judge the moving arm by the tolerances, and report feedback."""
        active.advance_to(state.q_cmd)
        desired = active.trajectory.sample(active.tau)
        # a spline has no times, so velocities are compared with those that the cabinet commands
        commanded = replace(desired, dq=active.command_speed(_joint_stamp(state), state.q_cmd))
        self._judge(active, commanded, state, moving=True)
        count = len(active.trajectory.times)
        index = max(active.trajectory.index(active.tau), min(1, count - 1))
        stamp = state.sampled * 1e-9
        feedback = GoalFeedback(
            active.number,
            stamp,
            desired,
            KinematicState(state.q, state.dq, np.zeros(7)),
            time=active.tau,
            elapsed=max(0.0, stamp - active.begin),
            index=index - (count - len(active.goal.points)),
        )
        self._notify(feedback, ())

    def _judge(self, active: _SplineGoal, desired: KinematicState, state: State, *, moving: bool) -> None:
        """End the goal if the tolerances say so."""
        measured = measured_state(state)
        self._scaling = measured.scaling
        # a spline takes longer than its trajectory at a lower speed or after a pause, and is not late for that
        overdue = -1.0 if active.finished is None else self.now - active.finished
        with self._changed:
            if self._active is active:
                verdict = active.monitor.judge(
                    desired, measured.q, measured.dq, moving=moving, overdue=overdue
                )
                if verdict is not None:
                    self._end(verdict.outcome, verdict.code, verdict.text)

    def _abort_if_active(self, active: _SplineGoal, text: str) -> None:
        with self._changed:
            if self._active is active:
                self._end(GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL, text)

    def _finish(self, active: _SplineGoal) -> None:
        """Bring the arm to rest, then report how the goal ended."""
        handle = active.handle
        if handle is not None and not handle.done:
            try:
                handle.cancel()
                handle.wait(timeout=_REST_TIMEOUT)
            except HeptarmError as error:
                _log.info("ending the motion of goal %d: %s", active.number, error)
        self._notify_results()
        with self._changed:
            self._moving = None
            self._changed.notify_all()

    def _notify_results(self) -> None:
        with self._changed:
            results, self._results = self._results, []
        self._notify(None, results)
