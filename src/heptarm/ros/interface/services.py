"""The services of both nodes: handlers, and `SERVICES`, the table of them.

A new service is a function and a row of the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, cast

from heptarm.errors import CommandRejected, NotReady, ShapeError
from heptarm.ros.interface.conditions import condition_of
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.motions import pose_of
from heptarm.ros.interface.planning.paths import plan
from heptarm.ros.interface.service import Service, ServiceResponse
from heptarm.skills.collision_guard import THRESHOLD
from heptarm.values.frames import BASE, TOOL
from heptarm.values.mode.impedance import (
    DAMPING,
    NULLSPACE_STIFFNESS,
    STIFFNESS,
    CartesianImpedance,
    JointImpedance,
)
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from heptarm.values.tool import Tool, Workpiece

#: Six zeros: the default of forces and their patterns.
_ZEROS = (0.0,) * 6
#: Kinds of stops by name.
_STOPS = ("path", "fast", "after_motion")
#: Default stiffness of the reaction "soft" to a collision [Nm/rad].
_COMPLIANCE = 100.0
_REACTIONS = ("brake", "soft")


def _scalar(values: Sequence[float], default: Any) -> Any:
    """Convert a list of one number to a number, and an empty one to the default."""
    given = [float(value) for value in values]
    return given[0] if len(given) == 1 else given or default


def _choice(value: str, choices: Sequence[str], parameter: str) -> str:
    """Check that a text is one of several.

    Raises:
        CommandRejected: it is not.
    """
    if value not in choices:
        raise CommandRejected(
            f"{parameter} must be one of {', '.join(choices)}, got {value!r}",
            parameter=parameter,
            value=value,
        )
    return value


def _names(found: Sequence[str]) -> ServiceResponse:
    return ServiceResponse(True, ", ".join(found) or "none", {"names": list(found)})


def _pairs(request: Any) -> dict[str, float]:
    """Read the names and values of a request.

    Raises:
        ShapeError: not one value for each name.
    """
    names = list(request.names)
    if len(names) != len(request.values):
        raise ShapeError(
            f"values must have one number for each of {len(names)} names, got {len(request.values)}"
        )
    return dict(zip(names, map(float, request.values)))


# -------------------------------------------------------------------------------------- stop and resume


def stop(context: NodeContext, request: Any) -> str:
    """Stop the arm on its path."""
    context.driver.stop()
    return "stopped"


def stop_as(context: NodeContext, request: Any) -> str:
    """Stop the arm on its path, fast, or after the current motion."""
    kind = cast(Literal["path", "fast", "after_motion"], _choice(request.value, _STOPS, "value"))
    context.driver.stop(kind)
    return f"stopped: {kind}"


def pause(context: NodeContext, request: Any) -> str:
    """Pause on the path until `resume`."""
    context.arm.pause()
    return "paused"


def resume(context: NodeContext, request: Any) -> str:
    """Resume after `pause`."""
    context.arm.resume()
    return "resumed"


def recover(context: NodeContext, request: Any) -> ServiceResponse:
    """Recover from a fault as far as a program may."""
    recovery = context.arm.recover()
    return ServiceResponse(recovery.done, str(recovery))


def take_control(context: NodeContext, request: Any) -> str:
    """Become the client that may move the arm."""
    context.arm.take_control()
    return "in control"


def release_control(context: NodeContext, request: Any) -> str:
    """Let another client move the arm."""
    context.wait_for_rest()
    context.arm.release_control()
    return "control is released"


def query_state(context: NodeContext, request: Any) -> ServiceResponse:
    """Evaluate the active trajectory at a ROS time; 0: now."""
    seconds = context.ros.seconds(request.time)
    ahead = seconds - 1e-9 * context.ros.now() if seconds else 0.0
    sample = context.driver.at(context.driver.now + ahead)
    if sample is None:
        return ServiceResponse(False, "no trajectory is active at that time")
    fields = {
        "name": context.joints,
        "position": sample.desired.q.tolist(),
        "velocity": sample.desired.dq.tolist(),
        "acceleration": sample.desired.ddq.tolist(),
    }
    return ServiceResponse(True, "desired state of the trajectory", fields)


def operate(context: NodeContext, request: Any) -> str:
    """Act as the operator of a simulated arm that this node has started."""
    context.arm.operator.do(request.value)
    return f"done: {request.value}"


def set_override(context: NodeContext, request: Any) -> str:
    """Set the application override of the cabinet."""
    context.arm.set_override(request.value)
    return f"override is {request.value:g}"


def set_speed(context: NodeContext, request: Any) -> str:
    """Set the speed limit of the following motions."""
    context.arm.speed = request.value
    return f"speed limit is {request.value:g}"


def set_guard(context: NodeContext, request: Any) -> str:
    """Set the condition that ends servo topics and motions without their own; an empty text: none."""
    condition = condition_of(request.value, "value")
    context.driver.guard = condition
    return "no guard" if condition is None else f"from the next motion on: until {condition}"


def capabilities(context: NodeContext, request: Any) -> ServiceResponse:
    """List the capabilities of the cabinet's application."""
    return _names(context.arm.capabilities)


