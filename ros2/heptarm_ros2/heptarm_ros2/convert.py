"""Messages of ROS 2 to values of heptarm and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Wrench as WrenchMessage
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from heptarm.bridge.goal import Goal, Point, Tolerance
from heptarm.bridge.report import Report
from heptarm.bridge.runner import Feedback
from heptarm.bridge.trajectory import Sample
from heptarm.errors import ShapeError
from heptarm.values.pose import Pose
from heptarm.values.state import State


def seconds(message: Any) -> float:
    """A time or a duration [s]."""
    return float(message.sec + message.nanosec * 1e-9)


def duration(value: float) -> Duration:
    """A duration of `value` seconds."""
    nanos = round(value * 1e9)
    return Duration(sec=nanos // 10**9, nanosec=nanos % 10**9)


def trajectory_goal(message: JointTrajectory, *, now: float, clock: float) -> Goal:
    """A trajectory without tolerances.

    Args:
        message: the trajectory.
        now: the time on the runner's clock [s].
        clock: the time on ROS' clock [s].
    """
    stamp = seconds(message.header.stamp)
    return Goal(
        joints=tuple(message.joint_names),
        points=tuple(
            Point(
                seconds(point.time_from_start),
                tuple(point.positions),
                tuple(point.velocities),
                tuple(point.accelerations),
                tuple(point.effort),
            )
            for point in message.points
        ),
        start=None if stamp == 0.0 else now + (stamp - clock),
    )


def action_goal(message: FollowJointTrajectory.Goal, *, now: float, clock: float) -> Goal:
    """A goal of the action; see `trajectory_goal`."""
    plain = trajectory_goal(message.trajectory, now=now, clock=clock)
    unknown = {
        "multi_dof_trajectory": bool(
            message.multi_dof_trajectory.joint_names or message.multi_dof_trajectory.points
        ),
        "component_path_tolerance": bool(message.component_path_tolerance),
        "component_goal_tolerance": bool(message.component_goal_tolerance),
    }
    return Goal(
        plain.joints,
        plain.points,
        plain.start,
        _tolerances(message.path_tolerance),
        _tolerances(message.goal_tolerance),
        seconds(message.goal_time_tolerance),
        tuple(name for name, filled in unknown.items() if filled),
    )


def _tolerances(messages: Sequence[Any]) -> tuple[Tolerance, ...]:
    return tuple(Tolerance(one.name, one.position, one.velocity, one.acceleration) for one in messages)


def feedback(value: Feedback, names: Sequence[str], stamp: Any) -> FollowJointTrajectory.Feedback:
    """Feedback of the action."""
    message = FollowJointTrajectory.Feedback()
    message.header.stamp = stamp
    message.joint_names = list(names)
    message.desired = _point(value.desired, value.time)
    message.actual = _point(value.actual, value.elapsed)
    message.error = JointTrajectoryPoint(
        positions=(value.desired.q - value.actual.q).tolist(),
        velocities=(value.desired.dq - value.actual.dq).tolist(),
        time_from_start=duration(value.time - value.elapsed),
    )
    if hasattr(message, "index"):  # since control_msgs 6.3
        message.index = value.index
    return message


def _point(sample: Sample, time: float) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(
        positions=sample.q.tolist(),
        velocities=np.nan_to_num(sample.dq).tolist(),
        accelerations=sample.ddq.tolist(),
        time_from_start=duration(time),
    )


def joint_state(state: State, names: Sequence[str], stamp: Any) -> JointState:
    """Measured positions, velocities and torques."""
    message = JointState(
        name=list(names), position=state.q.tolist(), velocity=np.nan_to_num(state.dq).tolist()
    )
    message.header.stamp = stamp
    if state.torques is not None:
        message.effort = state.tau.tolist()
    return message


def external_torques(state: State, names: Sequence[str], stamp: Any) -> JointState:
    """External torques as a joint state."""
    message = JointState(name=list(names), effort=state.tau_ext.tolist())
    message.header.stamp = stamp
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
        level=bytes([value.level]),
        name=name,
        message=value.text,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=text) for key, text in value.values.items()],
    )
