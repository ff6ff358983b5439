"""What a case needs of a server of FollowJointTrajectory; each ROS has its own client, and so has the bare runner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from heptarm.bridge.goal import Code, Goal, Outcome
from heptarm.bridge.trajectory import Sample
from heptarm.values.arrays import Array


@dataclass(frozen=True)
class Sent:
    """A goal that was sent. ROS 2 tells no code when it rejects: None then."""

    accepted: bool
    code: Code | None = None
    handle: object = None


@dataclass(frozen=True)
class Ended:
    """How a goal ended."""

    outcome: Outcome
    code: Code
    text: str


@dataclass(frozen=True)
class Told:
    """A feedback message; `index` is None where the messages have none (ROS 1, older ROS 2)."""

    joints: tuple[str, ...]
    desired: Sample
    actual: Sample
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
    """

    joints: tuple[str, ...]
    preempted: tuple[Outcome, ...]
    timely: bool

    def now(self) -> float:
        """Time for a goal's start [s]."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def place(self) -> Sample:
        """Where the arm is, from the newest joint state."""
        ...

    def track(self, begin: float) -> list[tuple[float, Array]]:
        """Where the arm was, shape (7,) [rad], in every joint state from a time on, with its time stamp [s]."""
        ...

    def send(self, goal: Goal) -> Sent:
        """Send a goal and wait until it is accepted or rejected."""
        ...

    def cancel(self, sent: Sent) -> bool:
        """Ask to cancel; whether the server agreed."""
        ...

    def result(self, sent: Sent, timeout: float = 60.0) -> Ended:
        """Wait for the end of a goal."""
        ...

    def feedback(self, sent: Sent) -> list[Told]:
        """What was told of a goal so far."""
        ...

    def behave(self, how: str) -> None:
        """Make the arm one that "follows", is "frozen" or "lags"."""
        ...

    def override(self, value: float) -> None:
        """Set the cabinet's override, 0 to 1."""
        ...

    def set(self, **values: object) -> bool:
        """Set parameters of the node, `__` for a dot; whether it agreed."""
        ...

    def activate(self, *, on: bool) -> None:
        """Activate or deactivate the node."""
        ...

    def topic(self, goal: Goal) -> None:
        """Send a trajectory to the topic; one without joints and points stops."""
        ...
