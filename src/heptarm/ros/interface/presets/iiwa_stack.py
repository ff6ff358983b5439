"""Topics, services and actions of iiwa_stack, for programs written for it: the parameter `names` is "iiwa_stack".

A message on a command topic is a destination there: the arm goes on to it when no other message comes, and
state/DestinationReached reports that it is there. Services set the control mode, the limits and the motion frame of
what follows; they are kept in `NodeContext.iiwa_stack`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isnan, nan
from types import MappingProxyType
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.ros.interface import topics
from heptarm.ros.interface.action import ActionResult, GoalClient, GoalWork
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.motions import pose_of, stamped_pose
from heptarm.ros.interface.program_goal import run_motion
from heptarm.ros.interface.service import ServiceResponse
from heptarm.ros.node.target_stream import StreamLimits
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.values.checks import Array, within
from heptarm.values.frames import FLANGE, TOOL
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import Segment, spl, spline
from heptarm.values.pose import Pose, Redundancy

#: Values of iiwa_msgs/ControlMode.
_POSITION, _JOINT_IMPEDANCE, _CARTESIAN_IMPEDANCE, _DESIRED_FORCE, _SINE_PATTERN = range(5)
#: Directions of iiwa_msgs/DOF, from 1 on: KUKA's a, b and c are about z, y and x.
_DIRECTIONS = ("x", "y", "z", "a", "b", "c")
#: Kinds of iiwa_msgs/SplineSegment.
_SPL, _LIN, _CIRC = range(3)
#: The remaining time when nothing moves [s].
_NOTHING_MOVES = -999.0
#: Stiffness of the joints where a request gives none [Nm/rad].
_JOINT_STIFFNESS = 1000.0
#: Millimetres in a metre: limits of the position are in mm and mm/s.
_MM = 1000.0
#: Keywords of `heptarm.lin` by the fields of iiwa_msgs/SetPTPCartesianSpeedLimits; these are in m and rad.
PATH_LIMITS = {
    "maxCartesianVelocity": "speed_mps",
    "maxOrientationVelocity": "speed_radps",
    "maxCartesianAcceleration": "acceleration_mps2",
    "maxOrientationAcceleration": "acceleration_radps2",
    "maxCartesianJerk": "jerk_mps3",
    "maxOrientationJerk": "jerk_radps3",
}

# ----------------------------------------------------------------------------------- quantities


def _joints(message: Any) -> Array:
    """Read an iiwa_msgs/JointQuantity, shape (7,)."""
    return np.array([getattr(message, f"a{number}") for number in range(1, 8)], dtype=np.float64)


def _six(message: Any) -> list[float]:
    """Read an iiwa_msgs/CartesianQuantity: x, y, z, then about x, y, z."""
    return [float(getattr(message, name)) for name in "xyzcba"]


def _given(values: list[float], defaults: Array, *, above: float) -> list[float]:
    """Replace values that are not above a bound, or not at it either, by defaults."""
    return [
        value if value > above else default for value, default in zip(values, defaults.tolist(), strict=True)
    ]


# -------------------------------------------------------------------------------- command topics


def _limits(context: NodeContext) -> StreamLimits:
    settings, values = context.iiwa_stack, context.driver.configuration.values
    return StreamLimits(
        settings.servo_speed or values["speed"],
        settings.servo_acceleration or values["servo.acceleration"],
        settings.line_speed,
        settings.turn_speed,
    )


def _go(context: NodeContext, target: Array | Pose, dq: Array | None = None, **how: Any) -> None:
    stays = context.iiwa_stack.compliant
    context.driver.go_to(target, dq, limits=_limits(context), stays=stays, **how)


def command_joints(context: NodeContext, message: Any) -> None:
    """Go to the positions of an iiwa_msgs/JointPosition."""
    _go(context, _joints(message.position))


def command_joints_velocity(context: NodeContext, message: Any) -> None:
    """Go to the positions of an iiwa_msgs/JointPositionVelocity, and pass them with its velocities."""
    _go(context, _joints(message.position), _joints(message.velocity))


def command_velocity(context: NodeContext, message: Any) -> None:
    """Move with the velocities of an iiwa_msgs/JointVelocity until none come."""
    context.driver.follow_velocity(_joints(message.velocity))


def command_pose(context: NodeContext, message: Any) -> None:
    """Go to a geometry_msgs/PoseStamped by interpolating joints."""
    _go_to_pose(context, message, straight=False)


def command_line(context: NodeContext, message: Any) -> None:
    """Go to a geometry_msgs/PoseStamped on a straight line."""
    _go_to_pose(context, message, straight=True)


def _go_to_pose(context: NodeContext, message: Any, *, straight: bool) -> None:
    settings = context.iiwa_stack
    pose = stamped_pose(message, context.driver)
    _go(context, pose, straight=straight, moving=settings.moving, offset=settings.offset)


#: By the last part of their names.
TOPICS: Mapping[str, Callable[[NodeContext, Any], None]] = MappingProxyType(
    {
        "JointPosition": command_joints,
        "JointPositionVelocity": command_joints_velocity,
        "JointVelocity": command_velocity,
        "CartesianPose": command_pose,
        "CartesianPoseLin": command_line,
        "CartesianVelocity": topics.servo_twist,
    }
)

# --------------------------------------------------------------------------------- control modes


def configure_control_mode(context: NodeContext, request: Any) -> str:
    """Set the control mode of the following motions; the arm becomes compliant at once, as in iiwa_stack."""
    mode = mode_of(request)
    driver, settings = context.driver, context.iiwa_stack
    driver.end_stream()
    context.set_mode(mode)
    settings.compliant = not isinstance(mode, Position)
    if settings.compliant:
        _go(context, context.arm.state.q_cmd)
    return "control mode is set"


def mode_of(request: Any) -> Mode:
    """Convert a request of iiwa_msgs/ConfigureControlMode.

    Raises:
        CommandRejected: no such mode, or a direction that it does not have.
        LimitError: a value outside its range.
    """
    kind = request.control_mode
    if kind == _POSITION:
        return Position()
    if kind == _JOINT_IMPEDANCE:
        return _joint_impedance(request.joint_impedance)
    limits = _mode_limits(request.limits)
    if kind == _CARTESIAN_IMPEDANCE:
        return _cartesian_impedance(request.cartesian_impedance, limits)
    base = CartesianImpedance(**limits)
    if kind == _DESIRED_FORCE:
        force = request.desired_force
        direction = _direction(force.cartesian_dof)
        return SineImpedance.force(
            **{direction: force.desired_force}, stiffness=force.desired_stiffness, base=base
        )
    if kind == _SINE_PATTERN:
        sine = request.sine_pattern
        return SineImpedance.sine(
            _direction(sine.cartesian_dof),
            frequency=sine.frequency,
            amplitude=sine.amplitude,
            stiffness=sine.stiffness,
            base=base,
        )
    raise CommandRejected(
        f"control_mode must be 0 to {_SINE_PATTERN}, got {kind}", parameter="control_mode", value=kind
    )


def _joint_impedance(message: Any) -> JointImpedance:
    """Negative values are the defaults of the mode, for all joints."""
    mode = JointImpedance(_JOINT_STIFFNESS)
    stiffness, damping = _joints(message.joint_stiffness), _joints(message.joint_damping)
    if (stiffness >= 0.0).all():
        mode = replace(mode, stiffness=stiffness)
    return replace(mode, damping=damping) if (damping >= 0.0).all() else mode


def _cartesian_impedance(message: Any, limits: Mapping[str, Any]) -> CartesianImpedance:
    """A negative stiffness and a damping that is not positive are the defaults of the mode."""
    mode = CartesianImpedance(**limits)
    stiffness, damping = _six(message.cartesian_stiffness), _six(message.cartesian_damping)
    least = float(np.nextafter(0.0, -1.0))
    changed: dict[str, Any] = {
        "stiffness": _given(stiffness, mode.stiffness, above=least),
        "damping": _given(damping, mode.damping, above=0.0),
    }
    if message.nullspace_stiffness >= 0.0:
        changed["nullspace_stiffness"] = message.nullspace_stiffness
    if message.nullspace_damping > 0.0:
        changed["nullspace_damping"] = message.nullspace_damping
    return replace(mode, **changed)


def _mode_limits(message: Any) -> dict[str, Any]:
    """Limits of a Cartesian mode; each counts if all of its six values are positive."""
    scale = np.array([_MM] * 3 + [1.0] * 3)
    found: dict[str, Any] = {}
    for name, keyword, unit in (
        ("max_path_deviation", "max_deviation", scale),
        ("max_control_force", "max_force", np.ones(6)),
        ("max_cartesian_velocity", "max_velocity", scale),
    ):
        values = np.array(_six(getattr(message, name)))
        if (values > 0.0).all():
            found[keyword] = (values / unit).tolist()
    if "max_force" in found:
        found["max_force_stops"] = bool(message.max_control_force_stop)
    return found


def _direction(dof: int) -> str:
    if not 1 <= dof <= len(_DIRECTIONS):
        raise CommandRejected(
            f"cartesian_dof must be 1 (X) to {len(_DIRECTIONS)} (C), got {dof}",
            parameter="cartesian_dof",
            value=dof,
            hint="one direction at a time",
        )
    return _DIRECTIONS[dof - 1]


# ---------------------------------------------------------------------------------------- limits


def set_speed_override(context: NodeContext, request: Any) -> str:
    """Set the application override, clipped to 0 to 1 as in iiwa_stack."""
    context.arm.set_override(min(1.0, max(0.0, request.override_reduction)))
    return "override is set"


def set_servo_limits(context: NodeContext, request: Any) -> str:
    """Limit the command topics, fractions of each axis' maximum; what is not positive is left as it is."""
    settings = context.iiwa_stack
    speed, acceleration = _fractions(request)
    settings.servo_speed = speed or settings.servo_speed
    settings.servo_acceleration = acceleration or settings.servo_acceleration
    return "limits are set"


