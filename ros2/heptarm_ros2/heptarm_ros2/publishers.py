"""Publishers of the robot state, the status, diagnostics and transforms."""

from __future__ import annotations

from control_msgs.msg import JointTrajectoryControllerState
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.interface.names import PRESETS
from heptarm.ros.interface.state_messages import StateMessages, TransformMessages
from heptarm.ros.node.diagnostics import Diagnosis
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.robot import RobotModel
from heptarm.values.state import State


class StatePublisher:
    """Publishes every state, the status when it changes, and diagnostics periodically."""

    def __init__(self, node: Node, ros: RosAdapter, configuration: NodeConfiguration) -> None:
        self._node = node
        self._messages = StateMessages(
            ros, configuration, stamped=(PoseStamped, WrenchStamped), state=RobotState, status=Status
        )
        mine = {"qos_overriding_options": QoSOverridingOptions.with_default_policies()}
        self._states = {
            "joint_states": node.create_publisher(JointState, "joint_states", 10, **mine),
            "external_torques": node.create_publisher(JointState, "~/external_torques", 10, **mine),
            "pose": node.create_publisher(PoseStamped, "~/pose", 10, **mine),
            "wrench": node.create_publisher(WrenchStamped, "~/wrench", 10, **mine),
            "state": node.create_publisher(RobotState, "~/state", 10, **mine),
        }
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._status = node.create_publisher(Status, "~/status", latched)
        self._controllers = [
            node.create_publisher(JointTrajectoryControllerState, "~/controller_state", 10, **mine)
        ]
        self._controllers += [
            node.create_publisher(JointTrajectoryControllerState, name, 10, **mine)
            for name in PRESETS[configuration.values["names"]].controller_states()
        ]
        self._scaling = node.create_publisher(Float64, "~/speed_scaling", latched)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def state(self, state: State) -> None:
        """Publish a state, and the fraction of its speed at which a trajectory is executed if that has changed."""
        for name, message in self._messages.states(state, self._is_wanted):
            self._states[name].publish(message)
        scaling = self._messages.scaling(state)
        if scaling is not None:
            self._scaling.publish(Float64(data=scaling))

    def _is_wanted(self, topic: str) -> bool:
        return self._states[topic].get_subscription_count() > 0

    def controller_state(self, state: State, driver: Driver) -> None:
        """Publish where the trajectory is at the time of the state that was published last, and what the arm does."""
        for publisher in self._controllers:
            if publisher.get_subscription_count() > 0:
                sample = driver.at(1e-9 * state.sampled)
                kind = JointTrajectoryControllerState
                publisher.publish(self._messages.controller_state(kind, state, sample))

    def status(self, diagnosis: Diagnosis, state: State | None, *, connected: bool, active: bool) -> None:
        """Publish the status if it has changed."""
        message = self._messages.status(diagnosis, state, connected=connected, active=active)
        if message is not None:
            self._status.publish(message)

    def diagnostics(self, diagnosis: Diagnosis, hardware: str) -> None:
        """Publish diagnostics."""
        name = self._node.get_fully_qualified_name()
        self._diagnostics.publish(
            self._messages.diagnostics(DiagnosticArray, diagnosis, name=name, hardware=hardware)
        )

    def destroy(self) -> None:
        """Destroy the publishers."""
        for publisher in (
            *self._states.values(),
            self._status,
            *self._controllers,
            self._scaling,
            self._diagnostics,
        ):
            self._node.destroy_publisher(publisher)


class TransformPublisher:
    """Publishes flange and tool on /tf."""

    def __init__(
        self, node: Node, ros: RosAdapter, configuration: NodeConfiguration, robot: RobotModel
    ) -> None:
        self._node = node
        self._messages = TransformMessages(ros, configuration, robot, (TFMessage, TransformStamped))
        self._tf = node.create_publisher(TFMessage, "/tf", 100)

    def state(self, state: State) -> None:
        """Publish the transforms of a state."""
        if self._tf.get_subscription_count() > 0:
            self._tf.publish(self._messages.of(state))

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._tf)
