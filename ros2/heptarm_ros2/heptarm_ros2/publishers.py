"""What the node publishes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

from heptarm.bridge.outputs import Outputs
from heptarm.bridge.report import Report
from heptarm.values.state import State

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode


class Publishers:
    """Publishes states as they come, status when it changes, diagnostics when asked."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        self._outputs = Outputs(
            node.ros,
            node.configuration,
            stamped=(PoseStamped, WrenchStamped),
            state=RobotState,
            status=Status,
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
        for name, message in self._outputs.states(state, full=full):
            self._states[name].publish(message)

    def status(self, report: Report, state: State | None, *, connected: bool, active: bool) -> None:
        """Publish the status if it has changed."""
        message = self._outputs.status(report, state, connected=connected, active=active)
        if message is not None:
            self._status.publish(message)

    def diagnostics(self, report: Report, hardware: str) -> None:
        """Publish diagnostics."""
        name = self._node.get_fully_qualified_name()
        self._diagnostics.publish(
            self._outputs.diagnostics(DiagnosticArray, report, name=name, hardware=hardware)
        )

    def destroy(self) -> None:
        """End them."""
        for publisher in (*self._states.values(), self._status, self._diagnostics):
            self._node.destroy_publisher(publisher)