def set_line_limits(context: NodeContext, request: Any) -> str:
    """Limit straight command topics [m/s, rad/s]: the smallest positive value of the three axes is that of all."""
    twist, settings = request.max_cartesian_velocity, context.iiwa_stack
    settings.line_speed = _smallest(twist.linear, "linear", 10.0, "m/s") or settings.line_speed
    settings.turn_speed = _smallest(twist.angular, "angular", 20.0, "rad/s") or settings.turn_speed
    return "limits are set"


def set_joint_limits(context: NodeContext, request: Any) -> str:
    """Limit motions of the actions in joint space, fractions of each axis' maximum."""
    speed, acceleration = _fractions(request)
    given = {"speed": speed, "acceleration": acceleration}
    context.iiwa_stack.joints |= {name: value for name, value in given.items() if value is not None}
    return "limits are set"


def set_path_limits(context: NodeContext, request: Any) -> str:
    """Limit motions of the actions along a path [m/s, rad/s, and their derivatives]."""
    given = {keyword: getattr(request, name) for name, keyword in PATH_LIMITS.items()}
    path = context.iiwa_stack.path | {name: value for name, value in given.items() if value > 0.0}
    lin(Pose.at(0.0, 0.0, 0.0), **path)  # refuses values outside their ranges
    context.iiwa_stack.path = path
    return "limits are set"


