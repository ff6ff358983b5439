"""libiiwa: its Python class waits at a port, and the bridge connects to it as libiiwa's application on a cabinet does.

A request is eight numbers, a code and seven arguments; the answer is 38, a status and the state. All are big-endian,
of single or double precision, which the size of the first request shows. Lengths are millimetres, angles radians, and
rotations have KUKA's order A, B, C, about z, y and x. The program asks, the bridge answers; it never sends unasked.

Where libiiwa's application accepts a value and does something else, ends or hangs, this refuses the value: the status
is 0 and the last error is the reason. That error lasts until the next command that succeeds.
"""

from __future__ import annotations

import logging
import struct
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import partial, reduce
from math import isfinite, isnan, nan, pi, radians
from operator import or_
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.bridge.bridged_arm import BridgedArm
from heptarm.bridge.peer import Peer
from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    HeptarmError,
    LimitError,
    MotionAborted,
    ShapeError,
)
from heptarm.io import tcp
from heptarm.values.checks import Array, within
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import JointTorqueOutside, NormalForceAbove
from heptarm.values.frames import FLANGE
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose
from heptarm.values.result import Cause
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: The port at which libiiwa's class waits.
PORT = 12225
#: Numbers of a request and of an answer.
REQUEST, ANSWER = 8, 38
#: Last error: none, a value outside its range, a motion that failed, synchronous and asynchronous, or a setting that
#: does not allow the command.
NO_ERROR, VALUE_ERROR, SYNCHRONOUS_ERROR, ASYNCHRONOUS_ERROR, CONFIGURATION_ERROR = -10, -11, -13, -14, -16

_STOP = 101
#: From this value on a limit of libiiwa is none [SI units].
_NO_LIMIT, _NO_TIME = 1e6, 1e9
#: The largest limits of velocity and deviation that heptarm's modes have [m/s, rad/s, m, rad].
_LARGEST = 100.0
#: A joint this far beyond its limit is at it: numbers of single precision [rad].
_ROUNDING = 1e-6
#: Default stiffness of the joints [Nm/rad].
_STIFFNESS = 2000.0
#: The largest limits along a path that heptarm's motions have [m/s, m/s², m/s³].
_PATH_LIMITS = {"speed_mps": 10.0, "acceleration_mps2": 100.0, "jerk_mps3": 1e4}
_DIRECTIONS, _PLANES = "xyzabc", ("xy", "xz", "yz")
_SINE_FIELDS = tuple(one.name for one in fields(SineImpedance) if one.name != "base")
_PRECISIONS = MappingProxyType({4: "f", 8: "d"})
#: How long the rest of a first request of double precision may take; time between two attempts to connect [s].
_REST, _RETRY = 0.05, 0.5


