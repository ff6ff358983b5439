"""For every field that a client sends: the call of the Python API that sets it, and what the API calls it.

A row takes an arm and a bad value, for fields with several entries with the bad one at the end. A field without a row
fails the test; one that the API does not let anybody set has the reason instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import reduce
from operator import or_
from typing import Any

import heptarm as ha
from heptarm import Arm, Tool
from heptarm.do import notify, set_output
from heptarm.values.condition.force import Force, force, torque
from heptarm.values.condition.signals import io, path
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.pose import Pose, Redundancy
from heptarm.values.shape import Shape, sphere

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
THERE = Pose.xyz_abc(0.5, 0.0, 0.5, *ha.deg(180, 0, 180))
SIX = (0.0,) * 6


@dataclass(frozen=True)
class Call:
    """How a field is set.

    Attributes:
        do: sets it.
        name: of the parameter in the API, as its errors have it.
        size: entries that `do` needs; the bad one is the last.
        filler: what the others are.
        but: reasons for being bad that mean something else in the API.
    """

    do: Callable[[Arm, Any], object]
    name: str
    size: int = 1
    filler: float = 0.5
    but: tuple[str, ...] = field(default=())


def _servo(**settings: Any) -> Callable[[Arm, Any], object]:
    """Opens a servo motion with a setting, whose value is the bad one."""

    def do(arm: Arm, value: Any) -> object:
        given = {name: value if one is ... else one for name, one in settings.items()}
        with arm.servo(**given) as servo:
            return servo.tick()

    return do


def _within(call: Callable[[Any, Any], object], kind: Any = "joint") -> Callable[[Arm, Any], object]:
    """Uses the running servo motion."""

    def do(arm: Arm, value: Any) -> object:
        with arm.servo(kind, watchdog=2.0) as servo:
            return call(servo, value)

    return do


def _moving(make: Callable[[Any], Any]) -> Callable[[Arm, Any], object]:
    return lambda arm, value: arm.start(make(value))


def _compliant(make: Callable[[Any], Any]) -> Callable[[Arm, Any], object]:
    return lambda arm, value: arm.start(ha.hold(1.0), mode=make(value))


def _until(make: Callable[[Any], Any]) -> Callable[[Arm, Any], object]:
    return lambda arm, value: arm.start(ha.hold(1.0), until=make(value))


def _then(make: Callable[[Any], Any]) -> Callable[[Arm, Any], object]:
    return lambda arm, value: arm.start(ha.hold(1.0), until=force > 5, then=make(value))


def _fri(**settings: Any) -> Callable[[Arm, Any], object]:
    def do(arm: Arm, value: Any) -> object:
        given = {name: value if one is ... else one for name, one in settings.items()}
        with arm.fri("monitor", port=0, **given):
            return None

    return do


def _connected(**settings: Any) -> Callable[[Arm, Any], object]:
    def do(arm: Arm, value: Any) -> object:
        host = f"sim://{arm.connection.link.peer}"
        given = {name: value if one is ... else one for name, one in settings.items()}
        return ha.connect(host, **given)

    return do


def _line(name: str) -> Callable[[Arm, Any], object]:
    return _moving(lambda v: ha.lin(THERE, **{name: v}))


_WHOLE_PATH = ("infinite", "infinite downwards")

CALLS: dict[str, Call] = {
    "TakeControl.watchdog": Call(_connected(watchdog=...), "watchdog"),
    "Hello.name": Call(_connected(name=...), "name"),
    "Subscribe.rate": Call(lambda arm, v: arm.subscribe(rate=v), "rate"),
    "Run.items": Call(lambda arm, v: arm.start([ha.hold(1.0)] * len(v)), "motion"),
    "Ptp.q": Call(_moving(ha.ptp), "q", 7, but=("NaN",)),  # keeps a joint
    "JointDynamics.velocity": Call(_moving(lambda v: ha.ptp(HOME, speed=v)), "speed", 7),
    "JointDynamics.acceleration": Call(_moving(lambda v: ha.ptp(HOME, acceleration=v)), "acceleration", 7),
    "JointDynamics.jerk": Call(_moving(lambda v: ha.ptp(HOME, jerk=v)), "jerk", 7),
    "Blending.relative": Call(_moving(lambda v: ha.ptp(HOME, blend_rel=v)), "blend_rel"),
    "Blending.distance": Call(_moving(lambda v: ha.ptp(HOME, blend_m=v)), "blend_m"),
    "Blending.orientation": Call(_moving(lambda v: ha.ptp(HOME, blend_rad=v)), "blend_rad"),
    "Pose.xyz": Call(_moving(lambda v: ha.lin(Pose.of(v))), "xyz", 3),
    "Pose.quat": Call(_moving(lambda v: ha.lin(Pose.of((0.5, 0, 0.5), v))), "quat", 4, 0.0),
    "Redundancy.e1": Call(_moving(lambda v: ha.ptp(THERE, redundancy=Redundancy(e1=v))), "e1"),
    "Redundancy.status": Call(_moving(lambda v: ha.ptp(THERE, redundancy=Redundancy(status=v))), "status"),
    "Redundancy.turn": Call(_moving(lambda v: ha.ptp(THERE, redundancy=Redundancy(turn=v))), "turn"),
    "CartesianDynamics.velocity": Call(_line("speed_mps"), "speed_mps"),
    "CartesianDynamics.acceleration": Call(_line("acceleration_mps2"), "acceleration_mps2"),
    "CartesianDynamics.jerk": Call(_line("jerk_mps3"), "jerk_mps3"),
    "CartesianDynamics.orientation_velocity": Call(_line("speed_radps"), "speed_radps"),
    "CartesianDynamics.orientation_acceleration": Call(_line("acceleration_radps2"), "acceleration_radps2"),
    "CartesianDynamics.orientation_jerk": Call(_line("jerk_radps3"), "jerk_radps3"),
    "LinRel.reference": Call(_moving(lambda v: ha.lin_rel(z=0.01, frame=v)), "frame"),
    "Item.frame": Call(_moving(lambda v: ha.lin_rel(z=0.01, moving=v)), "moving"),
    "Spline.segments": Call(_moving(lambda v: ha.spline([THERE] * len(v))), "segments"),
    "JointSpline.points": Call(_moving(lambda v: ha.spline_joints([HOME] * len(v))), "points"),
    "JointPoint.q": Call(_moving(lambda v: ha.spline_joints([v])), "points[0]", 7),
    "Hold.duration": Call(_moving(ha.hold), "seconds", but=("infinite",)),
    "HandGuide.q_min": Call(_moving(lambda v: hand_guide(q_min=v)), "q_min", 7),
    "HandGuide.q_max": Call(_moving(lambda v: hand_guide(q_max=v)), "q_max", 7),
    "HandGuide.joint_velocity": Call(_moving(lambda v: hand_guide(joint_velocity=v)), "joint_velocity"),
    "HandGuide.cartesian_velocity": Call(
        _moving(lambda v: hand_guide(cartesian_velocity=v)), "cartesian_velocity"
    ),
    "JointImpedance.stiffness": Call(_compliant(JointImpedance), "stiffness", 7),
    "JointImpedance.damping": Call(_compliant(lambda v: JointImpedance(300.0, damping=v)), "damping", 7),
    "CartesianImpedance.stiffness": Call(_compliant(CartesianImpedance), "stiffness", 6),
    "CartesianImpedance.damping": Call(_compliant(lambda v: CartesianImpedance(damping=v)), "damping", 6),
    "CartesianImpedance.nullspace_stiffness": Call(
        _compliant(lambda v: CartesianImpedance(nullspace_stiffness=v)), "nullspace_stiffness"
    ),
    "CartesianImpedance.nullspace_damping": Call(
        _compliant(lambda v: CartesianImpedance(nullspace_damping=v)), "nullspace_damping"
    ),
    "CartesianImpedance.additional_force": Call(
        _compliant(lambda v: CartesianImpedance(additional_force=v)), "additional_force", 6
    ),
    "CartesianImpedance.max_force": Call(
        _compliant(lambda v: CartesianImpedance(max_force=v)), "max_force", 6
    ),
    "CartesianImpedance.max_velocity": Call(
        _compliant(lambda v: CartesianImpedance(max_velocity=v)), "max_velocity", 6
    ),
    "CartesianImpedance.max_deviation": Call(
        _compliant(lambda v: CartesianImpedance(max_deviation=v)), "max_deviation", 6
    ),
    "CartesianImpedance.frame": Call(_compliant(lambda v: CartesianImpedance(frame=v)), "frame"),
    "SineImpedance.amplitude": Call(_compliant(lambda v: SineImpedance(amplitude=v)), "amplitude", 6),
    "SineImpedance.frequency": Call(_compliant(lambda v: SineImpedance(frequency=v)), "frequency", 6),
    "SineImpedance.phase": Call(_compliant(lambda v: SineImpedance(phase=v)), "phase", 6),
    "SineImpedance.bias": Call(_compliant(lambda v: SineImpedance(bias=v)), "bias", 6),
    "SineImpedance.force_limit": Call(_compliant(lambda v: SineImpedance(force_limit=v)), "force_limit", 6),
    "SineImpedance.position_limit": Call(
        _compliant(lambda v: SineImpedance(position_limit=v)), "position_limit", 6
    ),
    "SineImpedance.total_time": Call(_compliant(lambda v: SineImpedance(total_time=v)), "total_time"),
    "SineImpedance.rise_time": Call(_compliant(lambda v: SineImpedance(rise_time=v)), "rise_time"),
    "SineImpedance.hold_time": Call(_compliant(lambda v: SineImpedance(hold_time=v)), "hold_time"),
    "SineImpedance.fall_time": Call(_compliant(lambda v: SineImpedance(fall_time=v)), "fall_time"),
    "SpiralPattern.frequency": Call(
        _compliant(lambda v: SineImpedance.spiral("xy", frequency=v, amplitude=1.0, total_time=1.0)),
        "frequency[0]",
    ),
    "SpiralPattern.amplitude": Call(
        _compliant(lambda v: SineImpedance.spiral("xy", frequency=1.0, amplitude=v, total_time=1.0)),
        "amplitude[0]",
    ),
    "SpiralPattern.stiffness": Call(
        _compliant(
            lambda v: SineImpedance.spiral("xy", frequency=1.0, amplitude=1.0, total_time=1.0, stiffness=v)
        ),
        "stiffness",
    ),
    "SpiralPattern.total_time": Call(
        _compliant(lambda v: SineImpedance.spiral("xy", frequency=1.0, amplitude=1.0, total_time=v)),
        "total_time",
    ),
    "Condition.nodes": Call(_until(lambda v: reduce(or_, [force > 900.0] * (len(v) - 1))), "until"),
    "ForceAbove.frame": Call(_until(lambda v: Force(frame=v) > 5), "frame"),
    "ForceAbove.threshold": Call(_until(lambda v: force > v), "threshold"),
    "ForceAbove.tolerance": Call(_until(lambda v: Force(tolerance=v) > 5), "tolerance"),
    "NormalForceAbove.frame": Call(_until(lambda v: Force(frame=v).normal("z") > 5), "frame"),
    "NormalForceAbove.threshold": Call(_until(lambda v: force.normal("z") > v), "threshold"),
    "NormalForceAbove.tolerance": Call(_until(lambda v: Force(tolerance=v).normal("z") > 5), "tolerance"),
    "ShearForceAbove.frame": Call(_until(lambda v: Force(frame=v).shear("z") > 5), "frame"),
    "ShearForceAbove.threshold": Call(_until(lambda v: force.shear("z") > v), "threshold"),
    "ShearForceAbove.tolerance": Call(_until(lambda v: Force(tolerance=v).shear("z") > 5), "tolerance"),
    "ForceOutside.frame": Call(_until(lambda v: Force(frame=v).along("z") > 5), "frame"),
    "ForceOutside.low": Call(_until(lambda v: force.along("z").outside(v, 5.0)), "low"),
    "ForceOutside.high": Call(_until(lambda v: force.along("z").outside(-5.0, v)), "high"),
    "ForceOutside.tolerance": Call(_until(lambda v: Force(tolerance=v).along("z") > 5), "tolerance"),
    "TorqueOutside.frame": Call(_until(lambda v: torque(frame=v).about("z") > 5), "frame"),
    "TorqueOutside.low": Call(_until(lambda v: torque.about("z").outside(v, 5.0)), "low"),
    "TorqueOutside.high": Call(_until(lambda v: torque.about("z").outside(-5.0, v)), "high"),
    "TorqueOutside.tolerance": Call(_until(lambda v: torque(tolerance=v).about("z") > 5), "tolerance"),
    "JointTorqueOutside.joint": Call(_until(lambda v: torque[v] > 5), "joint"),
    "JointTorqueOutside.low": Call(_until(lambda v: torque[3].outside(v, 5.0)), "low"),
    "JointTorqueOutside.high": Call(_until(lambda v: torque[3].outside(-5.0, v)), "high"),
    "Retreat.distance": Call(_then(ha.Retreat), "distance"),
    "Retreat.speed": Call(_then(lambda v: ha.Retreat(0.01, v)), "speed"),
    "SignalIs.signal": Call(_until(lambda v: io[v]), "signal"),
    "SignalOutside.signal": Call(_until(lambda v: io[v] > 5), "signal"),
    "SignalOutside.low": Call(_until(lambda v: io["MediaFlange.UserButton"].outside(v, 5.0)), "low"),
    "SignalOutside.high": Call(_until(lambda v: io["MediaFlange.UserButton"].outside(-5.0, v)), "high"),
    "PathReached.distance": Call(_until(path.after), "distance", but=("below",)),
    "PathReached.delay": Call(_until(lambda v: path.after(0.01, seconds=v)), "delay"),
    "SetSignals.values": Call(
        lambda arm, v: arm.io.set({f"MediaFlange.OutputX3Pin{i}": True for i in range(len(v))}),
        "values",
        but=("too long",),  # no cabinet has so many outputs
    ),
    "Item.triggers": Call(
        _moving(lambda v: reduce(lambda m, _: m.trigger(force > 5, notify()), v, ha.ptp(HOME))), "triggers"
    ),
    "Notify.label": Call(_moving(lambda v: ha.ptp(HOME).trigger(force > 5, notify(v))), "label"),
    "SetSignal.signal": Call(_moving(lambda v: ha.ptp(HOME).trigger(force > 5, set_output(v))), "signal"),
    "SetSignal.value": Call(lambda arm, v: arm.io.set({"MediaFlange.LEDBlue": v}), "MediaFlange.LEDBlue"),
    "SetOverride.value": Call(lambda arm, v: arm.set_override(v), "override"),
    "ToolInfo.name": Call(lambda arm, v: arm.attach_tool(Tool(v)), "name"),
    "ToolInfo.mass": Call(lambda arm, v: arm.attach_tool(Tool("t", mass=v)), "mass"),
    "ToolInfo.com": Call(lambda arm, v: arm.attach_tool(Tool("t", mass=1.0, com=v)), "com", 3, 0.0),
    "ToolInfo.inertia": Call(
        lambda arm, v: arm.attach_tool(Tool("t", mass=1.0, inertia=v)), "inertia", 6, 0.0
    ),
    "ToolInfo.frames": Call(
        lambda arm, v: arm.attach_tool(Tool("t", frames={f"f{i}": Pose.at() for i in range(len(v))})),
        "frames",
    ),
    "ToolInfo.shapes": Call(
        lambda arm, v: arm.attach_tool(Tool("t", shapes=[sphere(0.01)] * len(v))), "shapes"
    ),
    "Shape.size": Call(lambda arm, v: arm.attach_tool(Tool("t", shapes=[Shape("box", v)])), "size", 3, 0.1),
    "FrameInfo.name": Call(
        lambda arm, v: arm.attach_tool(Tool("t", frames={v: Pose.at()})), "frames[0].name"
    ),
    "AttachTool.name": Call(lambda arm, v: arm.attach_tool(v), "name"),
    "AttachTool.frame": Call(lambda arm, v: arm.attach_tool("t", frame=v), "frame"),
    "AskOperator.text": Call(lambda arm, v: arm.pad.ask(v, "Ok"), "text"),
    "AskOperator.buttons": Call(lambda arm, v: arm.pad.ask("Ready?", *v), "buttons"),
    "ShowMessage.text": Call(lambda arm, v: arm.pad.show(v), "text"),
    "SetKey.slot": Call(lambda arm, v: arm.pad.set_key(v, "x"), "slot"),
    "SetKey.text": Call(lambda arm, v: arm.pad.set_key(0, v), "text"),
    "GetProcessData.name": Call(lambda arm, v: arm.pad.process_data(v), "name"),
    "SetProcessData.name": Call(lambda arm, v: arm.pad.set_process_data(v, "1"), "name"),
    "SetProcessData.value": Call(lambda arm, v: arm.pad.set_process_data("cell.count", v), "value"),
    "ServoOpen.frame": Call(_servo(moving=...), "moving"),
    "ServoOpen.velocity": Call(_servo(speed=...), "speed"),
    "ServoOpen.acceleration": Call(_servo(acceleration=...), "acceleration"),
    "ServoTiming.min_trajectory_time": Call(_servo(min_trajectory_time=...), "min_trajectory_time"),
    "ServoTiming.goal_timeout": Call(_servo(goal_timeout=...), "goal_timeout"),
    "ServoTiming.speed_timeout": Call(_servo(speed_timeout=...), "speed_timeout"),
    "ServoJoints.watchdog": Call(_servo(watchdog=...), "watchdog"),
    "ServoJoints.q": Call(_within(lambda servo, v: servo.set(v)), "q", 7),
    "ServoJointsVelocity.watchdog": Call(_servo(watchdog=...), "watchdog"),
    "ServoJointsVelocity.q": Call(_within(lambda servo, v: servo.set(v, SIX + (0.0,))), "q", 7),
    "ServoJointsVelocity.dq": Call(_within(lambda servo, v: servo.set(HOME, v)), "dq", 7),
    "ServoPose.watchdog": Call(_servo(kind="pose", watchdog=...), "watchdog"),
    "ServoPose.xyz": Call(_within(lambda servo, v: servo.set(Pose.of(v)), "pose"), "xyz", 3),
    "ServoPose.quat": Call(
        _within(lambda servo, v: servo.set(Pose.of((0, 0, 0.5), v)), "pose"), "quat", 4, 0.0
    ),
    "FriOpen.period": Call(_fri(period_ms=...), "period_ms"),
    "FriOpen.host": Call(_fri(host=...), "host", but=("too short",)),  # the address of this machine
    "FriOpen.receive_multiplier": Call(_fri(multiplier=...), "multiplier"),
    "FriOpen.io": Call(lambda arm, v: _fri(io=...)(arm, list(arm.io)[: len(v)]), "io"),
    "FriOpen.timeout": Call(_fri(timeout=...), "timeout"),
}

#: Fields that nobody can set, and why.
FIXED = {
    "Hello.version": "this package's",
    "Hello.nonce": "random, of the right length",
    "Proof.mac": "computed",
    "AllOf.n": "counted by &",
    "AnyOf.n": "counted by |",
    "ServoOpen.watchdog": "for the first target always the longest one",
    "FriOpen.port": "of the socket that was opened",
}