def info(context: NodeContext, request: Any) -> ServiceResponse:
    """Describe the arm."""
    arm, robot = context.arm, context.arm.robot
    fields = {
        "model": robot.name,
        "title": robot.title,
        "cabinet": arm.cabinet,
        "software": arm.software,
        "is_virtual": arm.is_virtual,
        "real_time_factor": float(arm.real_time_factor),
        "controller": arm.controller,
    }
    limits = {name: getattr(robot, name).tolist() for name in ("q_min", "q_max", "dq_max", "tau_max")}
    return ServiceResponse(True, f"{robot.title}, cabinet {arm.cabinet!r}", fields | limits)


# -------------------------------------------------------------------------------------- control modes


def _set_mode(context: NodeContext, mode: Mode) -> str:
    context.set_mode(mode)
    return f"from the next motion on: {type(mode).__name__}"


def position_mode(context: NodeContext, request: Any) -> str:
    """Set position control for the following motions."""
    return _set_mode(context, Position())


def joint_impedance(context: NodeContext, request: Any) -> str:
    """Set joint impedance for the following motions."""
    damping = _scalar(request.damping, DAMPING)
    return _set_mode(context, JointImpedance(_scalar(request.stiffness, ()), damping=damping))


def cartesian_impedance(context: NodeContext, request: Any) -> str:
    """Set Cartesian impedance for the following motions."""
    return _set_mode(context, _impedance(request))


def sine_impedance(context: NodeContext, request: Any) -> str:
    """Superimpose sine forces on Cartesian impedance for the following motions."""
    mode = SineImpedance(
        _impedance(request),
        amplitude=list(request.amplitude) or _ZEROS,
        frequency=list(request.frequency) or _ZEROS,
        phase=list(request.phase) or _ZEROS,
        bias=list(request.bias) or _ZEROS,
        force_limit=list(request.force_limit) or None,
        position_limit=list(request.position_limit) or None,
        **_times(request),
    )
    return _set_mode(context, mode)


def force_pattern(context: NodeContext, request: Any) -> str:
    """Superimpose a force pattern on Cartesian impedance for the following motions."""
    return _set_mode(context, _pattern(request))


def _impedance(request: Any) -> CartesianImpedance:
    nullspace = list(request.nullspace) or [NULLSPACE_STIFFNESS]
    if len(nullspace) > 2:
        raise ShapeError(
            f"nullspace must have stiffness and damping, got {len(nullspace)} numbers", parameter="nullspace"
        )
    return CartesianImpedance(
        list(request.stiffness) or STIFFNESS,
        damping=_scalar(request.damping, DAMPING),
        nullspace_stiffness=nullspace[0],
        nullspace_damping=nullspace[1] if len(nullspace) > 1 else DAMPING,
        additional_force=list(request.additional_force) or _ZEROS,
        max_force=list(request.max_force) or None,
        max_force_stops=bool(request.max_force_stops),
        max_velocity=list(request.max_velocity) or None,
        max_deviation=list(request.max_deviation) or None,
        frame=request.frame or "tool",
    )