class LibiiwaBridge:
    """Answers requests of libiiwa.

    Args:
        arm: in control.
        tools: names of tools of the cabinet, in the order of their indices in libiiwa.
    """

    def __init__(self, arm: Arm, *, tools: Sequence[str] = ()) -> None:
        self._arm = arm
        self._bridged = BridgedArm(arm)
        self._tools = tuple(tools)
        self._error = NO_ERROR
        self._logged = ""
        self._measured: tuple[int, list[float]] = (
            -1,
            [],
        )  # stamp of the newest state, and its part of the answer
        self._interrupted: Callable[[], bool] = lambda: False
        # what its settings are
        self._servo = self._synchronous = False
        self._type: Literal["ptp", "lin", "lin_rel", "circ"] = "ptp"
        self._mode: Literal["position", "joint", "cartesian", "sine"] = "position"
        self._joint = {"speed": 1.0, "acceleration": 1.0, "jerk": 1.0}
        self._path = {"speed_mps": 1.0, "acceleration_mps2": 1.0}
        self._joints = JointImpedance(_STIFFNESS)
        self._cartesian = CartesianImpedance()
        self._sine_base = CartesianImpedance()
        self._sine: dict[str, Any] = {}
        self._forces: tuple[Condition, ...] = ()
        self._torques: dict[int, Condition] = {}

    def answer(
        self, request: Sequence[float], *, interrupted: Callable[[], bool] = lambda: False
    ) -> list[float]:
        """Carry out a request.

        Args:
            request: eight numbers.
            interrupted: looks, during a synchronous motion, whether the program stops it.

        Returns:
            The 38 numbers of the answer.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        self._interrupted = interrupted
        code, arguments = _code(request[0]), [float(value) for value in request[1:]]
        return [float(self._carry_out(code, arguments)), *self._state()]

    def stop(self) -> None:
        """Stop the arm: the program has gone."""
        self._bridged.stop()

    def _carry_out(self, code: int, arguments: list[float]) -> bool:
        """Carry out a command; returns its status."""
        if code == 0:  # only asks for the state
            return False
        command = _COMMANDS.get(code)
        try:
            if command is None:
                raise CommandRejected(f"code must be one of libiiwa's commands, got {code}", parameter="code")
            if code in _RESETS:
                self._bridged.halt()
            self._bridged.in_control(partial(command, self, arguments))
        except HeptarmError as error:
            # a motion that ends since control was lost ends so, too; the next command takes it again
            if isinstance(error, ConnectionLost) and not self._bridged.arm.connected:
                raise
            self._error = _error_of(error, code, synchronous=self._synchronous)
            self._log(f"libiiwa's command {code} is refused: {error}")
            return False
        self._error = NO_ERROR
        return True

    def _log(self, text: str) -> None:
        """Log a text once, however often a stream repeats it."""
        if text != self._logged:
            self._logged = text
            _log.warning("%s", text)

    def _state(self) -> list[float]:
        """The answer without its status."""
        state = self._bridged.state()
        if state.stamp != self._measured[0]:  # a program asks more often than the cabinet measures
            self._measured = state.stamp, self._measurements(state)
        safety = state.groups.safety
        fired = self._bridged.has_fired()
        return [
            *self._measured[1],
            float(self._error),
            float(fired),
            float(safety is not None and bool(safety.ready_to_move)),
            float(self._bridged.moves(state)),
        ]

    def _measurements(self, state: State) -> list[float]:
        """Joints, pose of the motion frame, force and torque at the flange in its axes."""
        wrench = self._arm.wrench(FLANGE, axes=FLANGE, state=state)
        return [
            *state.q.tolist(),
            *np.nan_to_num(state.dq).tolist(),
            *state.tau_ext.tolist(),
            *(1000.0 * state.pose.xyz).tolist(),
            *state.pose.abc.tolist(),
            *wrench.force.tolist(),
            *wrench.torque.tolist(),
        ]

    # ---------------------------------------------------------------------------------- motions

    def _command_stop(self, _: list[float]) -> None:
        self._bridged.stop()

    def _joint_position(self, arguments: list[float]) -> None:
        here, target = self._bridged.state().q_cmd, np.array(arguments)
        target = np.where(np.isnan(target), here, target)
        robot = self._arm.robot
        near = target.clip(robot.q_min, robot.q_max)
        if (np.abs(near - target) > _ROUNDING).any():
            robot.check(target, "position")
        self._move(near, lambda: ptp(near, **self._joint))  # type: ignore[arg-type]

    def _cartesian_pose(self, arguments: list[float]) -> None:
        here = self._bridged.state().pose_cmd
        kept = [*here.xyz.tolist(), *here.abc.tolist()]
        given = [*(value / 1000.0 for value in arguments[:3]), *arguments[3:6]]
        numbers = [old if isnan(new) else new for old, new in zip(kept, given, strict=True)]
        pose = Pose.xyz_abc(*numbers)
        if self._type not in ("ptp", "lin"):
            raise CommandRejected(
                f"a pose is reached by PTP or LIN, the motion type is {self._type}", parameter="motion_type"
            )
        if self._type == "lin":
            self._move(pose, lambda: lin(pose, **self._path))  # type: ignore[arg-type]
        else:
            self._move(pose, lambda: ptp(pose, **self._joint))  # type: ignore[arg-type]

    def _circular_motion(self, arguments: list[float]) -> None:
        if self._servo:
            raise CommandRejected("the servo interface has no circles", parameter="control_interface")
        turn = self._bridged.state().pose_cmd.quat
        via, end = (
            Pose.of([value / 1000.0 for value in point], turn) for point in (arguments[:3], arguments[3:6])
        )
        self._start(circ(via, end, **self._path))  # type: ignore[arg-type]

    def _move(self, target: Array | Pose, motion: Callable[[], Motion]) -> None:
        """Move to a target by a motion, or follow it, as the control interface is."""
        if not self._servo:
            self._start(motion())
            return
        if self._synchronous:
            raise CommandRejected(
                "the servo interface has no synchronous motions", parameter="execution_type"
            )
        kind: Literal["joint", "pose", "lin"] = "joint"
        if isinstance(target, Pose):
            kind = "lin" if self._type == "lin" else "pose"
        self._bridged.follow(target, kind, settings=lambda: self._stream_settings(kind))

    def _start(self, motion: Motion) -> None:
        handle = self._bridged.start(motion, mode=self._control_mode(), until=self._until())
        if self._synchronous:
            result = self._bridged.finish(handle, interrupted=self._interrupted)
            if result.cause not in (Cause.FINISHED, Cause.CONDITION):
                raise MotionAborted(
                    f"the motion has not reached its target: {result.cause.value}", result=result
                )
        else:
            handle.add_done_callback(self._on_end)

    def _on_end(self, handle: MotionHandle) -> None:
        """Keep the failure of an asynchronous motion."""
        error = handle.error
        if error is not None and getattr(error, "cause", None) is not Cause.STOPPED:
            self._error = ASYNCHRONOUS_ERROR
            self._log(f"the motion has failed: {error}")

    def _stream_settings(self, kind: str) -> dict[str, Any]:
        limits = (
            {name: self._path[name] for name in ("speed_mps", "acceleration_mps2")}
            if kind == "lin"
            else {name: self._joint[name] for name in ("speed", "acceleration")}
        )
        return {"mode": self._control_mode(), "until": self._until(), **limits}

    def _until(self) -> Condition | None:
        every = [*self._forces, *self._torques.values()]
        return reduce(or_, every) if every else None

    def _control_mode(self) -> Mode:
        if self._mode == "joint":
            return self._joints
        if self._mode == "cartesian":
            return self._cartesian
        return SineImpedance(self._sine_base, **self._sine) if self._mode == "sine" else Position()

    # --------------------------------------------------------------------------------- settings

    def _set_joint_limit(self, name: str, arguments: list[float]) -> None:
        self._joint[name] = within(arguments[0], name, 0.0, 1.0, above=True)

    def _set_path_limit(self, name: str, arguments: list[float]) -> None:
        most = _PATH_LIMITS[name]
        self._path[name] = within(min(arguments[0] / 1000.0, most), name, 0.0, most, above=True)

    def _set_force_condition(self, arguments: list[float]) -> None:
        self._forces = tuple(
            NormalForceAbove(axis, threshold, frame=FLANGE, tolerance=tolerance)
            for axis, threshold, tolerance in zip("xyz", arguments[:3], arguments[3:6], strict=True)
            if not isnan(threshold) and not isnan(tolerance)
        )

    def _set_torque_condition(self, arguments: list[float]) -> None:
        joint, low, high = _index(arguments[0], 7, "joint"), arguments[1], arguments[2]
        without = {number: one for number, one in self._torques.items() if number != joint}
        if not isnan(low) and not isnan(high):
            without[joint] = JointTorqueOutside(joint, low, high)
        self._torques = without

    def _set_impedance(self, name: str, arguments: list[float]) -> None:
        """Set stiffness or damping of the springs; a NaN keeps a component."""
        rest = f"nullspace_{name}"
        old = [*getattr(self._cartesian, name).tolist(), getattr(self._cartesian, rest)]
        given = [*_six(arguments), arguments[6]]
        values = [kept if isnan(new) else new for kept, new in zip(old, given, strict=True)]
        self._replace_impedance({name: values[:6], rest: values[6]})
        if self._servo and self._mode in ("cartesian", "sine"):
            self._bridged.change(self._control_mode())

    def _set_additional_force(self, arguments: list[float]) -> None:
        acting: Any = _six(arguments)
        self._cartesian = replace(self._cartesian, additional_force=acting)

    def _set_max_force(self, arguments: list[float]) -> None:
        limits = _limits(_six(arguments), _NO_LIMIT)
        stops = arguments[6] > 0.0 and any(map(isfinite, limits))  # a limit that is none stops nothing
        self._replace_impedance({"max_force": limits, "max_force_stops": stops})

    def _set_motion_limit(self, name: str, arguments: list[float]) -> None:
        self._replace_impedance({name: _limits(_metres(_six(arguments)), _LARGEST)})

    def _replace_impedance(self, values: dict[str, Any]) -> None:
        self._cartesian, self._sine_base = (
            replace(self._cartesian, **values),
            replace(self._sine_base, **values),
        )

    def _set_joint_impedance(self, name: str, arguments: list[float]) -> None:
        values: dict[str, Any] = {name: arguments}
        self._joints = replace(self._joints, **values)

    def _set_sine(self, name: str, value: Any) -> None:
        SineImpedance(**{name: value})  # refuses what is outside its range
        self._sine = {**self._sine, name: value}

    def _set_stay_active(self, arguments: list[float]) -> None:
        self._sine = {**self._sine, "stay_active": arguments[0] > 0.0}

    def _set_pattern(self, pattern: SineImpedance) -> None:
        """Replace the whole sine mode by a ready pattern."""
        self._sine_base = pattern.base
        self._sine = {name: getattr(pattern, name) for name in _SINE_FIELDS}

    def _set_constant_force(self, arguments: list[float]) -> None:
        direction = _DIRECTIONS[_index(arguments[0], 6, "dof")]
        acting: dict[str, Any] = {direction: arguments[1], "stiffness": arguments[2]}
        self._set_pattern(SineImpedance.force(**acting))

    def _set_sine_pattern(self, arguments: list[float]) -> None:
        self._set_pattern(
            SineImpedance.sine(
                _DIRECTIONS[_index(arguments[0], 6, "dof")],
                frequency=arguments[1],
                amplitude=arguments[2],
                stiffness=arguments[3],
            )
        )

    def _set_lissajous(self, arguments: list[float]) -> None:
        plane = _PLANES[_index(arguments[0], 3, "plane")]
        frequency, amplitude, stiffness = arguments[1:4]
        self._set_pattern(
            SineImpedance.lissajous(plane, frequency=frequency, amplitude=amplitude, stiffness=stiffness)
        )

    def _set_spiral(self, arguments: list[float]) -> None:
        plane = _PLANES[_index(arguments[0], 3, "plane")]
        frequency, amplitude, stiffness, total = arguments[1:5]
        self._set_pattern(
            SineImpedance.spiral(
                plane, frequency=frequency, amplitude=amplitude, total_time=total, stiffness=stiffness
            )
        )

    def _set_communication(self, arguments: list[float]) -> None:
        _choice(arguments, {11: "when asked"}, "communication_mode")

    def _set_interface(self, arguments: list[float]) -> None:
        self._servo = _choice(arguments, {31: "standard", 32: "servo"}, "control_interface") == "servo"

    def _set_type(self, arguments: list[float]) -> None:
        self._type = _choice(arguments, {21: "ptp", 22: "lin", 23: "lin_rel", 24: "circ"}, "motion_type")

    def _set_mode(self, arguments: list[float]) -> None:
        modes = {41: "position", 42: "joint", 43: "cartesian", 44: "sine"}
        self._mode = _choice(arguments, modes, "control_mode")

    def _set_execution(self, arguments: list[float]) -> None:
        self._synchronous = _choice(arguments, {51: False, 52: True}, "execution_type")

    def _set_tool(self, arguments: list[float]) -> None:
        number = _code(arguments[0])
        if number < 0:
            if self._bridged.state().tool:
                self._arm.detach_tool()
            return
        if number >= len(self._tools):
            raise LimitError(
                f"tool must be an index below {len(self._tools)}, got {number}",
                parameter="tool",
                value=number,
                allowed=f"[-1, {len(self._tools) - 1}]",
                hint="give the bridge the names of the tools, in the order of their indices",
            )
        self._arm.attach_tool(self._tools[number])


_Command = Callable[[LibiiwaBridge, list[float]], None]


def _joint_limit(name: str) -> _Command:
    return lambda server, arguments: server._set_joint_limit(name, arguments)


def _path_limit(name: str) -> _Command:
    return lambda server, arguments: server._set_path_limit(name, arguments)


def _impedance(name: str) -> _Command:
    return lambda server, arguments: server._set_impedance(name, arguments)


def _motion_limit(name: str) -> _Command:
    return lambda server, arguments: server._set_motion_limit(name, arguments)


def _joint_impedance(name: str) -> _Command:
    return lambda server, arguments: server._set_joint_impedance(name, arguments)


def _sine(name: str, read: Callable[[list[float]], Any]) -> _Command:
    return lambda server, arguments: server._set_sine(name, read(arguments))


def _six(arguments: Sequence[float]) -> list[float]:
    """Along x, y, z, then about x, y, z: KUKA's A, B and C are about z, y and x."""
    x, y, z, a, b, c = arguments[:6]
    return [x, y, z, c, b, a]


