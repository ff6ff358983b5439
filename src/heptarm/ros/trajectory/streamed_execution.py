"""Base of the executions that stream set-points to a motion of the cabinet: servo and FRI."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock
from heptarm.ros.trajectory.execution import ExecutionThread, GoalListener, measured_state
from heptarm.ros.trajectory.goal import GoalRefused, GoalResult, TrajectoryGoal
from heptarm.ros.trajectory.runner import ControlStep, ExecutionSettings, TrajectoryRunner
from heptarm.ros.trajectory.trajectory import TrajectorySample

_log = logging.getLogger("heptarm.ros")


class CommandStream(Protocol):
    """A motion of the cabinet that follows set-points."""

    @property
    def end_reason(self) -> str:
        """Why it ended."""
        ...

    def tick(self) -> float | None:
        """Wait for the next cycle; returns the time to command for [s], None: the motion ended."""
        ...

    def command(self, step: ControlStep) -> None:
        """Send the set-points of a step."""
        ...


class StreamedExecution(ExecutionThread):
    """Executes goals in a motion that opens with a goal and closes a moment after the last one.

    While it is closed the arm is free for others.

    Args:
        arm: in control.
        names: of its joints, seven.
        listener: receives feedback and results.
        linger: how long the motion stays open after a goal [s].
        settings: how goals are executed.
        clock: the arm's.
    """

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: GoalListener,
        *,
        linger: float = 0.5,
        settings: ExecutionSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(arm, listener, clock)
        self._linger = linger
        self._runner = TrajectoryRunner(names, arm.robot, settings)
        self._dropped = False
        self._is_open = False
        self._thread.start()

    @property
    def settings(self) -> ExecutionSettings:
        """How goals are executed; a replacement applies from the next goal on."""
        return self._runner.settings

    @settings.setter
    def settings(self, value: ExecutionSettings) -> None:
        with self._changed:
            self._runner.settings = value

    @property
    def busy(self) -> bool:
        """Whether a goal is active or the arm brakes after one."""
        return self._runner.busy

    @property
    def goal(self) -> int:
        """Number of the active goal; 0: none."""
        return self._runner.goal

    def accept(self, goal: TrajectoryGoal) -> int:
        """Accept a goal; see `Execution`."""
        try:
            state = measured_state(self._arm.state)
        except HeptarmError as error:
            raise GoalRefused(f"no robot state: {error}") from error
        with self._changed:
            if self._closing:
                raise GoalRefused("the execution is closed")
            number = self._runner.accept(goal, now=self.now, state=state)
            if self._runner.warning:
                _log.warning("goal %d uses the default tolerances: %s", number, self._runner.warning)
            self._changed.notify_all()
            return number

    def at(self, time: float) -> TrajectorySample | None:
        """Evaluate the active goal at a time; see `Execution`."""
        with self._changed:
            return self._runner.at(time)

    def cancel(self, number: int) -> bool:
        """Cancel a goal; the arm brakes. False: it is not active."""
        with self._changed:
            cancelled = self._runner.cancel(number, self.now)
            self._changed.notify_all()
            return cancelled

    def abort(self, text: str) -> None:
        """End the active goal for an external reason; the arm brakes."""
        with self._changed:
            self._runner.abort(text, now=self.now)
            self._changed.notify_all()

    def drop(self, text: str) -> None:
        """End the active goal and command nothing more: a safety stop already holds the arm."""
        with self._changed:
            self._runner.abort(text)
            self._dropped = True
            self._changed.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing is executed and the motion is closed; False: not within `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._runner.busy and not self._is_open, timeout)

    # ------------------------------------------------------------------------------------ thread

    def _wait(self) -> bool:
        runner = self._runner
        while True:
            with self._changed:
                # a goal that ended before its motion opened leaves a result, and nothing to execute
                self._changed.wait_for(lambda: self._closing or runner.busy or runner.has_results)
                if runner.busy:
                    return True
                closing, results = self._closing, runner.take_results()
            self._notify(None, results)
            if closing:
                return False

    @abstractmethod
    def _motion(self) -> AbstractContextManager[CommandStream]:
        """Open the motion that follows set-points."""

    def _execute(self) -> None:
        """Keep one motion open, from the first goal to some time after the last one."""
        self._dropped = False
        with self._motion() as stream:
            self._is_open = True
            last = None
            while (now := stream.tick()) is not None:
                state = measured_state(self._arm.state)
                with self._changed:
                    step = self._runner.advance(now, state)
                    busy = self._runner.busy
                stream.command(step)
                self._notify(step.feedback, step.results)
                last = now if busy or last is None else last
                if not busy and (self._closing or self._dropped or now - last >= self._linger):
                    break
        with self._changed:
            if now is None:
                self._runner.abort(f"the motion ended: {stream.end_reason}")
            self._runner.forget()
            results = self._closed()
        self._notify(None, results)

    def _fail(self, text: str) -> None:
        """Abort the active goal: the arm no longer follows."""
        with self._changed:
            self._runner.abort(text)
            results = self._closed()
        self._notify(None, results)

    def _closed(self) -> Sequence[GoalResult]:
        """Under the lock: mark the motion as closed and take the results."""
        self._is_open = False
        self._changed.notify_all()
        return self._runner.take_results()
