"""The node `reach` of both ROS: a policy moves the arm over the topics and services of the heptarm node.

A policy of the reach task gets joint states and sends joint positions; its targets are points. One of a task with
contacts gets the state of the tool frame and sends poses of it, in the Cartesian impedance of its task; its targets are
frames of the task, such as a presumed hole.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Protocol

from heptarm.errors import HeptarmError
from heptarm.rl.contact.follower import ContactFollower
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy_contact import ContactSettings, spring_of
from heptarm.rl.follower import Follower
from heptarm.rl.policy import policy_named
from heptarm.values.pose import Pose

#: Sends a message with these fields.
Send = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True, slots=True)
class PolicyParameters:
    """Parameters of the node.

    Attributes:
        driver: name of the heptarm node.
        joint_names: of its joints, from the base on.
        base_frame: of its base.
        policy: file of the policy, or "reach" or "peg-in-hole": the included one of that task; "": "reach".
        feature: of the included policies of reach, the one that also sees the way to the target.
        seconds: with contacts: an episode ends after so long [s]; 0: after twice as long as in training.
    """

    _: KW_ONLY
    driver: str = "heptarm"
    joint_names: list[str] = field(default_factory=lambda: [f"A{i}" for i in range(1, 8)])
    base_frame: str = "link_0"
    policy: str = ""
    feature: bool = True
    seconds: float = 0.0


class PolicyRos(Protocol):
    """What the node needs of its ROS; types are "package/Type"."""

    def now(self) -> float:
        """The time [s]."""

    def publisher(self, topic: str, kind: str) -> Send:
        """Announce a topic; "~/" stands for the node's name."""

    def subscribe(self, topic: str, kind: str, handler: Callable[[Any], None]) -> None:
        """Call a function with each message."""

    def call(self, service: str, kind: str, fields: Mapping[str, Any], then: Callable[[Any], None]) -> None:
        """Call a service, and a function with its response; warn where there is none."""

    def info(self, text: str) -> None:
        """Log a text."""

    def warn(self, text: str) -> None:
        """Log a warning."""


class PolicyNode:
    """Lets a policy command the arm: call `decide` `rate` times a second.

    Args:
        ros: the node's ROS.
        parameters: of the node.

    Attributes:
        rate: of decisions or set-points [Hz].

    Raises:
        CommandRejected: no such policy, or one that the node cannot run.
        LimitError: a time outside its range.
        ShapeError: not seven different names of joints.
    """

    def __init__(self, ros: PolicyRos, parameters: PolicyParameters) -> None:
        policy = policy_named(parameters.policy, feature=parameters.feature)
        is_contact = isinstance(policy.task, ContactTask)
        settings = ContactSettings(seconds=parameters.seconds or None)
        self._lock = threading.RLock()  # in ROS 1 every topic has a thread of its own
        self._ros, self._base = ros, parameters.base_frame
        self._work: _Reach | _Contact = (
            _Contact(ros, parameters, ContactFollower(policy, settings=settings), self._lock)
            if is_contact
            else _Reach(ros, parameters, Follower(policy, parameters.joint_names))
        )
        self.rate = self._work.rate
        self._distance = ros.publisher("~/distance", "std_msgs/Float64")
        topic, kind = self._work.states
        ros.subscribe(topic, kind, self._on_state)
        ros.subscribe("~/target", self._work.target, self._on_target)
        ros.subscribe("~/hold", "std_msgs/Empty", self._on_hold)

    def decide(self) -> None:
        """Send what the policy commands, if it has a target and fresh states."""
        with self._lock:
            try:
                has_commanded = self._work.command()
            except HeptarmError as error:  # a policy that diverges: the arm brakes
                self._ros.warn(str(error))
                self._work.hold()
                return
            if has_commanded:
                self._distance({"data": self._work.distance})

    def _on_state(self, message: Any) -> None:
        with self._lock:
            self._work.on_state(message)

    def _on_target(self, message: Any) -> None:
        frame = message.header.frame_id
        if frame not in ("", self._base):
            self._ros.warn(f"frame of the target must be {self._base!r}, got {frame!r}")
            return
        try:
            with self._lock:
                self._work.on_target(message)
        except HeptarmError as error:
            self._ros.warn(str(error))

    def _on_hold(self, _: Any) -> None:
        with self._lock:
            self._work.hold()


