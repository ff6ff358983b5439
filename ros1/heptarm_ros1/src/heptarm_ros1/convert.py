"""Messages of ROS 1 to values of heptarm and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rospy
from control_msgs.msg import (
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
)
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench as WrenchMessage
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from heptarm.bridge.goal import End, Goal, GoalRefused, Point, Tolerance
from heptarm.bridge.report import Report
from heptarm.bridge.runner import Feedback
from heptarm.bridge.trajectory import Sample
from heptarm.errors import ShapeError
from heptarm.values.pose import Pose
from heptarm.values.state import State


def stamp(age: float = 0.0) -> rospy.Time:
    """ROS' time `age` seconds ago, or 0 if there was none then."""
    nanos = max(0, rospy.Time.now().to_nsec() - max(0, round(age * 1e9)))
    return rospy.Time(nanos // 10**9, nanos % 10**9)


def trajectory_goal(message: JointTrajectory, *, now: float, clock: float) -> Goal:
    """A trajectory without tolerances.

    Args:
        message: the trajectory.
        now: the time on the runner's clock [s].
        clock: the time on ROS' clock [s].
    """
    begin = message.header.stamp.to_sec()
    return Goal(
        joints=tuple(message.joint_names),
        points=tuple(
            Point(
                point.time_from_start.to_sec(),
                tuple(point.positions),
                tuple(point.velocities),
                tuple(point.accelerations),
                tuple(point.effort),
            )
            for point in message.points
        ),
        start=None if begin == 0.0 else now + (begin - clock),
    )


def action_goal(message: FollowJointTrajectoryGoal, *, now: float, clock: float) -> Goal:
    """A goal of the action; see `trajectory_goal`."""
    plain = trajectory_goal(message.trajectory, now=now, clock=clock)
    return Goal(
        plain.joints,
        plain.points,
        plain.start,
        _tolerances(message.path_tolerance),
        _tolerances(message.goal_tolerance),
        message.goal_time_tolerance.to_sec(),
    )


def _tolerances(messages: Sequence[Any]) -> tuple[Tolerance, ...]:
    return tuple(Tolerance(one.name, one.position, one.velocity, one.acceleration) for one in messages)


def refusal(error: GoalRefused) -> FollowJointTrajectoryResult:
    """The result of a goal that was rejected."""
    return FollowJointTrajectoryResult(error_code=int(error.reason), error_string=str(error))


def result(end: End) -> FollowJointTrajectoryResult:
    """The result of a goal."""
    return FollowJointTrajectoryResult(error_code=int(end.code), error_string=end.text)


def feedback(value: Feedback, names: Sequence[str]) -> FollowJointTrajectoryFeedback:
    """Feedback of the action."""
    message = FollowJointTrajectoryFeedback(joint_names=list(names))
    message.header.stamp = stamp()
    message.desired = _point(value.desired, value.time)
    message.actual = _point(value.actual, value.elapsed)
    message.error = JointTrajectoryPoint(
        positions=(value.desired.q - value.actual.q).tolist(),
        velocities=(value.desired.dq - value.actual.dq).tolist(),
        time_from_start=rospy.Duration.from_sec(value.time - value.elapsed),
    )
    return message


def _point(sample: Sample, time: float) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(
        positions=sample.q.tolist(),
        velocities=np.nan_to_num(sample.dq).tolist(),
        accelerations=sample.ddq.tolist(),
        time_from_start=rospy.Duration.from_sec(time),
    )


def joint_state(state: State, names: Sequence[str], when: rospy.Time) -> JointState:
    """Measured positions, velocities and torques."""
    message = JointState(
        name=list(names), position=state.q.tolist(), velocity=np.nan_to_num(state.dq).tolist()
    )
    message.header.stamp = when
    if state.torques is not None:
        message.effort = state.tau.tolist()
    return message


def external_torques(state: State, names: Sequence[str], when: rospy.Time) -> JointState:
    """External torques as a joint state."""
    message = JointState(name=list(names), effort=state.tau_ext.tolist())
    message.header.stamp = when
    return message


def pose_message(pose: Pose) -> PoseMessage:
    """A pose."""
    message = PoseMessage()
    place, turn = message.position, message.orientation
    place.x, place.y, place.z = pose.xyz.tolist()
    turn.x, turn.y, turn.z, turn.w = pose.quat.tolist()
    return message


def pose_value(message: Any, base: str) -> Pose:
    """The pose of a PoseStamped.

    Raises:
        ShapeError: it is given in another frame than the base, or its quaternion is none.
    """
    frame = message.header.frame_id.lstrip("/")
    if frame not in ("", base):
        raise ShapeError(f"the pose is given in {frame!r}", hint=f"give it in {base!r}")
    place, turn = message.pose.position, message.pose.orientation
    return Pose.of([place.x, place.y, place.z], [turn.x, turn.y, turn.z, turn.w])


def wrench_message(state: State) -> WrenchMessage:
    """Force and torque acting on the robot at the flange, in base axes."""
    message = WrenchMessage()
    f, t = message.force, message.torque
    f.x, f.y, f.z = state.wrench.force.tolist()
    t.x, t.y, t.z = state.wrench.torque.tolist()
    return message


def diagnostic(value: Report, *, name: str, hardware: str) -> DiagnosticStatus:
    """A diagnostic status."""
    return DiagnosticStatus(
        level=int(value.level),
        name=name,
        message=value.text,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=text) for key, text in value.values.items()],
    )
