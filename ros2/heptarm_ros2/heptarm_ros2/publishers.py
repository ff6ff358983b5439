"""Publishers of the robot state, the status, diagnostics and transforms."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.interface.state_messages import StateMessages, TransformMessages
from heptarm.ros.node.diagnostics import Diagnosis
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
        self._states = {
            "joint_states": node.create_publisher(JointState, "joint_states", 10),
            "external_torques": node.create_publisher(JointState, "~/external_torques", 10),
            "pose": node.create_publisher(PoseStamped, "~/pose", 10),
            "wrench": node.create_publisher(WrenchStamped, "~/wrench", 10),
            "state": node.create_publisher(RobotState, "~/state", 10),
        }
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._status = node.create_publisher(Status, "~/status", latched)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def state(self, state: State) -> None:
        """Publish a state."""
        full = self._states["state"].get_subscription_count() > 0
        for name, message in self._messages.states(state, full=full):
            self._states[name].publish(message)

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
        for publisher in (*self._states.values(), self._status, self._diagnostics):
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
        self._tf.publish(self._messages.of(state))

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._tf)
