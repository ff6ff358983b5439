"""Messages that a node publishes: made of states and diagnoses, for either ROS."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np

from heptarm.fri import State as FriState
from heptarm.model.kinematics import forward
from heptarm.ros.interface import messages
from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.interface.names import NameRole, PresetName
from heptarm.ros.interface.presets.iiwa_messages import iiwa_state
from heptarm.ros.node.diagnostics import Diagnosis
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.trajectory.execution import speed_scaling
from heptarm.ros.trajectory.trajectory import TrajectorySample
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.state import OperationMode, State


class TransformMessages:
    """Makes messages of /tf.

    Args:
        ros: types and time of the ROS.
        configuration: names of the frames.
        robot: for the pose of the flange, which states lack while a tool is attached.
        types: tf2_msgs/TFMessage and geometry_msgs/TransformStamped.
    """

    def __init__(
        self, ros: RosAdapter, configuration: NodeConfiguration, robot: RobotModel, types: tuple[Any, Any]
    ) -> None:
        self._ros, self._robot = ros, robot
        self._array, self._transform = types
        self._base, self._flange, self._tool = (
            configuration.frame(which) for which in ("base", "flange", "tool")
        )

    def of(self, state: State) -> Any:
        """Make the transforms from the base to the flange and to the motion frame."""
        stamp = self._ros.time(max(0, self._ros.now() - max(0, round(state.age * 1e9))))
        frames = [(self._flange, Pose.from_matrix(forward(self._robot, state.q)))]
        if state.groups.pose is not None:
            frames.append((self._tool, state.pose))
        return self._array(transforms=[self._one(name, pose, stamp) for name, pose in frames])

    def _one(self, name: str, pose: Pose, stamp: Any) -> Any:
        message = self._transform(child_frame_id=name)
        message.header.stamp, message.header.frame_id = stamp, self._base
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = pose.xyz.tolist()
        turn.x, turn.y, turn.z, turn.w = pose.quat.tolist()
        return message


#: Fields of heptarm_msgs/Status from the safety controller.
_SAFETY = (
    "ready_to_move",
    "paused",
    "brakes_open",
    "emergency_stop",
    "protective_stop",
    "recovery_required",
)
#: Least step between stamps [ns]: they never go back when the estimate of the cabinet's clock is corrected.
_STAMP_STEP = 1000
#: A stamp that is this much older than the last one [ns]: the ROS clock was set back, as by a simulation that restarts.
_CLOCK_JUMP = 10**9
#: Least time between two looks at the speed scaling, and at who subscribes to what [ns].
_LOOK_STEP = 20_000_000


class _Sampled(Protocol):
    """A group of a state."""

    @property
    def stamp(self) -> int: ...


class StateMessages:
    """Makes messages of states, status and diagnostics.

    Args:
        ros: types and time of the ROS.
        configuration: the node's parameters.
        stamped: types geometry_msgs/PoseStamped and WrenchStamped.
        state: type heptarm_msgs/RobotState.
        status: type heptarm_msgs/Status.
    """

    def __init__(
        self,
        ros: RosAdapter,
        configuration: NodeConfiguration,
        *,
        stamped: tuple[Any, Any],
        state: Any,
        status: Any,
    ) -> None:
        self._ros = ros
        self._joints, self._base = configuration.joints, configuration.frame("base")
        self._pose_stamped, self._wrench_stamped = stamped
        self._state, self._status = state, status
        self._joint_state = ros.joint_state(name=list(self._joints))
        self._last: Any = None
        self._stamp = 0
        self._scaling, self._scaling_due = math.nan, 0
        self._wanted: dict[str, bool] = {}
        self._wanted_until = 0

    def states(self, state: State, wanted: Callable[[str], bool]) -> Iterator[tuple[str, Any]]:
        """Make the messages of a state by topic, each stamped with the ROS time at which its group was measured.

        The message of the joints is the same object each time, filled again: to make one takes longer than to fill it.

        Args:
            state: the state.
            wanted: whether anybody subscribes to a topic; asked when those before it are published, 50 times a second.
                The others cost nothing: on a busy processor, a message reaches its subscribers when all have been made.
        """
        ros, groups = self._ros, state.groups
        if state.sampled >= self._wanted_until:
            self._wanted, self._wanted_until = {}, state.sampled + _LOOK_STEP
        measured = _measured(ros, state, groups.joints)
        if measured > self._stamp - _CLOCK_JUMP:
            measured = max(self._stamp + _STAMP_STEP, measured)
        self._stamp = measured
        stamp = ros.time(self._stamp)
        if self._is_wanted("joint_states", wanted):
            messages.fill_joint_state(ros, self._joint_state, state)
            yield "joint_states", _stamped(self._joint_state, stamp)
        if self._is_wanted("external_torques", wanted) and state.torques is not None:
            external = ros.joint_state(name=list(self._joints), effort=state.tau_ext.tolist())
            yield "external_torques", _stamped(external, self._time_of(groups.torques, state))
        if self._is_wanted("pose", wanted) and groups.pose is not None:
            pose = self._pose_stamped(pose=messages.pose_message(ros, state.pose))
            yield "pose", _stamped(pose, self._time_of(groups.pose, state), self._base)
        if self._is_wanted("wrench", wanted) and groups.wrench is not None:
            wrench = self._wrench_stamped(wrench=messages.wrench_message(ros, state))
            yield "wrench", _stamped(wrench, self._time_of(groups.wrench, state), self._base)
        if self._is_wanted("state", wanted):
            yield "state", _stamped(self._robot_state(state), stamp, self._base)

    def _is_wanted(self, topic: str, wanted: Callable[[str], bool]) -> bool:
        known = self._wanted.get(topic)
        if known is None:
            known = self._wanted[topic] = wanted(topic)
        return known

    def scaling(self, state: State) -> float | None:
        """The fraction of its speed at which a trajectory is executed if it has changed; looks 50 times a second."""
        if state.sampled < self._scaling_due:
            return None
        self._scaling_due = state.sampled + _LOOK_STEP
        before, self._scaling = self._scaling, speed_scaling(state)
        return None if self._scaling == before else self._scaling

    def controller_state(self, kind: Any, state: State, sample: TrajectorySample | None) -> Any:
        """Make the state of the controller for the last one of `states`; see `messages.controller_state`."""
        message = messages.controller_state(self._ros, kind, state, sample, self._joints)
        return _stamped(message, self._ros.time(self._stamp))

    def _time_of(self, group: _Sampled | None, state: State) -> Any:
        """Stamp of a group, by the stamp of the joints that are sent with it."""
        if group is None or state.joints is None:
            return self._ros.time(self._stamp)
        return self._ros.time(max(0, self._stamp + group.stamp - state.joints.stamp))

    def _robot_state(self, state: State) -> Any:
        ros = self._ros
        message = self._state(
            cabinet_stamp=state.stamp,
            position=state.q.tolist(),
            position_command=state.q_cmd.tolist(),
            velocity=state.dq.tolist(),
        )
        if state.torques is not None:
            message.torque, message.torque_external = state.tau.tolist(), state.tau_ext.tolist()
        if state.groups.pose is not None:
            message.pose = messages.pose_message(ros, state.pose)
            message.pose_command = messages.pose_message(ros, state.pose_cmd)
            message.redundancy = float(state.redundancy.e1)
        if state.groups.wrench is not None:
            message.wrench = messages.wrench_message(ros, state)
            wrench = state.wrench
            message.wrench_inaccuracy = [
                *wrench.force_inaccuracy.tolist(),
                *wrench.torque_inaccuracy.tolist(),
            ]
        if state.motion is not None:
            message.motion, message.queued = state.motion.id, state.motion.queued
        return message

    def status(self, diagnosis: Diagnosis, state: State | None, *, connected: bool, active: bool) -> Any:
        """Make the status; None: nothing has changed since the last one."""
        message = self._status(connected=connected, active=active, text=diagnosis.text)
        if state is not None and state.groups.safety is not None:
            safety = state.groups.safety
            for name in _SAFETY:
                value = getattr(safety, name)  # what is unknown counts as a stop, not as fine
                setattr(message, name, name.endswith("_stop") if value is None else value)
            message.operation_mode = getattr(self._status, f"MODE_{safety.mode.name}")
        if state is not None and state.motion is not None:
            message.override = state.motion.override
        if self._last is not None:
            message.header = self._last.header
        if message == self._last:
            return None
        message.header = type(message.header)()
        self._last = _stamped(message, self._ros.time(self._ros.now()))
        return message

    def diagnostics(self, array: Any, diagnosis: Diagnosis, *, name: str, hardware: str) -> Any:
        """Make the diagnostics.

        Args:
            array: type diagnostic_msgs/DiagnosticArray.
            diagnosis: of the arm.
            name: of the node.
            hardware: which arm.
        """
        ros = self._ros
        status = messages.diagnostic(ros, diagnosis, name=f"{name.lstrip('/')}: arm", hardware=hardware)
        return _stamped(array(status=[status]), ros.time(ros.now()))


def _stamped(message: Any, stamp: Any, frame: str = "") -> Any:
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


def preset_message(
    ros: RosAdapter,
    entry: PresetName,
    kind: Any,
    state: State,
    names: NodeConfiguration,
    fri: FriState | None = None,
) -> Any:
    """Make a message for a topic of another driver; None: the state lacks what it needs.

    Args:
        ros: types and time of the ROS.
        entry: which topic.
        kind: type of the message.
        state: the state.
        names: of joints and frames.
        fri: newest message of the open FRI session; None: none is open.
    """
    stamp = ros.time(_measured(ros, state, state.groups.joints))
    if entry.role is NameRole.OWN_STATE:
        return iiwa_state(ros, kind(), state, stamp, names.frame("base"), external=entry.external)
    if entry.role is NameRole.POSE:
        return None if state.groups.pose is None else messages.pose_message(ros, state.pose)
    if entry.role in (NameRole.WRENCH, NameRole.STAMPED_WRENCH):
        if state.groups.wrench is None:
            return None
        wrench = messages.wrench_message(ros, state)
        stamped = entry.role is NameRole.STAMPED_WRENCH
        return _stamped(kind(wrench=wrench), stamp, names.frame("base")) if stamped else wrench
    if entry.role is NameRole.LBR_STATE:
        message = _lbr_state(kind(), state, max(0, ros.now() - max(0, round(state.age * 1e9))))
        return message if fri is None else _with_session(message, fri)
    message = messages.joint_state(ros, state, names.joints, external=entry.external)
    return _stamped(message, stamp)


def preset_event(ros: RosAdapter, kind: Any, value: str) -> Any:
    """Make a message for a topic of another driver about something that has happened.

    Args:
        ros: types and time of the ROS.
        kind: std_msgs/Time or std_msgs/String.
        value: the text, of a text.
    """
    message = kind()
    message.data = value if isinstance(message.data, str) else ros.time(ros.now())
    return message


#: Codes of FRI: of operation modes, safety states (normal, stop 1, stop 2) and drive states (off, active).
#: A mode that a cabinet does not report counts as the most careful one, T1, and its safety state as a stop.
_OPERATION_MODES = {OperationMode.T1: 0, OperationMode.T2: 1, OperationMode.AUT: 2, OperationMode.UNKNOWN: 0}
_SAFE, _EMERGENCY, _PROTECTIVE = 0, 2, 3
_DRIVE_OFF, _DRIVE_ON = 0, 2


def _lbr_state(message: Any, state: State, stamp: int) -> Any:
    """Fill a lbr_fri_idl/LBRState with what the cabinet reports without FRI.

    The codes are those of FRI's enumerations: 0 is an idle session of poor quality that commands nothing.
    """
    message.time_stamp_sec, message.time_stamp_nano_sec = stamp // 10**9, stamp % 10**9
    message.measured_joint_position = state.q.tolist()
    message.ipo_joint_position = state.q_cmd.tolist()
    if state.torques is not None:
        message.measured_torque = state.tau.tolist()
        message.external_torque = state.tau_ext.tolist()
        message.commanded_torque = np.nan_to_num(state.torques.tau_cmd).tolist()
    safety = state.groups.safety
    if safety is not None:
        message.operation_mode = _OPERATION_MODES[safety.mode]
        message.drive_state = _DRIVE_ON if safety.brakes_open else _DRIVE_OFF
        message.safety_state = (
            _EMERGENCY
            if safety.emergency_stop
            else _PROTECTIVE
            if safety.protective_stop or not safety.is_known
            else _SAFE
        )
    return message


def _with_session(message: Any, fri: FriState) -> Any:
    """Add to a lbr_fri_idl/LBRState what an open FRI session reports."""
    message.sample_time = fri.period
    message.session_state, message.connection_quality = int(fri.session), int(fri.quality)
    message.client_command_mode = int(fri.mode)
    message.overlay_type, message.control_mode = int(fri.overlay or 0), int(fri.control_mode or 0)
    message.tracking_performance = float(np.nan_to_num(fri.tracking))
    if np.isfinite(fri.q_ipo).all():
        message.ipo_joint_position = fri.q_ipo.tolist()
    return message


def _measured(ros: RosAdapter, state: State, group: _Sampled | None) -> int:
    """Convert the time of a group's measurement to the ROS clock [ns]; at least 0, for a clock that just started."""
    older = 0 if group is None else state.stamp - group.stamp
    return max(0, ros.now() - max(0, round(state.age * 1e9)) - older)