def _fractions(request: Any) -> tuple[float | None, float | None]:
    """Read relative speed and acceleration; None: not positive, so not given."""
    pairs = (
        (name, getattr(request, name)) for name in ("joint_relative_velocity", "joint_relative_acceleration")
    )
    speed, acceleration = (
        within(value, name, 0.0, 1.0, above=True) if value > 0.0 or isnan(value) else None
        for name, value in pairs
    )
    return speed, acceleration


def _smallest(vector: Any, name: str, most: float, unit: str) -> float | None:
    values = [value for value in (vector.x, vector.y, vector.z) if value > 0.0 or isnan(value)]
    return within(min(values), name, 0.0, most, above=True, unit=unit) if values else None


# ------------------------------------------------------------------------- frames, tools and times


def set_endpoint_frame(context: NodeContext, request: Any) -> str:
    """Select the motion frame of commands: empty, that of the tool; the name of the flange; or one of the tool's."""
    name = request.frame_id.lstrip("/")
    settings, configuration = context.iiwa_stack, context.driver.configuration
    moving = {"": TOOL, configuration.frame("flange"): FLANGE}.get(name, name)
    settings.offset = None if moving == TOOL else context.arm.pose(moving, reference=FLANGE)
    settings.moving = moving
    return f"motion frame is {moving}"


def set_workpiece(context: NodeContext, request: Any) -> str:
    """Attach the workpiece of a template of the project as the safety workpiece, in place of the one before.

    An empty name only detaches. On a cabinet without safety workpieces it is attached as any other.
    """
    if context.workpiece is not None or request.workpiece_id:
        context.wait_for_rest()
    if context.workpiece is not None:
        context.arm.detach_workpiece(context.workpiece)
        context.workpiece = None
    if not request.workpiece_id:
        return "no workpiece is attached"
    safety = "safety_workpieces" in context.arm.capabilities
    context.arm.attach_workpiece(request.workpiece_id, safety=safety)
    context.workpiece = request.workpiece_id
    return f"{request.workpiece_id} is attached"


