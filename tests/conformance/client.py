"""The client that a case uses; each ROS has its own, and so has the bare runner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal
from heptarm.ros.trajectory.trajectory import KinematicState
from heptarm.values.checks import Array


@dataclass(frozen=True)
class SentGoal:
    """A goal that was sent. A rejection of ROS 2 has no code: None."""

    accepted: bool
    code: ErrorCode | None = None
    handle: Any = None


@dataclass(frozen=True)
class ReceivedResult:
    """How a goal ended."""

    outcome: GoalOutcome
    code: ErrorCode
    text: str


@dataclass(frozen=True)
class ReceivedFeedback:
    """A feedback message; `index` is None where the messages have none (ROS 1, older ROS 2)."""

    joints: tuple[str, ...]
    desired: KinematicState
    actual: KinematicState
    error: Array
    time: float
    elapsed: float
    index: int | None


class Client(Protocol):
    """A client of the action and of the topics around it.

    Attributes:
        joints: names of the arm's joints, from the base on.
        preempted: in which states a goal may end whose place another one took.
        timely: whether its clock is exact, so that times may be held against it.
        empty_stops: whether an empty trajectory on the topic stops the arm, as in ROS 1; in ROS 2 it is refused.
    """

    joints: tuple[str, ...]
    preempted: tuple[GoalOutcome, ...]
    timely: bool
    empty_stops: bool

    def now(self) -> float:
        """Time for a goal's start [s]."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def place(self) -> KinematicState:
        """State of the arm, from the newest joint state."""
        ...

    def track(self, begin: float) -> list[tuple[float, Array]]:
        """Positions, shape (7,) [rad], of every joint state from a time on, with its time stamp [s]."""
        ...

    def send(self, goal: TrajectoryGoal) -> SentGoal:
        """Send a goal and wait until it is accepted or rejected."""
        ...

    def cancel(self, sent: SentGoal) -> bool:
        """Request cancellation; return whether the server accepted."""
        ...

    def result(self, sent: SentGoal, timeout: float = 60.0) -> ReceivedResult:
        """Wait for the end of a goal."""
        ...

    def feedback(self, sent: SentGoal) -> list[ReceivedFeedback]:
        """Feedback of a goal so far."""
        ...

    def behave(self, how: str) -> None:
        """Make the arm follow commands ("follows"), ignore them ("frozen") or follow late ("lags")."""
        ...

    def override(self, value: float) -> None:
        """Set the cabinet's override, 0 to 1."""
        ...

    def set(self, **values: object) -> bool:
        """Set parameters of the node, `__` for a dot; return whether it accepted."""
        ...

    def activate(self, *, on: bool) -> None:
        """Activate or deactivate the node."""
        ...

    def topic(self, goal: TrajectoryGoal) -> None:
        """Send a trajectory to the topic."""
        ...
