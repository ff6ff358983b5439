"""What the node publishes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState

from heptarm.bridge.report import Report
from heptarm.values.state import OperationMode, State
from heptarm_ros2 import convert

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode

_MODES = {
    OperationMode.T1: Status.MODE_T1,
    OperationMode.T2: Status.MODE_T2,
    OperationMode.AUT: Status.MODE_AUT,
}


class Publishers:
    """Publishes states as they come, status when it changes, diagnostics when asked."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        configuration = node.configuration
        self._joints = configuration.joints
        self._base, self._flange = configuration.frame("base"), configuration.frame("flange")
        self._joint_states = node.create_publisher(JointState, "joint_states", 10)
        self._external = node.create_publisher(JointState, "~/external_torques", 10)
        self._pose = node.create_publisher(PoseStamped, "~/pose", 10)
        self._wrench = node.create_publisher(WrenchStamped, "~/wrench", 10)
        self._state = node.create_publisher(RobotState, "~/state", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._status = node.create_publisher(Status, "~/status", latched)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._last: Status | None = None
        self._moment: Time | None = None

    def state(self, state: State) -> None:
        """Publish a state, stamped with this machine's time of its measurement."""
        age = Duration(nanoseconds=max(0, round(state.age * 1e9)))
        moment = self._node.get_clock().now() - age
        if (
            self._moment is not None and moment <= self._moment
        ):  # the estimate of the cabinet's clock was corrected
            moment = self._moment + Duration(nanoseconds=1000)
        self._moment = moment
        stamp = moment.to_msg()
        self._joint_states.publish(convert.joint_state(state, self._joints, stamp))
        if state.torques is not None:
            self._external.publish(convert.external_torques(state, self._joints, stamp))
        if state.cartesian is not None:
            pose = PoseStamped(pose=convert.pose_message(state.pose))
            pose.header.stamp, pose.header.frame_id = stamp, self._base
            self._pose.publish(pose)
        if state.external is not None:
            wrench = WrenchStamped(wrench=convert.wrench_message(state))
            wrench.header.stamp, wrench.header.frame_id = stamp, self._base
            self._wrench.publish(wrench)
        if self._state.get_subscription_count():
            self._state.publish(self._robot_state(state, stamp))

    def _robot_state(self, state: State, stamp: object) -> RobotState:
        message = RobotState(
            cabinet_stamp=state.stamp,
            position=state.q.tolist(),
            position_command=state.q_cmd.tolist(),
            velocity=state.dq.tolist(),
        )
        message.header.stamp, message.header.frame_id = stamp, self._base
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
            message.operation_mode = _MODES[safety.mode]
        if state is not None and state.motion is not None:
            message.override = state.motion.override
        if message == self._last:
            return
        self._last = message
        stamped = Status(**{name: getattr(message, name) for name in message.get_fields_and_field_types()})
        stamped.header.stamp = self._node.get_clock().now().to_msg()
        self._status.publish(stamped)

    def diagnostics(self, report: Report, hardware: str) -> None:
        """Publish diagnostics."""
        name = f"{self._node.get_fully_qualified_name().lstrip('/')}: arm"
        array = DiagnosticArray(status=[convert.diagnostic(report, name=name, hardware=hardware)])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def destroy(self) -> None:
        """End them."""
        for publisher in (
            self._joint_states,
            self._external,
            self._pose,
            self._wrench,
            self._state,
            self._status,
            self._diagnostics,
        ):
            self._node.destroy_publisher(publisher)