def _times(request: Any) -> dict[str, Any]:
    return {
        "total_time": _scalar(request.total_time, None),
        "rise_time": request.rise_time,
        "hold_time": _scalar(request.hold_time, None),
        "fall_time": request.fall_time,
        "stay_active": bool(request.stay_active),
    }


def _pattern(request: Any) -> SineImpedance:
    pattern = _choice(request.pattern, ("force", "sine", "lissajous", "spiral"), "pattern")
    stiffness = _scalar(request.stiffness, None)
    swing = {"frequency": request.frequency, "amplitude": request.amplitude, "stiffness": stiffness}
    if pattern == "spiral":
        return SineImpedance.spiral(request.plane, total_time=_scalar(request.total_time, 0.0), **swing)
    if pattern == "force":
        force = list(request.force)
        if len(force) != 6:
            raise ShapeError(f"force must have 6 numbers, got {len(force)}", parameter="force")
        x, y, z, about_x, about_y, about_z = force
        mode = SineImpedance.force(x=x, y=y, z=z, a=about_z, b=about_y, c=about_x, stiffness=stiffness)
    elif pattern == "sine":
        mode = SineImpedance.sine(request.direction, phase=request.phase, bias=request.bias, **swing)
    else:
        mode = SineImpedance.lissajous(request.plane, **swing)
    return mode.timed(**_times(request))


# -------------------------------------------------------------------------------- tools and frames


def attach_tool(context: NodeContext, request: Any) -> str:
    """Attach a tool to the flange."""
    context.wait_for_rest()
    tool: Tool | str = request.name
    if not request.known:
        tool = Tool(tcp=pose_of(request.tcp), **_load(request))
    context.arm.attach_tool(tool, frame=request.frame or None)
    return f"{request.name} is attached"


def detach_tool(context: NodeContext, request: Any) -> str:
    """Detach the tool."""
    context.wait_for_rest()
    context.arm.detach_tool()
    context.workpiece = None
    return "no tool is attached"


def attach_workpiece(context: NodeContext, request: Any) -> str:
    """Attach a workpiece to the tool."""
    context.wait_for_rest()
    workpiece: Workpiece | str = request.name
    if not request.known:
        workpiece = Workpiece(**_load(request))
    context.arm.attach_workpiece(workpiece, safety=bool(request.safety))
    context.workpiece = workpiece
    return f"{request.name} is attached" + (" as the safety workpiece" if request.safety else "")


def detach_workpiece(context: NodeContext, request: Any) -> str:
    """Detach the workpiece that this node has attached."""
    if context.workpiece is None:
        raise NotReady("this node has attached no workpiece", hint="attach one first")
    context.wait_for_rest()
    context.arm.detach_workpiece(context.workpiece)
    context.workpiece = None
    return "no workpiece is attached"


def tools(context: NodeContext, request: Any) -> ServiceResponse:
    """List the tools that can be attached by name."""
    return _names(tuple(context.arm.tools))


def frames(context: NodeContext, request: Any) -> ServiceResponse:
    """List the taught frames of the project."""
    return _names(tuple(context.arm.frames))


def get_pose(context: NodeContext, request: Any) -> ServiceResponse:
    """Return the pose of a frame in another frame."""
    frame, reference = request.frame or TOOL, request.reference or BASE
    pose = _pose_fields(context.arm.pose(frame, reference=reference))
    return ServiceResponse(True, f"{frame} in {reference}", {"pose": pose})


def get_wrench(context: NodeContext, request: Any) -> ServiceResponse:
    """Return the external wrench at the origin of a frame."""
    frame, axes = request.frame or TOOL, request.axes or BASE
    wrench = context.arm.wrench(frame, axes=axes)
    fields = {
        "wrench": {
            "force": dict(zip("xyz", wrench.force.tolist())),
            "torque": dict(zip("xyz", wrench.torque.tolist())),
        },
        "inaccuracy": [*wrench.force_inaccuracy.tolist(), *wrench.torque_inaccuracy.tolist()],
    }
    return ServiceResponse(True, f"at {frame}, in axes of {axes}", fields)