def time_to_destination(context: NodeContext, request: Any) -> ServiceResponse:
    """Return the remaining time of the motion [s]; -999: nothing moves, or the cabinet does not report it."""
    state = context.driver.state
    motion = None if state is None else state.motion
    remaining = nan if motion is None or not motion.active else motion.remaining
    return ServiceResponse(True, "", {"remaining_time": _NOTHING_MOVES if isnan(remaining) else remaining})


#: By the last part of their names.
SERVICES: Mapping[str, Callable[[NodeContext, Any], ServiceResponse | str]] = MappingProxyType(
    {
        "ConfigureControlMode": configure_control_mode,
        "setSpeedOverride": set_speed_override,
        "setSmartServoLimits": set_servo_limits,
        "setSmartServoLinLimits": set_line_limits,
        "pathParameters": set_servo_limits,
        "pathParametersLin": set_line_limits,
        "setPTPJointLimits": set_joint_limits,
        "setPTPCartesianLimits": set_path_limits,
        "setEndpointFrame": set_endpoint_frame,
        "setWorkpiece": set_workpiece,
        "timeToDestination": time_to_destination,
    }
)

# --------------------------------------------------------------------------------------- actions


def move_to_joint_position(context: NodeContext, goal: Any) -> GoalWork:
    """Move to joint positions by PTP."""
    settings = context.iiwa_stack
    return _start(context, ptp(_joints(goal.joint_position.position), **settings.joints))


def move_to_pose(context: NodeContext, goal: Any) -> GoalWork:
    """Move to a pose by PTP."""
    settings, (pose, redundancy) = context.iiwa_stack, _target(context, goal.cartesian_pose)
    return _start(context, ptp(pose, redundancy=redundancy, moving=settings.moving, **settings.joints))


def move_to_pose_straight(context: NodeContext, goal: Any) -> GoalWork:
    """Move to a pose on a straight line."""
    settings, (pose, redundancy) = context.iiwa_stack, _target(context, goal.cartesian_pose)
    return _start(context, lin(pose, redundancy=redundancy, moving=settings.moving, **settings.path))


def move_along_spline(context: NodeContext, goal: Any) -> GoalWork:
    """Move along a spline of poses, lines and arcs."""
    settings = context.iiwa_stack
    segments = [_segment(context, segment) for segment in goal.spline.segments]
    return _start(context, spline(segments, moving=settings.moving, **settings.path))


def _target(context: NodeContext, message: Any) -> tuple[Pose, Redundancy | None]:
    """Read an iiwa_msgs/CartesianPose, and its redundancy if neither Status nor Turn is negative."""
    pose = stamped_pose(message.poseStamped, context.driver)
    redundancy = message.redundancy
    if redundancy.status < 0 or redundancy.turn < 0:
        return pose, None
    return pose, Redundancy(redundancy.e1, redundancy.status, redundancy.turn)


def _segment(context: NodeContext, message: Any) -> Segment:
    pose, _ = _target(context, message.point)
    if message.type == _SPL:
        return spl(pose)
    if message.type == _LIN:
        return lin(pose)
    if message.type == _CIRC:
        return circ(pose_of(message.point_aux.poseStamped.pose), pose)
    raise CommandRejected(
        f"type of a segment must be 0 (SPL), 1 (LIN) or 2 (CIRC), got {message.type}",
        parameter="type",
        value=message.type,
    )


def _start(context: NodeContext, motion: Motion) -> GoalWork:
    """Start a motion; a speed that a service has set replaces the limit by the parameter `speed`."""
    limit = 1.0 if context.iiwa_stack.joints.get("speed") else None
    work = run_motion(context, motion, speed=limit)

    def run(client: GoalClient) -> ActionResult:
        result = work(client)
        if result.outcome is GoalOutcome.SUCCEEDED:
            context.driver.announce_arrival()
        return result

    return run


#: By the last part of their names.
ACTIONS: Mapping[str, Callable[[NodeContext, Any], GoalWork]] = MappingProxyType(
    {
        "move_to_joint_position": move_to_joint_position,
        "move_to_cartesian_pose": move_to_pose,
        "move_to_cartesian_pose_lin": move_to_pose_straight,
        "move_along_spline": move_along_spline,
    }
)