def _metres(six: list[float]) -> list[float]:
    return [*(value / 1000.0 for value in six[:3]), *six[3:]]


def _limits(six: list[float], none: float) -> list[float]:
    """Limits, NaN where there is none."""
    return [nan if isnan(value) or value >= none else value for value in six]


def _zeros(arguments: list[float]) -> list[float]:
    return [0.0 if isnan(value) else value for value in _six(arguments)]


def _phases(arguments: list[float]) -> list[float]:
    return [radians(value) % (2.0 * pi) for value in _zeros(arguments)]


def _time(none: float) -> Callable[[list[float]], float]:
    """Reads a time [s], in whose place NaN and all from libiiwa's "no limit" on mean another one."""
    return lambda arguments: none if isnan(arguments[0]) or arguments[0] >= _NO_TIME else arguments[0]


def _code(value: float) -> int:
    """The number of a code; 0 for what is none."""
    return round(value) if isfinite(value) else 0


def _index(value: float, count: int, name: str) -> int:
    number = _code(value)
    if not 0 <= number < count or not isfinite(value):
        raise LimitError(
            f"{name} must be a number from 0 to {count - 1}, got {value:g}",
            parameter=name,
            value=value,
            allowed=f"[0, {count - 1}]",
        )
    return number


def _choice(arguments: list[float], choices: Mapping[int, Any], name: str) -> Any:
    number = _code(arguments[0])
    if number not in choices:
        raise LimitError(
            f"{name} must be one of {', '.join(map(str, choices))}, got {arguments[0]:g}",
            parameter=name,
            value=arguments[0],
            allowed=", ".join(map(str, choices)),
        )
    return choices[number]