def _load(request: Any) -> dict[str, Any]:
    com = request.com
    load: dict[str, Any] = {
        "name": request.name,
        "mass": request.mass,
        "com": (com.x, com.y, com.z),
        "frames": {frame.name: pose_of(frame.pose) for frame in request.frames},
    }
    return load | ({"inertia": list(request.inertia)} if len(request.inertia) else {})


def _pose_fields(pose: Pose) -> dict[str, Any]:
    return {
        "position": dict(zip("xyz", pose.xyz.tolist())),
        "orientation": dict(zip("xyzw", pose.quat.tolist())),
    }


# ------------------------------------------------------------------ signals, smartPAD, process data


def signals(context: NodeContext, request: Any) -> ServiceResponse:
    """List the signals of the cabinet with their values."""
    known = tuple(context.arm.io.signals.values())
    values = context.arm.io.values_now if known else {}
    fields = {
        "names": [signal.name for signal in known],
        "outputs": [signal.is_output for signal in known],
        "kinds": [signal.kind for signal in known],
        "values": [float(values[signal.name]) for signal in known],
        "low": [signal.low for signal in known],
        "high": [signal.high for signal in known],
    }
    return ServiceResponse(True, f"{len(known)} signals", fields)


def set_signals(context: NodeContext, request: Any) -> str:
    """Write outputs, all or none."""
    context.check_active()
    values = _pairs(request)
    context.arm.io.set(values)
    return f"{', '.join(values)} written"


def set_led(context: NodeContext, request: Any) -> str:
    """Set the colour of the LED ring of the media flange."""
    context.check_active()
    context.arm.io.led = request.value
    return f"LED is {request.value}"


def show(context: NodeContext, request: Any) -> str:
    """Write a text into the log of the smartPAD."""
    severity = cast(Literal["info", "warning", "error"], request.severity or "info")
    context.arm.pad.show(request.text, severity=severity)
    return "shown"


def set_key(context: NodeContext, request: Any) -> str:
    """Set text and LED of a user key."""
    led = cast(Literal["grey", "green", "yellow", "red"], request.led or "grey")
    context.arm.pad.set_key(request.slot, request.text, led=led, enabled=not request.disabled)
    return f"key {request.slot} is {request.text!r}"


def process_data(context: NodeContext, request: Any) -> ServiceResponse:
    """Read an entry of the project's process data."""
    value = context.arm.pad.process_data(request.name)
    return ServiceResponse(True, f"{request.name} is {value}", {"value": value})


def set_process_data(context: NodeContext, request: Any) -> str:
    """Write an entry of the project's process data."""
    context.arm.pad.set_process_data(request.name, request.value)
    return f"{request.name} is {request.value}"


# ---------------------------------------------------------------------------------------------- FRI


def open_fri(context: NodeContext, request: Any) -> str:
    """Open an FRI session; one that commands the arm needs it at rest."""
    if request.kind == "monitor":
        context.check_active()
    else:
        context.wait_for_rest()
    settings: dict[str, Any] = {
        "multiplier": request.multiplier or 1,
        "io": tuple(request.io),
        "host": request.host or context.driver.configuration.values["fri.host"],
    }
    settings |= {
        name: getattr(request, name) for name in ("period_ms", "version", "port") if getattr(request, name)
    }
    return context.driver.fri.open(request.kind, **settings)


def close_fri(context: NodeContext, request: Any) -> str:
    """Close the FRI session."""
    return context.driver.fri.close() or "no FRI session is open"


def set_fri_outputs(context: NodeContext, request: Any) -> str:
    """Write outputs that the FRI session carries."""
    values = _pairs(request)
    for name, value in values.items():
        context.driver.fri.output(name, value)
    return f"{', '.join(values)} set"


# ---------------------------------------------------------------------------------- collision guard


