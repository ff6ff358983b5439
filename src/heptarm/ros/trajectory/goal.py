"""A goal of FollowJointTrajectory: its points, its tolerances, and how it can end."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import Enum, IntEnum

from heptarm.errors import CommandRejected
from heptarm.ros.trajectory.send_times import PublishInfo


class ErrorCode(IntEnum):
    """Error codes of control_msgs/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalOutcome(Enum):
    """Final state of a goal. ROS 2 has no "preempted": its nodes abort such a goal."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"
    PREEMPTED = "preempted"


class GoalRefused(CommandRejected):
    """A goal was refused before anything moved.

    Args:
        text: why: the joint, the value and the allowed range.
        reason: code for the client.
        hint: what to do.
    """

    def __init__(self, text: str, *, reason: ErrorCode = ErrorCode.INVALID_GOAL, hint: str = "") -> None:
        super().__init__(text, hint=hint)
        self.reason = reason


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowed errors of one joint; 0: the default; -1: not enforced.

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
class TrajectoryPoint:
    """A point of a trajectory; its numbers are in the order of the goal's joints.

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
class TrajectoryGoal:
    """A goal.

    Attributes:
        joints: names, in any order.
        points: of the trajectory.
        start: start time on the clock of the execution [s]; None: now.
        path_tolerance: while the trajectory is executed.
        goal_tolerance: at its end.
        goal_time: how long after its end the arm may take to reach the goal [s]; 0: the default; -1: no limit.
        extras: names of filled fields that this server does not support.
        from_topic: received by topic, so it may be a point of a stream; see `stream`.
        sent: when or as which its message was published; None: unknown.
    """

    joints: tuple[str, ...]
    points: tuple[TrajectoryPoint, ...]
    start: float | None = None
    path_tolerance: tuple[Tolerance, ...] = ()
    goal_tolerance: tuple[Tolerance, ...] = ()
    goal_time: float = 0.0
    extras: tuple[str, ...] = ()
    from_topic: bool = False
    sent: PublishInfo | None = None

    def renamed(self, own: Callable[[Iterable[str]], tuple[str, ...]]) -> TrajectoryGoal:
        """The same goal with other names of joints, in its tolerances, too.

        Args:
            own: replaces names.
        """

        def tolerances(given: tuple[Tolerance, ...]) -> tuple[Tolerance, ...]:
            names = own(one.joint for one in given)
            return tuple(replace(one, joint=name) for one, name in zip(given, names, strict=True))

        return replace(
            self,
            joints=own(self.joints),
            path_tolerance=tolerances(self.path_tolerance),
            goal_tolerance=tolerances(self.goal_tolerance),
        )


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended.

    Attributes:
        number: of the goal.
        outcome: its final state.
        code: for the client.
        text: what happened.
    """

    number: int
    outcome: GoalOutcome
    code: ErrorCode
    text: str
