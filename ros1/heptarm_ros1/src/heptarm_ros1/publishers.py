"""Publishers of the robot state, the status, diagnostics and transforms."""

from __future__ import annotations

import rospy
from control_msgs.msg import JointTrajectoryControllerState
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from heptarm.ros.interface.names import PRESETS
from heptarm.ros.interface.state_messages import StateMessages, TransformMessages
from heptarm.ros.node.diagnostics import Diagnosis
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm_ros1.convert import ROS


def publisher(kind: type, name: str, *, latch: bool = False) -> rospy.Publisher:
    """Make a publisher that never waits for its subscribers."""
    return rospy.Publisher(name, kind, queue_size=1 if latch else 10, latch=latch, tcp_nodelay=True)


class StatePublisher:
    """Publishes every state, the status when it changes, and diagnostics periodically."""

    def __init__(self, configuration: NodeConfiguration) -> None:
        self._messages = StateMessages(
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
        self._controllers = [publisher(JointTrajectoryControllerState, "~controller_state")]
        self._controllers += [
            publisher(JointTrajectoryControllerState, name)
            for name in PRESETS[configuration.values["names"]].controller_states()
        ]
        self._scaling = publisher(Float64, "~speed_scaling", latch=True)
        self._diagnostics = publisher(DiagnosticArray, "/diagnostics")

    def state(self, state: State) -> None:
        """Publish a state, and the fraction of its speed at which a trajectory is executed if that has changed."""
        for name, message in self._messages.states(state, self._is_wanted):
            self._states[name].publish(message)
        scaling = self._messages.scaling(state)
        if scaling is not None:
            self._scaling.publish(Float64(data=scaling))

    def _is_wanted(self, topic: str) -> bool:
        return self._states[topic].get_num_connections() > 0

    def controller_state(self, state: State, driver: Driver) -> None:
        """Publish where the trajectory is at the time of the state that was published last, and what the arm does."""
        for one in self._controllers:
            if one.get_num_connections() > 0:
                sample = driver.at(1e-9 * state.sampled)
                one.publish(self._messages.controller_state(JointTrajectoryControllerState, state, sample))

    def status(self, diagnosis: Diagnosis, state: State | None, *, connected: bool, active: bool) -> None:
        """Publish the status if it has changed."""
        message = self._messages.status(diagnosis, state, connected=connected, active=active)
        if message is not None:
            self._status.publish(message)

    def diagnostics(self, diagnosis: Diagnosis, hardware: str) -> None:
        """Publish diagnostics."""
        name = rospy.get_name()
        self._diagnostics.publish(
            self._messages.diagnostics(DiagnosticArray, diagnosis, name=name, hardware=hardware)
        )

    def destroy(self) -> None:
        """Destroy the publishers."""
        for one in (
            *self._states.values(),
            self._status,
            *self._controllers,
            self._scaling,
            self._diagnostics,
        ):
            one.unregister()


class TransformPublisher:
    """Publishes flange and tool on /tf."""

    def __init__(self, configuration: NodeConfiguration, robot: RobotModel) -> None:
        self._messages = TransformMessages(ROS, configuration, robot, (TFMessage, TransformStamped))
        self._tf = publisher(TFMessage, "/tf")

    def state(self, state: State) -> None:
        """Publish the transforms of a state."""
        if self._tf.get_num_connections() > 0:
            self._tf.publish(self._messages.of(state))

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._tf.unregister()
