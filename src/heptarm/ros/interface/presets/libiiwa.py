"""Topics and services of libiiwa, for programs written for it: the parameter `names` is "libiiwa".

libiiwa has modes: services select how the command topics move the arm, and services of their own set each value. The
state of these modes is a `LibiiwaServer`; everything else is the driver's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from math import isnan, nan
from operator import or_
from types import MappingProxyType
from typing import Any, Literal, cast

from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import CommandRejected, HeptarmError, NotReady, ShapeError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.motions import joint_target, pose_target
from heptarm.ros.interface.service import Service, ServiceResponse
from heptarm.values.checks import within
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import JointTorqueOutside, NormalForceAbove
from heptarm.values.frames import FLANGE
from heptarm.values.mode.impedance import DAMPING, STIFFNESS, CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.line import lin
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.result import Cause

#: Error codes of libiiwa_msgs/GetError.
NO_ERROR, VALUE_ERROR = -10, -11
ASYNCHRONOUS_MOTION_ERROR, INVALID_CONFIGURATION_ERROR = -14, -16
#: From this value on a limit is none.
_NO_LIMIT = 1e6
#: Default tolerance of a force condition [N], and default stiffness of the joints [Nm/rad].
_TOLERANCE, _JOINT_STIFFNESS = 10.0, 2000.0

_Axis = Literal["x", "y", "z"]
Handler = Callable[[NodeContext, Any], ServiceResponse | str]


class LibiiwaServer:
    """What the modes of libiiwa are set to, and the handlers of its topics and services."""

    def __init__(self) -> None:
        self._error = NO_ERROR
        self._servo, self._line = False, False
        self._joint: dict[str, float] = {}  # speed, acceleration and jerk of PTP
        self._path: dict[str, float] = {}  # of LIN
        self._mode = "position"
        self._impedance: dict[str, Any] = {"stiffness": [_JOINT_STIFFNESS] * 7, "damping": DAMPING}
        self._cartesian: dict[str, Any] = {"stiffness": STIFFNESS, "damping": DAMPING}
        self._forces: list[Condition] = []
        self._torques: list[Condition] = []
        self._last: MotionHandle | None = None

    def service(self, name: str, kind: str) -> Service:
        """The row of a service, by its name without namespace."""
        handler = _SERVICES[name]

        def handle(context: NodeContext, request: Any) -> ServiceResponse | str:
            try:
                return handler(self, context, request)
            except NotReady:
                self._error = INVALID_CONFIGURATION_ERROR
                raise
            except HeptarmError:
                self._error = VALUE_ERROR
                raise

        return Service(f"iiwa/{name}", kind, handle)

    # ------------------------------------------------------------------------------------ topics

    def joint(self, context: NodeContext, message: Any) -> None:
        """Move to the positions of a sensor_msgs/JointState, or follow them; NaN keeps the position of a joint."""
        target = joint_target(context.driver, message.name, message.position)
        if self._servo:
            self._checked(lambda: context.driver.follow(target))
        else:
            self._start(context, lambda: ptp(target, **self._joint))  # type: ignore[arg-type]

    def pose(self, context: NodeContext, message: Any) -> None:
        """Move to a geometry_msgs/Pose, or follow it, by joints or on a line; NaN keeps a coordinate."""
        place, turn = message.position, message.orientation
        xyz, quat = (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
        target = pose_target(context.driver, xyz, quat)
        if self._servo:
            self._checked(lambda: context.driver.follow(target, straight=self._line))
        elif self._line:
            self._start(context, lambda: lin(target, **self._path))  # type: ignore[arg-type]
        else:
            self._start(context, lambda: ptp(target, **self._joint))  # type: ignore[arg-type]

    def _start(self, context: NodeContext, motion: Callable[[], Motion]) -> None:
        """Start a motion; a speed that a service has set replaces the limit by the parameter `speed`."""

        def start() -> None:
            limit = None if self._line or "speed" not in self._joint else 1.0
            self._last = context.driver.start(motion(), speed=limit)

        self._checked(start)

    def _checked(self, move: Callable[[], None]) -> None:
        try:
            move()
        except HeptarmError:
            self._error = ASYNCHRONOUS_MOTION_ERROR
            raise

    # ------------------------------------------------------------------------------------- state

    def last_error(self, context: NodeContext, request: Any) -> ServiceResponse:
        """Return the code of the last error, once."""
        code, self._error = self._error, NO_ERROR
        return ServiceResponse(True, "", {"error_code": code})

    def has_fired_condition(self, context: NodeContext, request: Any) -> ServiceResponse:
        """Return whether a condition has ended the last motion that a command topic has started."""
        result = None if self._last is None else self._last.result
        fired = result is not None and result.cause is Cause.CONDITION
        return ServiceResponse(True, "", {"data": fired})

    def is_ready_to_move(self, context: NodeContext, request: Any) -> ServiceResponse:
        """Return whether the arm can move."""
        state = context.driver.state
        safety = None if state is None else state.groups.safety
        ready = context.driver.active and safety is not None and bool(safety.ready_to_move)
        return ServiceResponse(True, "", {"data": ready})

    def has_active_motion(self, context: NodeContext, request: Any) -> ServiceResponse:
        """Return whether a motion is running."""
        state = context.driver.state
        running = state is not None and state.motion is not None and state.motion.active
        return ServiceResponse(True, "", {"data": running})

    # ----------------------------------------------------------------------------------- motions

    def set_control_interface(self, context: NodeContext, request: Any) -> str:
        """Select whether the command topics start a motion (standard) or follow a stream (servo)."""
        self._servo = _choice(request.data, ("standard", "servo")) == "servo"
        return f"control interface is {request.data.lower()}"

    def set_motion_type(self, context: NodeContext, request: Any) -> str:
        """Select by joints or on a line, for poses."""
        self._line = _choice(request.data, ("ptp", "lin")) == "lin"
        return f"motion type is {request.data.lower()}"

    def set_execution_type(self, context: NodeContext, request: Any) -> str:
        """Accept what is so: a command topic never waits for the end of a motion."""
        _choice(request.data, ("asynchronous",))
        return "execution type is asynchronous"

    def set_communication_mode(self, context: NodeContext, request: Any) -> str:
        """Accept both: the cabinet always pushes states."""
        _choice(request.data, ("on-demand", "periodical"))
        return "the cabinet pushes states"

    def set_speed(self, name: str, high: float) -> Handler:
        """Make the handler of a limit of PTP ("speed") or LIN ("speed_mps")."""
        values = self._path if "_mps" in name else self._joint

        def handler(context: NodeContext, request: Any) -> str:
            values[name] = within(float(request.data), name, 0.0, high, above=True)
            return f"{name} is {request.data:g}"

        return handler

    # ------------------------------------------------------------------------------ control modes

    def set_control_mode(self, context: NodeContext, request: Any) -> str:
        """Set the control mode of the following motions, with the values that its services have set."""
        name = _choice(request.data, tuple(_MODES))
        context.set_mode(_MODES[name](self._impedance, self._cartesian))
        self._mode = name
        return f"from the next motion on: {name}"

    def _change(self, context: NodeContext, group: dict[str, Any], **values: Any) -> str:
        """Change values of a mode, all or none; they take effect at once if it is the current one."""
        before = dict(group)
        group.update(values)
        try:
            for make in _MODES.values():
                make(self._impedance, self._cartesian)  # refuses values outside their ranges
            if (self._mode == "joint_impedance") == (group is self._impedance) and self._mode != "position":
                context.set_mode(_MODES[self._mode](self._impedance, self._cartesian))
        except HeptarmError:
            group.clear()
            group.update(before)
            raise
        return f"{', '.join(values)} set"

    def set_joint_stiffness(self, context: NodeContext, request: Any) -> str:
        """Set the stiffness of seven joints [Nm/rad]."""
        return self._change(context, self._impedance, stiffness=_numbers(request, 7))

    def set_joint_damping(self, context: NodeContext, request: Any) -> str:
        """Set the damping ratio of seven joints."""
        return self._change(context, self._impedance, damping=_numbers(request, 7))

    def set_cartesian_stiffness(self, context: NodeContext, request: Any) -> str:
        """Set the Cartesian stiffness [N/m, Nm/rad], and that of the null space [Nm/rad]."""
        return self._change(
            context, self._cartesian, stiffness=_six(request), nullspace_stiffness=float(request.float_param)
        )

    def set_cartesian_damping(self, context: NodeContext, request: Any) -> str:
        """Set the Cartesian damping ratios, and that of the null space."""
        return self._change(
            context, self._cartesian, damping=_six(request), nullspace_damping=float(request.float_param)
        )

    def set_cartesian_additional_control_force(self, context: NodeContext, request: Any) -> str:
        """Set the additional force [N, Nm]."""
        return self._change(context, self._cartesian, additional_force=_six(request))

    def set_cartesian_max_control_force(self, context: NodeContext, request: Any) -> str:
        """Limit the force of the control [N, Nm]; `boolean_param`: reaching it stops the motion."""
        return self._change(
            context,
            self._cartesian,
            max_force=_limits(request),
            max_force_stops=bool(request.boolean_param),
        )

    def set_cartesian_max_velocity(self, context: NodeContext, request: Any) -> str:
        """Limit the velocity [m/s, rad/s]; a higher one stops the motion."""
        return self._change(context, self._cartesian, max_velocity=_limits(request))

    def set_cartesian_max_path_deviation(self, context: NodeContext, request: Any) -> str:
        """Limit the deviation from the path [m, rad]; a larger one stops the motion."""
        return self._change(context, self._cartesian, max_deviation=_limits(request))

    # -------------------------------------------------------------------------------- conditions

    def set_force_condition(self, context: NodeContext, request: Any) -> str:
        """End motions by forces along the axes of the flange [N]; NaN: not along this axis."""
        values = [float(value) for value in request.data]
        if len(values) not in (3, 6):
            raise ShapeError(
                f"data must be three thresholds, or these and three tolerances, got {len(values)} numbers"
            )
        tolerances = values[3:] or [_TOLERANCE] * 3
        self._forces = [
            NormalForceAbove(axis, threshold, frame=FLANGE, tolerance=tolerance)
            for axis, threshold, tolerance in zip("xyz", values, tolerances)
            if not isnan(threshold) and not isnan(tolerance)
        ]
        return self._guard(context)

    def set_joint_torque_condition(self, context: NodeContext, request: Any) -> str:
        """End motions by external torques outside a band [Nm]: seven lower and seven upper limits, NaN: no limits."""
        values = _numbers(request, 14)
        self._torques = [
            JointTorqueOutside(joint, low, high)
            for joint, (low, high) in enumerate(zip(values[:7], values[7:]))
            if not isnan(low) and not isnan(high)
        ]
        return self._guard(context)

    def reset_conditions(self, context: NodeContext, request: Any) -> ServiceResponse:
        """End motions by no condition any more."""
        self._forces, self._torques = [], []
        return ServiceResponse(True, self._guard(context))

    def _guard(self, context: NodeContext) -> str:
        every = [*self._forces, *self._torques]
        context.driver.guard = reduce(or_, every) if every else None
        return f"from the next motion on: until {context.driver.guard}" if every else "no condition"


def _choice(value: str, choices: tuple[str, ...]) -> str:
    if value.lower() not in choices:
        raise CommandRejected(
            f"data must be one of {', '.join(choices)}, got {value!r}", parameter="data", value=value
        )
    return value.lower()


def _numbers(request: Any, count: int) -> list[float]:
    values = [float(value) for value in request.data]
    if len(values) != count:
        raise ShapeError(f"data must have {count} numbers, got {len(values)}", parameter="data")
    return values


def _six(request: Any) -> list[float]:
    """Components x, y, z, then about x, y, z: KUKA's angles a, b and c are about z, y and x."""
    return [float(getattr(request, name)) for name in "xyzcba"]