def collision_guard(context: NodeContext, request: Any) -> ServiceResponse:
    """Enable the collision guard with a baseline of the resting arm, or disable it."""
    driver = context.driver
    if request.disable:
        driver.collisions.disable()
        driver.guard = driver.guard  # setting it enables servo topics again
        return ServiceResponse(True, "no collision guard")
    reaction = _choice(request.reaction or "brake", _REACTIONS, "reaction")
    compliance = (request.stiffness or _COMPLIANCE) if reaction == "soft" else None
    if compliance is not None:
        JointImpedance(compliance)  # refuse a wrong stiffness now, not at the collision
    context.wait_for_rest()
    guard = context.arm.collision_guard(
        _scalar(request.threshold, THRESHOLD), margin=_scalar(request.margin, 0.0)
    )
    driver.collisions.enable(guard, compliance=compliance)
    driver.guard = driver.guard
    monitor = "this node" if guard.is_moving else "the cabinet"
    return ServiceResponse(
        True, f"{monitor} monitors; reaction: {reaction}", {"baseline": guard.baseline.tolist()}
    )


_TRIGGER, _NUMBER, _TEXT = "std_srvs/Trigger", "heptarm_msgs/SetNumber", "heptarm_msgs/SetText"
_NAMES = "heptarm_msgs/GetNames"

#: All services.
SERVICES = (
    Service("~/stop", _TRIGGER, stop, at_once=True),
    Service("~/stop_as", _TEXT, stop_as, at_once=True),
    Service("~/pause", _TRIGGER, pause, at_once=True),
    Service("~/resume", _TRIGGER, resume, at_once=True),
    Service("~/recover", _TRIGGER, recover),
    Service("~/take_control", _TRIGGER, take_control),
    Service("~/release_control", _TRIGGER, release_control),
    Service("~/query_state", "control_msgs/QueryTrajectoryState", query_state, at_once=True),
    Service("~/operate", _TEXT, operate, at_once=True),
    Service("~/set_override", _NUMBER, set_override, at_once=True),
    Service("~/set_speed", _NUMBER, set_speed, at_once=True),
    Service("~/set_guard", _TEXT, set_guard, at_once=True),
    Service("~/capabilities", _NAMES, capabilities, at_once=True),
    Service("~/info", "heptarm_msgs/GetInfo", info, at_once=True),
    Service("~/mode/position", _TRIGGER, position_mode),
    Service("~/mode/joint_impedance", "heptarm_msgs/SetJointImpedance", joint_impedance),
    Service("~/mode/cartesian_impedance", "heptarm_msgs/SetCartesianImpedance", cartesian_impedance),
    Service("~/mode/sine_impedance", "heptarm_msgs/SetSineImpedance", sine_impedance),
    Service("~/mode/force_pattern", "heptarm_msgs/SetForcePattern", force_pattern),
    Service("~/attach_tool", "heptarm_msgs/AttachTool", attach_tool),
    Service("~/detach_tool", _TRIGGER, detach_tool),
    Service("~/attach_workpiece", "heptarm_msgs/AttachWorkpiece", attach_workpiece),
    Service("~/detach_workpiece", _TRIGGER, detach_workpiece),
    Service("~/tools", _NAMES, tools, at_once=True),
    Service("~/frames", _NAMES, frames, at_once=True),
    Service("~/get_pose", "heptarm_msgs/GetPose", get_pose, at_once=True),
    Service("~/get_wrench", "heptarm_msgs/GetWrench", get_wrench, at_once=True),
    Service("~/signals", "heptarm_msgs/GetSignals", signals, at_once=True),
    Service("~/set_signals", "heptarm_msgs/SetSignals", set_signals, at_once=True),
    Service("~/set_led", _TEXT, set_led, at_once=True),
    Service("~/show", "heptarm_msgs/ShowMessage", show, at_once=True),
    Service("~/set_key", "heptarm_msgs/SetKey", set_key, at_once=True),
    Service("~/process_data", "heptarm_msgs/GetText", process_data, at_once=True),
    Service("~/set_process_data", "heptarm_msgs/SetEntry", set_process_data, at_once=True),
    Service("~/fri/open", "heptarm_msgs/OpenFri", open_fri),
    Service("~/fri/close", _TRIGGER, close_fri),
    Service("~/fri/set_outputs", "heptarm_msgs/SetSignals", set_fri_outputs, at_once=True),
    Service("~/collision_guard", "heptarm_msgs/SetCollisionGuard", collision_guard),
    Service("~/plan", "heptarm_msgs/PlanPath", plan, at_once=True),
)
