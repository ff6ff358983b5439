"""What the node publishes."""

from __future__ import annotations

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from sensor_msgs.msg import JointState

from heptarm.bridge.parameters import Configuration
from heptarm.bridge.report import Report
from heptarm.values.state import OperationMode, State
from heptarm_ros1 import convert

_MODES = {
    OperationMode.T1: Status.MODE_T1,
    OperationMode.T2: Status.MODE_T2,
    OperationMode.AUT: Status.MODE_AUT,
}


def publisher(kind: type, name: str, *, latch: bool = False) -> rospy.Publisher:
    """A publisher that never waits for its subscribers."""
    return rospy.Publisher(name, kind, queue_size=1 if latch else 10, latch=latch, tcp_nodelay=True)


class Publishers:
    """Publishes states as they come, status when it changes, diagnostics when asked."""

    def __init__(self, configuration: Configuration) -> None:
        self._joints = configuration.joints
        self._base = configuration.frame("base")
        self._joint_states = publisher(JointState, "joint_states")
        self._external = publisher(JointState, "~external_torques")
        self._pose = publisher(PoseStamped, "~pose")
        self._wrench = publisher(WrenchStamped, "~wrench")
        self._state = publisher(RobotState, "~state")
        self._status = publisher(Status, "~status", latch=True)
        self._diagnostics = publisher(DiagnosticArray, "/diagnostics")
        self._last: Status | None = None

    def state(self, state: State) -> None:
        """Publish a state, stamped with this machine's time of its measurement."""
        when = convert.stamp(state.age)
        self._joint_states.publish(convert.joint_state(state, self._joints, when))
        if state.torques is not None:
            self._external.publish(convert.external_torques(state, self._joints, when))
        if state.cartesian is not None:
            pose = PoseStamped(pose=convert.pose_message(state.pose))
            pose.header.stamp, pose.header.frame_id = when, self._base
            self._pose.publish(pose)
        if state.external is not None:
            wrench = WrenchStamped(wrench=convert.wrench_message(state))
            wrench.header.stamp, wrench.header.frame_id = when, self._base
            self._wrench.publish(wrench)
        if self._state.get_num_connections():
            self._state.publish(self._robot_state(state, when))

    def _robot_state(self, state: State, when: rospy.Time) -> RobotState:
        message = RobotState(
            cabinet_stamp=state.stamp,
            position=state.q.tolist(),
            position_command=state.q_cmd.tolist(),
            velocity=state.dq.tolist(),
        )
        message.header.stamp, message.header.frame_id = when, self._base
        if state.torques is not None:
            message.torque, message.torque_external = state.tau.tolist(), state.tau_ext.tolist()
        if state.cartesian is not None:
            message.pose = convert.pose_message(state.pose)
            message.pose_command = convert.pose_message(state.pose_cmd)
            message.redundancy = float(state.redundancy.e1)
        if state.external is not None:
            message.wrench = convert.wrench_message(state)
            wrench = state.wrench
            message.wrench_inaccuracy = [
                *wrench.force_inaccuracy.tolist(),
                *wrench.torque_inaccuracy.tolist(),
            ]
        if state.motion is not None:
            message.motion, message.queued = state.motion.id, state.motion.queued
        return message

    def status(self, report: Report, state: State | None, *, connected: bool, active: bool) -> None:
        """Publish the status if it has changed."""
        message = Status(connected=connected, active=active, text=report.text)
        if state is not None and state.status is not None:
            safety = state.status
            for name in (
                "ready_to_move",
                "paused",
                "brakes_open",
                "emergency_stop",
                "protective_stop",
                "recovery_required",
            ):
                setattr(message, name, getattr(safety, name))
            message.operation_mode = _MODES.get(safety.mode, Status.MODE_UNKNOWN)
        if state is not None and state.motion is not None:
            message.override = state.motion.override
        if self._last is not None:
            message.header = self._last.header
        if message == self._last:
            return
        message.header = type(message.header)(stamp=rospy.Time.now())
        self._last = message
        self._status.publish(message)

    def diagnostics(self, report: Report, hardware: str) -> None:
        """Publish diagnostics."""
        name = f"{rospy.get_name().lstrip('/')}: arm"
        array = DiagnosticArray(status=[convert.diagnostic(report, name=name, hardware=hardware)])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)

    def destroy(self) -> None:
        """End them."""
        for one in (
            self._joint_states,
            self._external,
            self._pose,
            self._wrench,
            self._state,
            self._status,
            self._diagnostics,
        ):
            one.unregister()
