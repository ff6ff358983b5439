"""The interface of executions, which carry out trajectory goals on an arm, and their common thread."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock, RealClock
from heptarm.ros.trajectory.goal import GoalResult, TrajectoryGoal
from heptarm.ros.trajectory.runner import ExecutionSettings, GoalFeedback, MeasuredJoints
from heptarm.ros.trajectory.trajectory import TrajectorySample
from heptarm.values.state import State


class GoalListener(Protocol):
    """Receives feedback and results, in the thread of the execution; it must not block."""

    def on_feedback(self, feedback: GoalFeedback) -> None:
        """Progress of the active goal."""
        ...

    def on_result(self, result: GoalResult) -> None:
        """A goal ended."""
        ...


class Execution(Protocol):
    """Executes one goal at a time; a new one preempts the active one. Between goals the arm is free for others.

    Attributes:
        settings: how goals are executed; a replacement applies from the next goal on.
    """

    settings: ExecutionSettings

    @property
    def busy(self) -> bool:
        """Whether a goal is active or the arm brakes after one."""
        ...

    @property
    def goal(self) -> int:
        """Number of the active goal; 0: none."""
        ...

    @property
    def now(self) -> float:
        """Current time on the clock of goal starts [s]."""
        ...

    def accept(self, goal: TrajectoryGoal) -> int:
        """Accept a goal; it preempts the active one.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it is invalid, or the arm cannot follow now.
        """
        ...

    def at(self, time: float) -> TrajectorySample | None:
        """Evaluate the active goal at a time [s]; None: there is none, or the time is outside its trajectory."""
        ...

    def cancel(self, number: int) -> bool:
        """Cancel a goal; the arm brakes. False: it is not active."""
        ...

    def abort(self, text: str) -> None:
        """End the active goal, if there is one, for an external reason; the arm brakes."""
        ...

    def drop(self, text: str) -> None:
        """End the active goal and command nothing more: a safety stop already holds the arm."""
        ...

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing is executed and the arm is free for others; False: not within `timeout` [s]."""
        ...

    def close(self) -> None:
        """End the active goal and leave the arm at rest."""
        ...


def speed_scaling(state: State) -> float:
    """Extract the fraction of its speed at which the cabinet executes a trajectory: its override, 0 while it pauses."""
    if state.groups.safety is not None and state.groups.safety.paused:
        return 0.0
    return 1.0 if state.motion is None else state.motion.override


def measured_state(state: State) -> MeasuredJoints:
    """Extract from a state of the arm what a trajectory is compared with.

    Raises:
        StaleState: the state has no joint positions.
    """
    return MeasuredJoints(state.sampled * 1e-9, state.q, state.dq, speed_scaling(state))


_log = logging.getLogger("heptarm.ros")

#: How long closing waits for the thread [s].
_CLOSE_TIMEOUT = 10.0


class ExecutionThread(ABC):
    """Common base of all executions: a thread that carries out goals.

    Args:
        arm: in control.
        listener: receives feedback and results.
        clock: the arm's; None: the real one.

    A subclass starts the thread when it is fully constructed.
    """

    def __init__(self, arm: Arm, listener: GoalListener, clock: Clock | None) -> None:
        self._arm = arm
        self._listener = listener
        self._clock = clock or RealClock()
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="heptarm-execution")

    @property
    def now(self) -> float:
        """Current time on the clock of goal starts [s]."""
        return self._clock.nanos() * 1e-9

    @abstractmethod
    def abort(self, text: str) -> None:
        """End the active goal, if there is one, for an external reason; the arm brakes."""

    def close(self) -> None:
        """End the active goal and leave the arm at rest."""
        with self._changed:
            self._closing = True
        self.abort("the driver closes")
        self._thread.join(_CLOSE_TIMEOUT)

    # ------------------------------------------------------------------------------------ thread

    @abstractmethod
    def _wait(self) -> bool:
        """Wait for a goal; False: the execution closes and there is none."""

    @abstractmethod
    def _execute(self) -> None:
        """Carry out goals until the arm is free again."""

    @abstractmethod
    def _fail(self, text: str) -> None:
        """Abort the active goal after an error."""

    def _run(self) -> None:
        while self._wait():
            try:
                self._execute()
            except HeptarmError as error:
                self._fail(str(error))
            except Exception as error:
                _log.exception("executing a goal")
                self._fail(f"{type(error).__name__}: {error}")

    def _notify(self, feedback: GoalFeedback | None, results: Sequence[GoalResult]) -> None:
        try:
            if feedback is not None:
                self._listener.on_feedback(feedback)
            for result in results:
                self._listener.on_result(result)
        except Exception:
            _log.exception("notifying the listener of a goal")