def _error_of(error: HeptarmError, code: int, *, synchronous: bool) -> int:
    """The code of an error of a command."""
    if isinstance(error, (LimitError, ShapeError)):
        return VALUE_ERROR
    if code in _MOTIONS and getattr(error, "parameter", "") not in _SETTINGS:
        return SYNCHRONOUS_ERROR if synchronous else ASYNCHRONOUS_ERROR
    return CONFIGURATION_ERROR


_MOTIONS = (102, 103, 104)
_SETTINGS = ("motion_type", "control_interface", "execution_type")
#: Commands before which what runs is ended, as in libiiwa, also if they are refused.
_RESETS = (101, 211, 212, 301, 302, 303, 304, 305, 400)
_COMMANDS: Mapping[int, _Command] = MappingProxyType(
    {
        _STOP: LibiiwaBridge._command_stop,
        102: LibiiwaBridge._joint_position,
        103: LibiiwaBridge._cartesian_pose,
        104: LibiiwaBridge._circular_motion,
        201: _joint_limit("speed"),
        202: _joint_limit("acceleration"),
        203: _joint_limit("jerk"),
        204: _path_limit("speed_mps"),
        205: _path_limit("acceleration_mps2"),
        206: _path_limit("jerk_mps3"),
        211: LibiiwaBridge._set_force_condition,
        212: LibiiwaBridge._set_torque_condition,
        221: _impedance("stiffness"),
        222: _impedance("damping"),
        223: LibiiwaBridge._set_additional_force,
        224: LibiiwaBridge._set_max_force,
        225: _motion_limit("max_velocity"),
        226: _motion_limit("max_deviation"),
        227: _joint_impedance("stiffness"),
        228: _joint_impedance("damping"),
        229: _sine("amplitude", _zeros),
        230: _sine("frequency", _zeros),
        231: _sine("phase", _phases),
        232: _sine("bias", _six),
        233: _sine("force_limit", lambda arguments: _limits(_six(arguments), _NO_LIMIT)),
        234: _sine("position_limit", lambda arguments: _limits(_metres(_six(arguments)), _LARGEST)),
        235: _sine("total_time", _time(nan)),
        236: _sine("rise_time", _time(0.0)),
        237: _sine("hold_time", _time(nan)),
        238: _sine("fall_time", _time(0.0)),
        239: LibiiwaBridge._set_stay_active,
        240: LibiiwaBridge._set_constant_force,
        241: LibiiwaBridge._set_sine_pattern,
        242: LibiiwaBridge._set_lissajous,
        243: LibiiwaBridge._set_spiral,
        301: LibiiwaBridge._set_communication,
        302: LibiiwaBridge._set_interface,
        303: LibiiwaBridge._set_type,
        304: LibiiwaBridge._set_mode,
        305: LibiiwaBridge._set_execution,
        400: LibiiwaBridge._set_tool,
    }
)