class _Reach:
    """A policy of the reach task: the newest target counts until `~/hold`."""

    states, target = ("joint_states", "sensor_msgs/JointState"), "geometry_msgs/PointStamped"

    def __init__(self, ros: PolicyRos, parameters: PolicyParameters, follower: Follower) -> None:
        self._ros, self._follower, self._joints = ros, follower, parameters.joint_names
        self._send = ros.publisher(f"{parameters.driver}/servo/joint", "sensor_msgs/JointState")
        self.rate = follower.task.rate

    @property
    def distance(self) -> float:
        """From the flange to the target [m]."""
        return self._follower.distance

    def on_state(self, message: Any) -> None:
        self._follower.on_joints(message.name, message.position, message.velocity, self._ros.now())

    def on_target(self, message: Any) -> None:
        self._follower.on_target((message.point.x, message.point.y, message.point.z))

    def hold(self) -> None:
        self._follower.on_target(None)

    def command(self) -> bool:
        """Send the next command, if there is one."""
        command = self._follower.command(self._ros.now())
        if command is not None:
            self._send({"name": self._joints, "position": command.tolist()})
        return command is not None


class _Contact:
    """A policy of a task with contacts: an episode for each target."""

    target = "geometry_msgs/PoseStamped"

    def __init__(
        self,
        ros: PolicyRos,
        parameters: PolicyParameters,
        follower: ContactFollower,
        lock: threading.RLock,
    ) -> None:
        self._ros, self._follower, self._lock, self._driver = ros, follower, lock, parameters.driver
        self.states = (f"{parameters.driver}/state", "heptarm_msgs/RobotState")
        self._base, self.rate = parameters.base_frame, follower.rate
        self._send = ros.publisher(f"{parameters.driver}/servo/lin", "geometry_msgs/PoseStamped")
        self._stop = ros.publisher(f"{parameters.driver}/stop", "std_msgs/Empty")
        self._ended = ""
        self._wanted: Pose | None = None

    @property
    def distance(self) -> float:
        """What is missing [m]."""
        return self._follower.distance

    def on_state(self, message: Any) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        self._follower.on_state(_pose(message.pose), wrench, message.cabinet_stamp, self._ros.now())
        self._report()

    def on_target(self, message: Any) -> None:
        """End the episode that runs, and choose the impedance of the task; then the next one begins."""
        origin = self._follower.check(_pose(message.pose))
        self.hold()
        self._wanted = origin

        def begin(response: Any) -> None:
            with self._lock:
                if self._wanted is not origin:
                    return  # held, or replaced by another target, in the meantime
                if not response.success:
                    self._ros.warn(f"the impedance of the task was refused: {response.message}")
                    return
                try:
                    self._follower.on_target(origin)
                except HeptarmError as error:
                    self._ros.warn(str(error))

        mode = spring_of(self._follower.task, self._follower.settings)
        fields = {name: getattr(mode, name).tolist() for name in ("stiffness", "damping", "max_force")}
        kind = "heptarm_msgs/SetCartesianImpedance"
        self._ros.call(f"{self._driver}/mode/cartesian_impedance", kind, fields, begin)

    def hold(self) -> None:
        self._wanted, self._ended = None, ""
        self._follower.on_target(None)

    def command(self) -> bool:
        """Send the next set-point; True also when the episode has just ended."""
        pose = self._follower.command(self._ros.now())
        if pose is None:
            return self._report()
        x, y, z, w = pose.quat.tolist()
        position = dict(zip("xyz", pose.xyz.tolist()))
        fields = {"position": position, "orientation": {"x": x, "y": y, "z": z, "w": w}}
        self._send({"header": {"frame_id": self._base}, "pose": fields})
        return True

    def _report(self) -> bool:
        """Report the end of an episode, once."""
        before, self._ended = self._ended, self._follower.ended
        if self._ended in ("", before):
            return False
        if self._ended == "force":
            self._stop({})
        self._ros.info(f"episode ended by {self._ended}, {1e3 * self.distance:.1f} mm are missing")
        return True


def _pose(message: Any) -> Pose:
    """Of a geometry_msgs/Pose."""
    place, turn = message.position, message.orientation
    return Pose.of((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
