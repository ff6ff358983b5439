"""Programs for iiwa_stack, in the patterns that its documentation shows, with its own names and types."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

from tests.conformance.surface import until

_NUMBERS = range(1, 8)


class IiwaProbe(Protocol):
    """A client of a node with the names of iiwa_stack; names are relative to its namespace."""

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        """The answer of a service."""
        ...

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        """A list that fills with a topic's messages."""
        ...

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        """A function that publishes a message; returns when a subscriber is known."""
        ...

    def send(self, name: str, kind: str, /, **goal: Any) -> Any:
        """A goal of an action."""
        ...

    def make(self, kind: str, /, **fields: Any) -> Any:
        """A message."""
        ...


def joints(quantity: Any) -> list[float]:
    return [getattr(quantity, f"a{number}") for number in _NUMBERS]


class _Arm:
    """What a program for iiwa_stack knows of the arm."""

    def __init__(self, probe: IiwaProbe) -> None:
        self.probe = probe
        self.positions = probe.listen("iiwa/state/JointPosition", "iiwa_msgs/JointPosition")
        self.poses = probe.listen("iiwa/state/CartesianPose", "iiwa_msgs/CartesianPose")
        self.reached = probe.listen("iiwa/state/DestinationReached", "std_msgs/Time")
        until(lambda: self.positions and self.poses, "no states come")

    @property
    def q(self) -> list[float]:
        return joints(self.positions[-1].position)

    def is_at(self, height: float) -> bool:
        return bool(abs(self.poses[-1].poseStamped.pose.position.z - height) < 1e-3)

    def quantity(self, values: Sequence[float]) -> Any:
        named = {f"a{number}": value for number, value in zip(_NUMBERS, values, strict=True)}
        return self.probe.make("iiwa_msgs/JointQuantity", **named)

    def six(self, *values: float) -> Any:
        return self.probe.make("iiwa_msgs/CartesianQuantity", **dict(zip("xyzabc", values, strict=True)))

    def arrives(self, send: Callable[[], None], there: Callable[[], bool], why: str) -> None:
        """One message, then the topic that reports the destination as reached."""
        before = len(self.reached)
        send()
        until(lambda: len(self.reached) > before, f"{why}: destination not reached")
        until(there, f"{why}: not there")

    def set(self, name: str, kind: str, /, **request: Any) -> None:
        answer = self.probe.call(f"iiwa/{name}", f"iiwa_msgs/{kind}", **request)
        assert answer.success and answer.error == "", f"{name}: {answer.error}"

    def refused(self, name: str, kind: str, word: str, /, **request: Any) -> None:
        answer = self.probe.call(f"iiwa/{name}", f"iiwa_msgs/{kind}", **request)
        assert not answer.success and word in answer.error, answer.error


def a_program_for_iiwa_stack(probe: IiwaProbe) -> None:
    """States, limits, then destinations on command topics: one message each, until the stack's own topic reports it."""
    arm = _Arm(probe)
    _states(arm)
    _limits(arm)
    until(lambda: probe.call("iiwa/state/timeToDestination", "iiwa_msgs/TimeToDestination"), "no answer")
    there = arm.q
    there[6] += 0.3
    send = probe.tell("iiwa/command/JointPosition", "iiwa_msgs/JointPosition", position=arm.quantity(there))
    arm.arrives(send, lambda: abs(arm.q[6] - there[6]) < 2e-3, "JointPosition")
    there[6] -= 0.2
    send = probe.tell(
        "iiwa/command/JointPositionVelocity",
        "iiwa_msgs/JointPositionVelocity",
        position=arm.quantity(there),
        velocity=arm.quantity([0.0] * 7),
    )
    arm.arrives(send, lambda: abs(arm.q[6] - there[6]) < 2e-3, "JointPositionVelocity")
    _bend(arm)
    for topic, shift in (("CartesianPose", 0.03), ("CartesianPoseLin", -0.03)):
        target = probe.make("geometry_msgs/PoseStamped")
        target.header.frame_id = "iiwa_link_0"
        target.pose = copy.deepcopy(arm.poses[-1].poseStamped.pose)
        height = target.pose.position.z = target.pose.position.z + shift
        send = probe.tell(
            f"iiwa/command/{topic}", "geometry_msgs/PoseStamped", header=target.header, pose=target.pose
        )
        arm.arrives(send, partial(arm.is_at, height), topic)
    _velocities(arm)