# ------------------------------------------------------------------------------------------- connection


def serve_libiiwa(
    arm: Arm,
    *,
    host: str = "127.0.0.1",
    port: int = PORT,
    tools: Sequence[str] = (),
    on_change: Callable[[str], None] = lambda text: None,
    ended: threading.Event | None = None,
) -> None:
    """Let programs written for libiiwa control an arm, one after the other.

    Args:
        arm: in control.
        host: where the program runs.
        port: at which it waits.
        tools: names of tools, in the order of their indices in libiiwa.
        on_change: called with a sentence when a program connects and when it has gone.
        ended: ends it when it is set; None: it runs until an error or Ctrl-C.

    Raises:
        ConnectionLost: the connection to the cabinet was lost; the cabinet stops the arm.
    """
    over = threading.Event() if ended is None else ended
    while not over.is_set():
        try:
            peer = Peer(tcp.connect(host, port, timeout=_RETRY))
        except ConnectFailed:  # it does not wait yet
            over.wait(_RETRY)
            continue
        on_change(f"a program at {peer.name} controls the arm")
        server = LibiiwaBridge(arm, tools=tools)
        try:
            gone = _converse(peer, server, over)
        finally:
            peer.close()
            with suppress(ConnectionLost):  # then the cabinet stops the arm
                server.stop()
        on_change(f"the program has gone, the arm is stopped ({gone})")


