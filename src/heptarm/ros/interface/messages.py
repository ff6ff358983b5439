"""Converts messages of either ROS to values of heptarm and back: their types differ, their fields do not.

A node names its types once::

    ros = RosAdapter(joint_state=JointState, ..., seconds=seconds, duration=duration)
    message = feedback(ros, value, names)
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from heptarm.ros.node.diagnostics import Diagnosis
from heptarm.ros.trajectory.execution import speed_scaling
from heptarm.ros.trajectory.goal import Tolerance, TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.runner import GoalFeedback
from heptarm.ros.trajectory.trajectory import KinematicState, TrajectorySample
from heptarm.values.pose import Pose
from heptarm.values.state import State

#: Fields of a goal that only ROS 2 has, and that are not supported.
_EXTRAS = ("component_path_tolerance", "component_goal_tolerance")
#: Readings of two clocks that are compared: another thread may run between the two for some milliseconds.
_READINGS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class RosAdapter:
    """Types and time of one ROS: all that differs between ROS 1 and ROS 2.

    Attributes:
        joint_state: type sensor_msgs/JointState.
        point: type trajectory_msgs/JointTrajectoryPoint.
        feedback: type of the feedback of control_msgs/FollowJointTrajectory.
        pose: type geometry_msgs/Pose.
        wrench: type geometry_msgs/Wrench.
        diagnostic: type diagnostic_msgs/DiagnosticStatus.
        key_value: type diagnostic_msgs/KeyValue.
        now: ROS time [ns].
        time: makes a time of a message from [ns].
        seconds: converts a time or a duration of a message to [s].
        duration: makes a duration of a message from [s].
        level: makes a level of a diagnostic message.
        doubles: makes the contents of a field of doubles, in the type that costs the least to set.
        empty_stops: whether an empty trajectory on the topic stops the arm, as upstream's controller of ROS 1
            does; that of ROS 2 refuses it.
    """

    joint_state: Any
    point: Any
    feedback: Any
    pose: Any
    wrench: Any
    diagnostic: Any
    key_value: Any
    now: Callable[[], int]
    time: Callable[[int], Any]
    seconds: Callable[[Any], float]
    duration: Callable[[float], Any]
    level: Callable[[int], Any]
    doubles: Callable[[list[float]], Any]
    empty_stops: bool


def class_of(kind: str, part: Literal["msg", "srv", "action"]) -> Any:
    """Import the generated class of a "package/Type".

    Args:
        kind: the type.
        part: module of the package.
    """
    package, _, name = kind.partition("/")
    return getattr(importlib.import_module(f"{package}.{part}"), name)


def is_installed(kind: str) -> bool:
    """Whether the package of a "package/Type" is installed."""
    return importlib.util.find_spec(kind.partition("/")[0]) is not None


def put(message: Any, fields: Mapping[str, Any]) -> None:
    """Set fields of a message; a mapping sets the fields of a nested message."""
    for name, value in fields.items():
        if isinstance(value, Mapping):
            put(getattr(message, name), value)
        else:
            setattr(message, name, value)


# -------------------------------------------------------------------------------------- trajectories


def trajectory_goal(ros: RosAdapter, message: Any, *, now: Callable[[], float]) -> TrajectoryGoal:
    """Convert a trajectory without tolerances.

    Args:
        ros: types and time of the ROS.
        message: trajectory_msgs/JointTrajectory.
        now: reads the clock of the execution [s].
    """
    stamp = ros.seconds(message.header.stamp)
    return TrajectoryGoal(
        joints=tuple(message.joint_names),
        points=tuple(
            TrajectoryPoint(
                ros.seconds(point.time_from_start),
                tuple(point.positions),
                tuple(point.velocities),
                tuple(point.accelerations),
                tuple(point.effort),
            )
            for point in message.points
        ),
        start=None if stamp == 0.0 else _moment(ros, stamp, now),
    )


def _moment(ros: RosAdapter, stamp: float, now: Callable[[], float]) -> float:
    """A ROS time [s] on another clock [s]: of several readings of both clocks the one with the least time between."""
    readings = ((ros.now(), now(), ros.now()) for _ in range(_READINGS))
    before, here, after = min(readings, key=lambda reading: reading[2] - reading[0])
    return here + (stamp - 0.5e-9 * (before + after))


def action_goal(ros: RosAdapter, message: Any, *, now: Callable[[], float]) -> TrajectoryGoal:
    """Convert a goal of control_msgs/FollowJointTrajectory; see `trajectory_goal`."""
    plain = trajectory_goal(ros, message.trajectory, now=now)
    several = getattr(message, "multi_dof_trajectory", None)
    extras = ["multi_dof_trajectory"] if several and (several.joint_names or several.points) else []
    extras += [name for name in _EXTRAS if getattr(message, name, None)]
    return TrajectoryGoal(
        plain.joints,
        plain.points,
        plain.start,
        _tolerances(message.path_tolerance),
        _tolerances(message.goal_tolerance),
        ros.seconds(message.goal_time_tolerance),
        tuple(extras),
    )


def _tolerances(messages: Sequence[Any]) -> tuple[Tolerance, ...]:
    return tuple(
        Tolerance(message.name, message.position, message.velocity, message.acceleration)
        for message in messages
    )


def feedback(ros: RosAdapter, value: GoalFeedback, names: Sequence[str], *, now: float) -> Any:
    """Make feedback of control_msgs/FollowJointTrajectory, stamped with the time of the measurement.

    Args:
        ros: types and time of the ROS.
        value: the feedback.
        names: of the joints.
        now: current time on the clock of the execution [s].
    """
    message = ros.feedback()
    message.header.stamp = ros.time(max(0, ros.now() - max(0, round((now - value.stamp) * 1e9))))
    message.joint_names = list(names)
    message.desired = _point(ros, value.desired, value.time)
    message.actual = _point(ros, value.actual, value.elapsed)
    message.error = ros.point(
        positions=(value.desired.q - value.actual.q).tolist(),
        velocities=(value.desired.dq - value.actual.dq).tolist(),
        time_from_start=ros.duration(value.time - value.elapsed),
    )
    if hasattr(message, "index"):  # since control_msgs 6.3
        message.index = value.index
    return message


def controller_state(
    ros: RosAdapter, kind: Any, state: State, sample: TrajectorySample | None, names: Sequence[str]
) -> Any:
    """Make a control_msgs/JointTrajectoryControllerState without its time stamp.

    ROS 2 has reference, feedback, error and output; ROS 1, and Humble besides, desired, actual and error.

    Args:
        ros: types and time of the ROS.
        kind: type of the message.
        state: a measurement.
        sample: of the active trajectory at the time of the measurement; None: there is none, and the arm holds.
        names: of the joints.
    """
    if sample is None:
        sample = TrajectorySample(KinematicState.at_rest(state.q_cmd), 0.0, 0.0)
    measured = KinematicState(state.q, np.nan_to_num(state.dq), np.zeros(7))
    wanted, actual = _point(ros, sample.desired, sample.time), _point(ros, measured, sample.elapsed)
    error = ros.point(
        positions=(sample.desired.q - measured.q).tolist(),
        velocities=(sample.desired.dq - measured.dq).tolist(),
        time_from_start=ros.duration(sample.time - sample.elapsed),
    )
    output = ros.point(positions=state.q_cmd.tolist(), time_from_start=ros.duration(sample.time))
    message = kind()
    message.joint_names = list(names)
    for name, value in (
        ("reference", wanted),
        ("desired", wanted),
        ("feedback", actual),
        ("actual", actual),
        ("error", error),
        ("output", output),
    ):
        if hasattr(message, name):
            setattr(message, name, value)
    if hasattr(message, "speed_scaling_factor"):  # since control_msgs 5.3
        message.speed_scaling_factor = speed_scaling(state)
    return message


def _point(ros: RosAdapter, sample: KinematicState, time: float) -> Any:
    return ros.point(
        positions=sample.q.tolist(),
        velocities=np.nan_to_num(sample.dq).tolist(),
        accelerations=sample.ddq.tolist(),
        time_from_start=ros.duration(time),
    )


# -------------------------------------------------------------------------------------------- states


def joint_state(ros: RosAdapter, state: State, names: Sequence[str], *, external: bool = False) -> Any:
    """Make a joint state of measured positions, velocities and torques; `external`: of external torques."""
    message = ros.joint_state(name=list(names))
    fill_joint_state(ros, message, state, external=external)
    return message


def fill_joint_state(ros: RosAdapter, message: Any, state: State, *, external: bool = False) -> None:
    """Set all but the names and the header of a joint state; see `joint_state`."""
    # NaN before the second sample
    velocity = [speed if speed == speed else 0.0 for speed in state.dq.tolist()]
    effort = [] if state.torques is None else (state.tau_ext if external else state.tau).tolist()
    message.position, message.velocity = ros.doubles(state.q.tolist()), ros.doubles(velocity)
    message.effort = ros.doubles(effort)


def pose_message(ros: RosAdapter, pose: Pose) -> Any:
    """Make a pose."""
    message = ros.pose()
    place, turn = message.position, message.orientation
    place.x, place.y, place.z = pose.xyz.tolist()
    turn.x, turn.y, turn.z, turn.w = pose.quat.tolist()
    return message


def wrench_message(ros: RosAdapter, state: State) -> Any:
    """Make the wrench acting on the robot at the flange, in base axes."""
    message = ros.wrench()
    f, t = message.force, message.torque
    f.x, f.y, f.z = state.wrench.force.tolist()
    t.x, t.y, t.z = state.wrench.torque.tolist()
    return message


def diagnostic(ros: RosAdapter, value: Diagnosis, *, name: str, hardware: str) -> Any:
    """Make a diagnostic status."""
    return ros.diagnostic(
        level=ros.level(value.level),
        name=name,
        message=value.text,
        hardware_id=hardware,
        values=[ros.key_value(key=key, value=text) for key, text in value.values.items()],
    )
