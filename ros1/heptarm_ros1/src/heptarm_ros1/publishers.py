"""What the node publishes."""

from __future__ import annotations

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from sensor_msgs.msg import JointState

from heptarm.bridge.outputs import Outputs
from heptarm.bridge.parameters import Configuration
from heptarm.bridge.report import Report
from heptarm.values.state import State
from heptarm_ros1.convert import ROS


def publisher(kind: type, name: str, *, latch: bool = False) -> rospy.Publisher:
    """A publisher that never waits for its subscribers."""
    return rospy.Publisher(name, kind, queue_size=1 if latch else 10, latch=latch, tcp_nodelay=True)


class Publishers:
    """Publishes states as they come, status when it changes, diagnostics when asked."""

    def __init__(self, configuration: Configuration) -> None:
        self._outputs = Outputs(
            ROS, configuration, stamped=(PoseStamped, WrenchStamped), state=RobotState, status=Status
        )
        self._states = {
            "joint_states": publisher(JointState, "joint_states"),
            "external_torques": publisher(JointState, "~external_torques"),
            "pose": publisher(PoseStamped, "~pose"),
            "wrench": publisher(WrenchStamped, "~wrench"),
            "state": publisher(RobotState, "~state"),
        }
        self._status = publisher(Status, "~status", latch=True)
        self._diagnostics = publisher(DiagnosticArray, "/diagnostics")

    def state(self, state: State) -> None:
        """Publish a state."""
        full = self._states["state"].get_num_connections() > 0
        for name, message in self._outputs.states(state, full=full):
            self._states[name].publish(message)

    def status(self, report: Report, state: State | None, *, connected: bool, active: bool) -> None:
        """Publish the status if it has changed."""
        message = self._outputs.status(report, state, connected=connected, active=active)
        if message is not None:
            self._status.publish(message)

    def diagnostics(self, report: Report, hardware: str) -> None:
        """Publish diagnostics."""
        name = rospy.get_name()
        self._diagnostics.publish(
            self._outputs.diagnostics(DiagnosticArray, report, name=name, hardware=hardware)
        )

    def destroy(self) -> None:
        """End them."""
        for one in (*self._states.values(), self._status, self._diagnostics):
            one.unregister()
