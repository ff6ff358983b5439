"""The way `spline` to execute a trajectory: one joint spline on the cabinet, through the same points.

The cabinet plans it, within its limits on speed, acceleration and jerk, and nothing on the network can make it falter.
A spline knows no times, only speeds: those of the trajectory are asked for between its points, so it arrives a little
late where the cabinet's limits are narrower, and it begins and ends at rest.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.handle import MotionHandle
from heptarm.bridge.check import read
from heptarm.bridge.execution import Listener, measured
from heptarm.bridge.goal import Code, End, Goal, GoalRefused, Outcome
from heptarm.bridge.runner import Feedback, Settings
from heptarm.bridge.tolerance import Tolerances
from heptarm.bridge.trajectory import Sample, Trajectory
from heptarm.bridge.worker import Worker
from heptarm.errors import ArrivalError, HeptarmError
from heptarm.io.clock import Clock
from heptarm.values.arrays import Array
from heptarm.values.motion import JointSpline, ptp, spline_joints
from heptarm.values.result import Cause
from heptarm.values.robot import RobotModel
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: Between two looks at the arm [s].
_LOOK = 0.02
#: How much faster than the trajectory a spline may be between two points, for it slows down elsewhere.
_HASTE = 1.4
#: Slowest speed, a fraction of each axis' maximum.
_SLOWEST = 0.01
#: How far ahead on the trajectory the arm is looked for [s], and how finely.
_WINDOW, _GRID = 0.5, 51
#: A joint that is slower at the end is at rest [rad/s].
_STILL = 1e-6
#: How long the arm may take to come to rest [s].
_PATIENCE = 10.0


def as_spline(trajectory: Trajectory, robot: RobotModel, ceiling: float) -> JointSpline:
    """The joint spline through a trajectory's points, as fast between them as the trajectory is.

    Args:
        trajectory: one of a single point is a way there at the ceiling.
        robot: its limits.
        ceiling: of the speed, a fraction of each axis' maximum.
    """
    points: list[Any] = []
    for begin, end, q in zip(trajectory.times, trajectory.times[1:], trajectory.points[1:]):
        fastest = max(
            float(np.max(np.abs(trajectory.sample(t).dq) / robot.dq_max)) for t in np.linspace(begin, end, 5)
        )
        points.append(ptp(q, speed=min(max(_HASTE * fastest, _SLOWEST), ceiling)))
    return spline_joints(points or [ptp(trajectory.end.q, speed=ceiling)])


@dataclass(slots=True, eq=False)
class _Running:
    number: int
    goal: Goal
    trajectory: Trajectory
    tolerances: Tolerances
    handle: MotionHandle | None = None
    begin: float = 0.0
    tau: float = 0.0
    led: tuple[int, Array] | None = None  # when and where the cabinet led the arm at the last look

    def speed(self, stamp: int, led: Array) -> Array:
        """How fast the cabinet has led the arm since the last look, shape (7,) [rad/s]; NaN: not known."""
        last, self.led = self.led, (stamp, led)
        if last is None or stamp <= last[0]:
            return np.full(7, np.nan)
        return np.asarray((led - last[1]) / (1e-9 * (stamp - last[0])))


class SplineExecution(Worker):
    """Executes goals as joint splines of the cabinet; a new one waits until the arm is at rest. See `Execution`.

    Args:
        arm: in control.
        names: of its joints, seven.
        listener: hears of goals.
        speed: ceiling, a fraction of each axis' maximum.
        settings: how to run goals.
        clock: the arm's.
    """

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: Listener,
        *,
        speed: float = 1.0,
        settings: Settings | None = None,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(arm, listener, clock)
        self.settings = settings or Settings()
        self._names, self._speed = tuple(names), speed
        self._running: _Running | None = None  # the goal under way
        self._moving: _Running | None = None  # the one whose motion is
        self._ends: list[End] = []
        self._number = 0
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether a goal is under way or the arm brakes after one."""
        return self._running is not None or self._moving is not None

    @property
    def goal(self) -> int:
        """Number of the goal under way; 0: none."""
        running = self._running
        return 0 if running is None else running.number

    def accept(self, goal: Goal) -> int:
        """Take a goal; one under way ends as preempted, and its motion brakes.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it makes no sense, or a spline cannot do it.
        """
        try:
            here = Sample.at_rest(self._arm.state.q_cmd)
        except HeptarmError as error:
            raise GoalRefused(f"nothing is known of the arm: {error}") from error
        trajectory = read(
            goal, self._names, self._arm.robot, here=here, now=self.now, rules=self.settings.rules
        )
        if np.abs(trajectory.end.dq).max() > _STILL:
            raise GoalRefused("a spline ends at rest", hint="give the last point no velocity")
        tolerances, warning = self.settings.tolerances.of(goal, self._names)
        with self._changed:
            if self._closing:
                raise GoalRefused("the execution is closed")
            self._finish(Outcome.PREEMPTED, Code.INVALID_GOAL, "another goal took the place of this one")
            self._number += 1
            self._running = _Running(self._number, goal, trajectory, tolerances)
            if warning:
                _log.warning("goal %d: all default tolerances count: %s", self._number, warning)
            self._changed.notify_all()
            return self._number

    def at(self, time: float) -> Sample | None:
        """What the goal under way wants at a time; see `Execution`."""
        run = self._running
        if run is None or run.handle is None or time < run.begin:
            return None
        tau = run.tau + time - self.now
        return run.trajectory.sample(tau) if 0.0 <= tau <= run.trajectory.duration else None

    def cancel(self, number: int) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        with self._changed:
            if self.goal != number:
                return False
            self._finish(Outcome.CANCELED, Code.SUCCESSFUL, "cancelled; the arm brakes")
            self._changed.notify_all()
            return True

    def abort(self, text: str) -> None:
        """End the goal under way, if there is one, because of something outside; the arm brakes."""
        with self._changed:
            self._finish(Outcome.ABORTED, Code.INVALID_GOAL, text)
            self._changed.notify_all()

    def drop(self, text: str) -> None:
        """Likewise; a stop of the safety controller holds the arm already."""
        self.abort(text)

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing runs; False: not within `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.busy, timeout)

    def _finish(self, outcome: Outcome, code: Code, text: str) -> None:
        """Under the lock: the goal under way ends; its motion is cancelled by the thread."""
        if self._running is not None:
            self._ends.append(End(self._running.number, outcome, code, text))
            self._running = None

    # ------------------------------------------------------------------------------------ thread

    def _wait(self) -> bool:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._running is not None or self._ends)
                self._moving = self._running
            self._tell_ends()
            if self._moving is not None:
                return True
            if self._closing:
                return False

    def _work(self) -> None:
        assert self._moving is not None
        self._carry_out(self._moving)
        self._leave(self._moving)

    def _lose(self, text: str) -> None:
        assert self._moving is not None
        self._fail(self._moving, text)
        self._leave(self._moving)

    def _carry_out(self, run: _Running) -> None:
        if run.goal.start is not None and not self._waited(run, run.goal.start):
            return
        motion = as_spline(run.trajectory, self._arm.robot, self._speed)
        run.handle = handle = self._arm.start(motion, speed=1.0, when="queue")
        run.begin = self.now
        while self._running is run and not handle.done:
            self._look(run, self._arm.state)
            with self._changed:
                self._changed.wait_for(lambda: self._running is not run, _LOOK)
            self._tell_ends()
        if self._running is run:
            with contextlib.suppress(
                ArrivalError
            ):  # whether the arm is near enough, the goal's tolerances say
                result = handle.wait(timeout=_PATIENCE)
                if result.cause is not Cause.FINISHED:
                    self._fail(run, f"the motion ended: {result.cause.value} {result.text}")
            self._arrive(run)

    def _waited(self, run: _Running, start: float) -> bool:
        """Wait for a goal's start; False: it has ended before."""
        with self._changed:
            self._changed.wait_for(lambda: self._running is not run, max(0.0, start - self.now))
            return self._running is run

    def _look(self, run: _Running, state: State) -> None:
        """Where the cabinet leads the arm on its way, and whether the arm is too far off."""
        led = state.q_cmd
        times = np.linspace(run.tau, run.tau + _WINDOW, _GRID)
        run.tau = float(times[int(np.abs(run.trajectory.positions(times) - led).max(axis=1).argmin())])
        run.tau = min(run.tau, run.trajectory.duration)
        desired, arm = run.trajectory.sample(run.tau), measured(state)
        actual = Sample(arm.q, arm.dq, np.zeros(7))
        elapsed = self.now - run.begin
        with self._changed:
            if self._running is not run:
                return
            # a spline knows no times: the speed to hold against is the cabinet's own
            speed = run.speed(state.stamp, led)
            broken = run.tolerances.path.worst(self._names, replace(desired, dq=speed), arm.q, arm.dq)
            if broken:
                self._finish(Outcome.ABORTED, Code.PATH_TOLERANCE_VIOLATED, f"off the path: {broken}")
            elif 0.0 < run.tolerances.goal_time < elapsed - run.trajectory.duration:
                broken = run.tolerances.goal.worst(self._names, run.trajectory.end, arm.q, arm.dq)
                if broken:
                    late = elapsed - run.trajectory.duration
                    text = f"not there {late:.3f} s after the end, for the cabinet keeps its own limits: {broken}"
                    self._finish(Outcome.ABORTED, Code.GOAL_TOLERANCE_VIOLATED, text)
        count = len(run.trajectory.times)
        index = max(run.trajectory.index(run.tau), min(1, count - 1)) - (count - len(run.goal.points))
        self._tell(Feedback(run.number, desired, actual, run.tau, elapsed, index), ())

    def _arrive(self, run: _Running) -> None:
        """The motion has come to its end: is the arm there?"""
        deadline = self.now + (run.tolerances.goal_time or inf)
        while self._running is run:
            state = measured(self._arm.state)
            broken = run.tolerances.goal.worst(self._names, run.trajectory.end, state.q, state.dq)
            if not broken or self.now > deadline:
                break
            self._clock.sleep(_LOOK)
        with self._changed:
            if self._running is not run:
                return
            if broken:
                self._finish(Outcome.ABORTED, Code.GOAL_TOLERANCE_VIOLATED, f"not there: {broken}")
            else:
                self._finish(Outcome.SUCCEEDED, Code.SUCCESSFUL, "the arm has arrived")

    def _fail(self, run: _Running, text: str) -> None:
        with self._changed:
            if self._running is run:
                self._finish(Outcome.ABORTED, Code.INVALID_GOAL, text)

    def _leave(self, run: _Running) -> None:
        """Let the arm come to rest, then tell how the goal ended."""
        handle = run.handle
        if handle is not None and not handle.done:
            try:
                handle.cancel()
                handle.wait(timeout=_PATIENCE)
            except HeptarmError as error:
                _log.info("ending the motion of goal %d: %s", run.number, error)
        self._tell_ends()
        with self._changed:
            self._moving = None
            self._changed.notify_all()

    def _tell_ends(self) -> None:
        with self._changed:
            ends, self._ends = self._ends, []
        self._tell(None, ends)