def _states(arm: _Arm) -> None:
    probe = arm.probe
    torques = probe.listen("iiwa/state/JointTorque", "iiwa_msgs/JointTorque")
    outer = probe.listen("iiwa/state/ExternalJointTorque", "iiwa_msgs/JointTorque")
    wrenches = probe.listen("iiwa/state/CartesianWrench", "iiwa_msgs/CartesianWrench")
    both = probe.listen("iiwa/state/JointPositionVelocity", "iiwa_msgs/JointPositionVelocity")
    until(lambda: torques and outer and wrenches and both, "some states do not come")
    pose = arm.poses[-1]
    assert pose.poseStamped.header.frame_id == "iiwa_link_0" and pose.redundancy.status >= 0
    assert pose.poseStamped.header.stamp.to_sec() > 0.0
    assert max(map(abs, joints(both[-1].velocity))) < 0.01
    assert max(abs(a - b) for a, b in zip(joints(both[-1].position), arm.q)) < 1e-3


def _limits(arm: _Arm) -> None:
    relative = {"joint_relative_velocity": 0.7, "joint_relative_acceleration": 0.7}
    override = {"override_joint_acceleration": 1.0}
    arm.set("configuration/setSmartServoLimits", "SetSmartServoJointSpeedLimits", **relative, **override)
    arm.set("configuration/pathParameters", "SetPathParameters", **relative, **override)
    arm.set("configuration/setPTPJointLimits", "SetPTPJointSpeedLimits", **relative)
    ignored = {"joint_relative_velocity": -1.0, "joint_relative_acceleration": -1.0}
    arm.set("configuration/setPTPJointLimits", "SetPTPJointSpeedLimits", **ignored)
    path = {"maxCartesianVelocity": 0.3, "maxOrientationVelocity": 0.5, "maxCartesianAcceleration": 1.0}
    rest = dict.fromkeys(("maxOrientationAcceleration", "maxCartesianJerk", "maxOrientationJerk"), -1.0)
    arm.set("configuration/setPTPCartesianLimits", "SetPTPCartesianSpeedLimits", **path, **rest)
    twist = arm.probe.make("geometry_msgs/Twist")
    twist.linear.x = twist.linear.y = twist.linear.z = 0.2
    arm.set(
        "configuration/setSmartServoLinLimits", "SetSmartServoLinSpeedLimits", max_cartesian_velocity=twist
    )
    arm.set("configuration/setSpeedOverride", "SetSpeedOverride", override_reduction=1.0)
    arm.set("configuration/setEndpointFrame", "SetEndpointFrame", frame_id="iiwa_link_ee")
    arm.set("configuration/setEndpointFrame", "SetEndpointFrame", frame_id="")
    for name in ("", "Box", "Box", ""):  # a template of the stage's project
        arm.set("configuration/setWorkpiece", "SetWorkpiece", workpiece_id=name)
    arm.refused(
        "configuration/setWorkpiece", "SetWorkpiece", "no workpiece template Crate", workpiece_id="Crate"
    )
    arm.refused(
        "configuration/setPTPJointLimits",
        "SetPTPJointSpeedLimits",
        "joint_relative_velocity",
        joint_relative_velocity=2.0,
        joint_relative_acceleration=0.5,
    )


def _bend(arm: _Arm) -> None:
    """Away from the stretched arm, by the stack's action."""
    before = len(arm.reached)
    target = arm.probe.make(
        "iiwa_msgs/JointPosition", position=arm.quantity([0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0])
    )
    answer = arm.probe.send(
        "iiwa/action/move_to_joint_position", "iiwa_msgs/MoveToJointPosition", joint_position=target
    ).end()
    assert answer.success, answer.error
    until(lambda: len(arm.reached) > before, "the end of an action is not reported")
    until(lambda: abs(arm.q[3] + 1.2) < 2e-3, "not there")


def _velocities(arm: _Arm) -> None:
    """Velocities move the arm as long as they come."""
    probe, start = arm.probe, arm.q[6]
    turn = probe.tell(
        "iiwa/command/JointVelocity", "iiwa_msgs/JointVelocity", velocity=arm.quantity([0.0] * 6 + [0.3])
    )
    until(lambda: turn() or arm.q[6] > start + 0.1, "JointVelocity does not move the arm")
    height = arm.poses[-1].poseStamped.pose.position.z
    twist = probe.make("geometry_msgs/Twist")
    twist.linear.z = 0.05
    rise = probe.tell("iiwa/command/CartesianVelocity", "geometry_msgs/TwistStamped", twist=twist)
    until(
        lambda: rise() or arm.poses[-1].poseStamped.pose.position.z > height + 0.01,
        "CartesianVelocity does not move the arm",
    )


