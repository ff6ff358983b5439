"""A goal of FollowJointTrajectory as it came, unchecked, and how it can end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from heptarm.errors import CommandRejected


class Code(IntEnum):
    """Error codes of control_msgs/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class Outcome(Enum):
    """In what state a goal ends. ROS 2 has no "preempted": its nodes abort such a goal."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"
    PREEMPTED = "preempted"


class GoalRefused(CommandRejected):
    """A goal was refused before anything moved.

    Args:
        text: why, naming the joint, the value and what is allowed.
        reason: code for the client.
        hint: what to do.
    """

    def __init__(self, text: str, *, reason: Code = Code.INVALID_GOAL, hint: str = "") -> None:
        super().__init__(text, hint=hint)
        self.reason = reason


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a joint may be off; 0: the default; -1: not enforced.

    Attributes:
        joint: name.
        position: [rad].
        velocity: [rad/s].
        acceleration: [rad/s²].
    """

    joint: str
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class Point:
    """A way-point; its numbers are in the order of the goal's joints.

    Attributes:
        time: from the start of the trajectory [s].
        q: positions [rad].
        dq: velocities [rad/s]; empty: not given.
        ddq: accelerations [rad/s²]; empty: not given.
        effort: [Nm]; empty: not given.
    """

    time: float
    q: tuple[float, ...] = ()
    dq: tuple[float, ...] = ()
    ddq: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Goal:
    """A goal.

    Attributes:
        joints: names, in any order.
        points: way-points.
        start: when it starts, on the runner's clock [s]; None: now.
        path_tolerance: while the arm is under way.
        goal_tolerance: at the end.
        goal_time: how long after the end it may take to arrive [s]; 0: the default; -1: for ever.
        extras: names of filled fields that this server cannot follow.
    """

    joints: tuple[str, ...]
    points: tuple[Point, ...]
    start: float | None = None
    path_tolerance: tuple[Tolerance, ...] = ()
    goal_tolerance: tuple[Tolerance, ...] = ()
    goal_time: float = 0.0
    extras: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class End:
    """How a goal ended.

    Attributes:
        number: of the goal.
        outcome: its last state.
        code: for the client.
        text: what happened, in words.
    """

    number: int
    outcome: Outcome
    code: Code
    text: str
