"""What executes goals of trajectories on an arm, whichever way."""

from __future__ import annotations

from typing import Protocol

from heptarm.bridge.goal import End, Goal
from heptarm.bridge.runner import Feedback, Measured, Settings
from heptarm.bridge.trajectory import Sample
from heptarm.values.state import State


class Listener(Protocol):
    """Hears of goals, from the thread of the execution; it must not block."""

    def on_feedback(self, feedback: Feedback) -> None:
        """A goal went on."""
        ...

    def on_end(self, end: End) -> None:
        """A goal ended."""
        ...


class Execution(Protocol):
    """Executes goals, one at a time; a new one takes the place of the one under way. Between goals the arm is free.

    Attributes:
        settings: how goals are run; exchange them, and the next goal has them.
    """

    settings: Settings

    @property
    def busy(self) -> bool:
        """Whether a goal is under way or the arm brakes after one."""
        ...

    @property
    def goal(self) -> int:
        """Number of the goal under way; 0: none."""
        ...

    @property
    def now(self) -> float:
        """The time on the clock that goals start by [s]."""
        ...

    def accept(self, goal: Goal) -> int:
        """Take a goal; one under way ends as preempted.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it makes no sense, or the arm cannot follow now.
        """
        ...

    def at(self, time: float) -> Sample | None:
        """What the goal under way wants at a time [s]; None: there is none, or it has not begun or is over then."""
        ...

    def cancel(self, number: int) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        ...

    def abort(self, text: str) -> None:
        """End the goal under way, if there is one, because of something outside; the arm brakes."""
        ...

    def drop(self, text: str) -> None:
        """Likewise, but nothing more is commanded: a stop of the safety controller holds the arm already."""
        ...

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing runs and the arm is free for others; False: not within `timeout` [s]."""
        ...

    def close(self) -> None:
        """End the goal under way and leave the arm at rest."""
        ...


def measured(state: State) -> Measured:
    """What a runner wants to know of a state of an arm.

    Raises:
        StaleState: the state has no joints.
    """
    scaling = 1.0 if state.motion is None else state.motion.override
    if state.status is not None and state.status.paused:
        scaling = 0.0
    return Measured(state.sampled * 1e-9, state.q, state.dq, scaling)