def actions_of_iiwa_stack(probe: IiwaProbe) -> None:
    """The actions by lines and splines; an invalid goal has an error."""
    arm = _Arm(probe)

    def point(z: float) -> Any:
        made = probe.make("iiwa_msgs/CartesianPose")
        here = arm.poses[-1].poseStamped
        made.poseStamped.header.frame_id = "iiwa_link_0"
        made.poseStamped.pose.orientation = here.pose.orientation
        place = here.pose.position
        made.poseStamped.pose.position = probe.make(
            "geometry_msgs/Point", x=place.x, y=place.y, z=place.z + z
        )
        made.redundancy.status = made.redundancy.turn = -1
        return made

    for name, shift in (("move_to_cartesian_pose", 0.04), ("move_to_cartesian_pose_lin", -0.04)):
        goal = point(shift)
        height = goal.poseStamped.pose.position.z
        answer = probe.send(f"iiwa/action/{name}", "iiwa_msgs/MoveToCartesianPose", cartesian_pose=goal).end()
        assert answer.success and answer.error == "", answer.error
        until(partial(arm.is_at, height), name)
    segments = [
        probe.make("iiwa_msgs/SplineSegment", type=kind, point=point(z)) for kind, z in ((0, 0.02), (1, 0.05))
    ]
    spline = probe.make("iiwa_msgs/Spline", segments=segments)
    answer = probe.send("iiwa/action/move_along_spline", "iiwa_msgs/MoveAlongSpline", spline=spline).end()
    assert answer.success, answer.error
    far = point(5.0)
    answer = probe.send(
        "iiwa/action/move_to_cartesian_pose", "iiwa_msgs/MoveToCartesianPose", cartesian_pose=far
    ).end()
    assert not answer.success and answer.error, "a pose out of reach has no error"


def control_modes_of_iiwa_stack(probe: IiwaProbe) -> None:
    """Every control mode; the arm is compliant at once, and goes to destinations in that mode."""
    arm = _Arm(probe)

    def configure(mode: int, **values: Any) -> None:
        arm.set("configuration/ConfigureControlMode", "ConfigureControlMode", control_mode=mode, **values)

    stiff = probe.make(
        "iiwa_msgs/JointImpedanceControlMode",
        joint_stiffness=arm.quantity([800.0] * 7),
        joint_damping=arm.quantity([0.7] * 7),
    )
    configure(1, joint_impedance=stiff)
    there = arm.q
    there[6] += 0.1
    send = probe.tell("iiwa/command/JointPosition", "iiwa_msgs/JointPosition", position=arm.quantity(there))
    arm.arrives(send, lambda: abs(arm.q[6] - there[6]) < 0.02, "in joint impedance")
    gentle = probe.make(
        "iiwa_msgs/CartesianImpedanceControlMode",
        cartesian_stiffness=arm.six(1500.0, 1500.0, 350.0, 300.0, 300.0, 300.0),
        cartesian_damping=arm.six(*[0.7] * 6),
        nullspace_stiffness=-1.0,
        nullspace_damping=0.7,
    )
    configure(2, cartesian_impedance=gentle)
    force = probe.make(
        "iiwa_msgs/DesiredForceControlMode", cartesian_dof=3, desired_force=2.0, desired_stiffness=1000.0
    )
    configure(3, desired_force=force)
    sine = probe.make(
        "iiwa_msgs/SinePatternControlMode", cartesian_dof=1, frequency=1.0, amplitude=3.0, stiffness=1500.0
    )
    configure(4, sine_pattern=sine)
    all_at_once = probe.make(
        "iiwa_msgs/DesiredForceControlMode", cartesian_dof=9, desired_force=2.0, desired_stiffness=1000.0
    )
    arm.refused(
        "configuration/ConfigureControlMode",
        "ConfigureControlMode",
        "cartesian_dof",
        control_mode=3,
        desired_force=all_at_once,
    )
    configure(0)
    assert not math.isnan(arm.q[0])
