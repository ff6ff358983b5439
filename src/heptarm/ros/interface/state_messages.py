"""What a node publishes of its arm: messages made of states and reports, for the publishers of either ROS."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from heptarm.bridge import messages
from heptarm.bridge.messages import Ros
from heptarm.bridge.names import Entry, Meaning
from heptarm.bridge.parameters import Configuration
from heptarm.bridge.report import Report
from heptarm.values.state import State

#: What heptarm_msgs/Status has of the safety controller.
_SAFETY = (
    "ready_to_move",
    "paused",
    "brakes_open",
    "emergency_stop",
    "protective_stop",
    "recovery_required",
)
#: Stamps never go back, though the estimate of the cabinet's clock is corrected now and then [ns].
_AFTER = 1000


class Outputs:
    """Makes messages.

    Args:
        ros: of which ROS.
        configuration: what the node's parameters say.
        stamped: types geometry_msgs/PoseStamped and WrenchStamped.
        state: type heptarm_msgs/RobotState.
        status: type heptarm_msgs/Status.
    """

    def __init__(
        self, ros: Ros, configuration: Configuration, *, stamped: tuple[Any, Any], state: Any, status: Any
    ) -> None:
        self._ros = ros
        self._joints, self._base = configuration.joints, configuration.frame("base")
        self._pose_stamped, self._wrench_stamped = stamped
        self._state, self._status = state, status
        self._last: Any = None
        self._moment = 0

    def states(self, state: State, *, full: bool) -> Iterator[tuple[str, Any]]:
        """Messages of a state by topic, stamped with ROS' time of its measurement.

        Args:
            state: the state.
            full: with the full state, too.
        """
        ros = self._ros
        self._moment = max(self._moment + _AFTER, _measured(ros, state))
        stamp = ros.time(self._moment)
        yield "joint_states", _stamped(messages.joint_state(ros, state, self._joints), stamp)
        if state.torques is not None:
            external = ros.joint_state(name=list(self._joints), effort=state.tau_ext.tolist())
            yield "external_torques", _stamped(external, stamp)
        if state.cartesian is not None:
            pose = self._pose_stamped(pose=messages.pose_message(ros, state.pose))
            yield "pose", _stamped(pose, stamp, self._base)
        if state.external is not None:
            wrench = self._wrench_stamped(wrench=messages.wrench_message(ros, state))
            yield "wrench", _stamped(wrench, stamp, self._base)
        if full:
            yield "state", _stamped(self._robot_state(state), stamp, self._base)

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
        if state.cartesian is not None:
            message.pose = messages.pose_message(ros, state.pose)
            message.pose_command = messages.pose_message(ros, state.pose_cmd)
            message.redundancy = float(state.redundancy.e1)
        if state.external is not None:
            message.wrench = messages.wrench_message(ros, state)
            wrench = state.wrench
            message.wrench_inaccuracy = [
                *wrench.force_inaccuracy.tolist(),
                *wrench.torque_inaccuracy.tolist(),
            ]
        if state.motion is not None:
            message.motion, message.queued = state.motion.id, state.motion.queued
        return message

    def status(self, report: Report, state: State | None, *, connected: bool, active: bool) -> Any:
        """The status; None: nothing has changed since the last one."""
        message = self._status(connected=connected, active=active, text=report.text)
        if state is not None and state.status is not None:
            safety = state.status
            for name in _SAFETY:
                setattr(message, name, getattr(safety, name))
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

    def diagnostics(self, array: Any, report: Report, *, name: str, hardware: str) -> Any:
        """Diagnostics.

        Args:
            array: type diagnostic_msgs/DiagnosticArray.
            report: how the arm is.
            name: of the node.
            hardware: which arm.
        """
        ros = self._ros
        status = messages.diagnostic(ros, report, name=f"{name.lstrip('/')}: arm", hardware=hardware)
        return _stamped(array(status=[status]), ros.time(ros.now()))


def _stamped(message: Any, stamp: Any, frame: str = "") -> Any:
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


def theirs(ros: Ros, entry: Entry, state: State, names: Sequence[str]) -> Any:
    """A message of a state for a topic of another driver; None: the state has not got what it needs."""
    if entry.meaning is Meaning.POSE:
        return None if state.cartesian is None else messages.pose_message(ros, state.pose)
    if entry.meaning is Meaning.WRENCH:
        return None if state.external is None else messages.wrench_message(ros, state)
    message = messages.joint_state(ros, state, names, external=entry.external)
    return _stamped(message, ros.time(_measured(ros, state)))


def _measured(ros: Ros, state: State) -> int:
    """When a state was measured, by ROS' clock [ns]; 0 if that had not begun."""
    return max(0, ros.now() - max(0, round(state.age * 1e9)))