def _limits(request: Any) -> list[float]:
    return [nan if value >= _NO_LIMIT else value for value in _six(request)]


#: The mode of a name, of the values for joint impedance and those for Cartesian impedance.
_MODES: Mapping[str, Callable[[dict[str, Any], dict[str, Any]], Mode]] = MappingProxyType(
    {
        "position": lambda joint, cartesian: Position(),
        "joint_impedance": lambda joint, cartesian: JointImpedance(**joint),
        "cartesian_impedance": lambda joint, cartesian: CartesianImpedance(**cartesian),
        "cartesian_sine_impedance": lambda joint, cartesian: SineImpedance(CartesianImpedance(**cartesian)),
    }
)


def _speed(name: str, high: float) -> Callable[[LibiiwaServer, NodeContext, Any], str]:
    return lambda server, context, request: cast(str, server.set_speed(name, high)(context, request))


#: Handlers of the services by their names without namespace.
_SERVICES: Mapping[str, Callable[[LibiiwaServer, NodeContext, Any], ServiceResponse | str]] = (
    MappingProxyType(
        {
            "last_error": LibiiwaServer.last_error,
            "has_fired_condition": LibiiwaServer.has_fired_condition,
            "is_ready_to_move": LibiiwaServer.is_ready_to_move,
            "has_active_motion": LibiiwaServer.has_active_motion,
            "set_control_interface": LibiiwaServer.set_control_interface,
            "set_motion_type": LibiiwaServer.set_motion_type,
            "set_execution_type": LibiiwaServer.set_execution_type,
            "set_communication_mode": LibiiwaServer.set_communication_mode,
            "set_desired_joint_velocity_rel": _speed("speed", 1.0),
            "set_desired_joint_acceleration_rel": _speed("acceleration", 1.0),
            "set_desired_joint_jerk_rel": _speed("jerk", 1.0),
            "set_desired_cartesian_velocity": _speed("speed_mps", 10.0),
            "set_desired_cartesian_acceleration": _speed("acceleration_mps2", 100.0),
            "set_desired_cartesian_jerk": _speed("jerk_mps3", 10_000.0),
            "set_control_mode": LibiiwaServer.set_control_mode,
            "set_joint_stiffness": LibiiwaServer.set_joint_stiffness,
            "set_joint_damping": LibiiwaServer.set_joint_damping,
            "set_cartesian_stiffness": LibiiwaServer.set_cartesian_stiffness,
            "set_cartesian_damping": LibiiwaServer.set_cartesian_damping,
            "set_cartesian_additional_control_force": LibiiwaServer.set_cartesian_additional_control_force,
            "set_cartesian_max_control_force": LibiiwaServer.set_cartesian_max_control_force,
            "set_cartesian_max_velocity": LibiiwaServer.set_cartesian_max_velocity,
            "set_cartesian_max_path_deviation": LibiiwaServer.set_cartesian_max_path_deviation,
            "set_force_condition": LibiiwaServer.set_force_condition,
            "set_joint_torque_condition": LibiiwaServer.set_joint_torque_condition,
            "reset_conditions": LibiiwaServer.reset_conditions,
        }
    )
)