def _converse(peer: Peer, server: LibiiwaBridge, over: threading.Event) -> str:
    """Answer requests until the program has gone; returns why."""
    precision = 0

    def interrupted() -> bool:
        try:
            peer.receive(wait=False)
        except ConnectionLost:
            return True
        letter, waiting = _PRECISIONS[precision], peer.waiting
        return len(waiting) >= precision and _code(struct.unpack_from(f"!{letter}", waiting)[0]) == _STOP

    while not over.is_set():
        try:
            peer.receive()
            if not precision:
                precision = _precision(peer)
        except ConnectionLost as error:
            return str(error)
        letter = _PRECISIONS.get(precision, "")
        while letter and (data := peer.take(REQUEST * precision)) is not None:
            answer = server.answer(struct.unpack(f"!{REQUEST}{letter}", data), interrupted=interrupted)
            try:
                peer.send(struct.pack(f"!{ANSWER}{letter}", *answer))
            except ConnectionLost as error:
                return str(error)
    return "the bridge ends"


def _precision(peer: Peer) -> int:
    """Bytes of a number, by the size of the first request; 0: it is not complete yet."""
    if len(peer.waiting) < REQUEST * 4:
        return 0
    if len(peer.waiting) < REQUEST * 8:  # a program that waits for its answer sends no more
        threading.Event().wait(_REST)
        peer.receive(wait=False)
    return 8 if len(peer.waiting) >= REQUEST * 8 else 4
