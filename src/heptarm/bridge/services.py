"""Services of the nodes, free of ROS: one table for both, and what each does.

A node makes a service of every row of `SERVICES`; the fields of a request are those of the row's type::

    services = Services(driver)
    for row in SERVICES:
        ...                                    # of row.type, under row.name: services.answer(row, request)
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from heptarm.bridge.driver import Answer, Driver
from heptarm.errors import HeptarmError, NotReady, Timeout
from heptarm.values.impedance import (
    DAMPING,
    NULLSPACE_STIFFNESS,
    STIFFNESS,
    CartesianImpedance,
    JointImpedance,
)
from heptarm.values.mode import Mode, Position
from heptarm.values.pose import Pose
from heptarm.values.sine import SineImpedance
from heptarm.values.tool import Tool, Workpiece

#: How long a motion may take to end of itself before something that it stands in the way of [s].
_PATIENCE = 2.0
#: Names of stops by what the service is called with.
_STOPS = ("path", "fast", "after_motion")


@dataclass(frozen=True, slots=True)
class Names(Answer):
    """An answer with a list.

    Attributes:
        names: what was asked for.
    """

    names: tuple[str, ...] = ()


class Services:
    """What the services do with an arm.

    Args:
        driver: whose arm it is.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._arm = driver.arm
        self._lock = threading.Lock()
        self._mode = contextlib.ExitStack()
        self._workpiece: Workpiece | None = None

    def answer(self, row: Service, request: Any) -> Answer:
        """Do what a request wants; what goes wrong is in the answer.

        Args:
            row: which service.
            request: with the fields of its type.
        """
        try:
            with contextlib.nullcontext() if row.at_once else self._lock:
                done = row.work(self, request)
        except HeptarmError as error:
            return Answer(False, str(error))
        return done if isinstance(done, Answer) else Answer(True, done)

    # ------------------------------------------------------------------------------- stop and go

    def stop(self, request: Any) -> Answer:
        """Stop whatever runs."""
        return self._driver.stop()

    def stop_as(self, request: Any) -> str:
        """Stop on the path, fast, or after the motion that runs."""
        if request.value not in _STOPS:
            raise NotReady(f"there is no stop {request.value!r}", hint=f"choose from {', '.join(_STOPS)}")
        self._arm.stop(request.value)
        return f"stopped: {request.value}"

    def pause(self, request: Any) -> str:
        """Stop on the path until `resume`."""
        self._arm.pause()
        return "paused"

    def resume(self, request: Any) -> str:
        """Go on."""
        self._arm.resume()
        return "resumed"

    def recover(self, request: Any) -> Answer:
        """Come back after trouble as far as a program may."""
        return self._driver.recover()

    def take_control(self, request: Any) -> str:
        """Become the one who may move the arm."""
        self._arm.take_control()
        return "in control"

    def release_control(self, request: Any) -> str:
        """Let another client move the arm."""
        self._rest()
        self._arm.release_control()
        return "control is free"

    # ------------------------------------------------------------------------------------ limits

    def set_override(self, request: Any) -> Answer:
        """Set the cabinet's application override."""
        return self._driver.set_override(request.value)

    def set_speed(self, request: Any) -> str:
        """Set the ceiling of the speed of motions that come."""
        self._arm.speed = request.value
        return f"ceiling of the speed is {request.value:g}"

    # ------------------------------------------------------------------------------------- modes

    def position(self, request: Any) -> str:
        """Stiff position control for the motions that come."""
        return self._set(Position())

    def joint_impedance(self, request: Any) -> str:
        """Joint impedance for the motions that come."""
        return self._set(
            JointImpedance(_scalar(request.stiffness, ()), damping=_scalar(request.damping, DAMPING))
        )

    def cartesian_impedance(self, request: Any) -> str:
        """Cartesian impedance for the motions that come."""
        nullspace = list(request.nullspace) or [NULLSPACE_STIFFNESS]
        return self._set(
            CartesianImpedance(
                list(request.stiffness) or STIFFNESS,
                damping=_scalar(request.damping, DAMPING),
                nullspace_stiffness=nullspace[0],
                nullspace_damping=nullspace[1] if len(nullspace) > 1 else DAMPING,
                additional_force=list(request.additional_force) or (0.0,) * 6,
                max_force=list(request.max_force) or None,
                max_force_stops=bool(request.max_force_stops),
                max_velocity=list(request.max_velocity) or None,
                max_deviation=list(request.max_deviation) or None,
                frame=request.frame or "tool",
            )
        )

    def sine(self, request: Any) -> str:
        """A sine of a force over Cartesian impedance for the motions that come."""
        none = (0.0,) * 6
        return self._set(
            SineImpedance(
                CartesianImpedance(
                    list(request.stiffness) or STIFFNESS, damping=_scalar(request.damping, DAMPING)
                ),
                amplitude=list(request.amplitude) or none,
                frequency=list(request.frequency) or none,
                phase=list(request.phase) or none,
                bias=list(request.bias) or none,
                force_limit=list(request.force_limit) or None,
                position_limit=list(request.position_limit) or None,
                rise_time=request.rise_time,
                hold_time=request.hold_time[0] if len(request.hold_time) else None,
                fall_time=request.fall_time,
            )
        )

    def _set(self, mode: Mode) -> str:
        self._rest()
        self._mode.close()
        self._mode.enter_context(self._arm.using(mode))
        return f"from the next motion on: {type(mode).__name__}"

    # ------------------------------------------------------------------------------------- tools

    def attach_tool(self, request: Any) -> str:
        """Tell the cabinet what hangs on the flange."""
        self._rest()
        tool: Tool | str = request.name
        if not request.known:
            place, turn = request.tcp.position, request.tcp.orientation
            quat = (turn.x, turn.y, turn.z, turn.w)
            tcp = Pose.of((place.x, place.y, place.z), quat if any(quat) else (0.0, 0.0, 0.0, 1.0))
            com = request.com
            tool = Tool(request.name, mass=request.mass, com=(com.x, com.y, com.z), tcp=tcp)
        self._arm.attach_tool(tool, frame=request.frame or None)
        return f"{request.name} is attached"

    def detach_tool(self, request: Any) -> str:
        """Tell the cabinet that nothing hangs on the flange."""
        self._rest()
        self._arm.detach_tool()
        self._workpiece = None
        return "nothing is attached"

    def attach_workpiece(self, request: Any) -> str:
        """Tell the cabinet what the tool holds."""
        self._rest()
        com = request.com
        workpiece = Workpiece(request.name, mass=request.mass, com=(com.x, com.y, com.z))
        self._arm.attach_workpiece(workpiece)
        self._workpiece = workpiece
        return f"{request.name} is held"

    def detach_workpiece(self, request: Any) -> str:
        """Tell the cabinet that the tool does not hold it any more."""
        if self._workpiece is None:
            raise NotReady("nothing that this node attached is held")
        self._rest()
        self._arm.detach_workpiece(self._workpiece)
        self._workpiece = None
        return "nothing is held"

    def tools(self, request: Any) -> Names:
        """Tools that can be attached by name."""
        return _names(self._arm.tools)

    def frames(self, request: Any) -> Names:
        """Taught frames of the project."""
        return _names(self._arm.frames)

    def capabilities(self, request: Any) -> Names:
        """What the cabinet's application can do."""
        return _names(self._arm.capabilities)

    def _rest(self) -> None:
        """Wait until no motion runs; a servo motion ends a moment after its last target.

        Raises:
            NotReady: the node is not active, or a motion runs on.
        """
        if not self._driver.active:
            raise NotReady("the node is not active", hint="activate it")
        try:
            self._arm.wait_until(lambda state: not state.motion or not state.motion.active, timeout=_PATIENCE)
        except Timeout:
            raise NotReady("a motion is under way", hint="stop it first") from None


def _scalar(values: Sequence[float], default: float | tuple[float, ...]) -> Any:
    """One number as a number, several as a list, none as the default."""
    given = [float(value) for value in values]
    return given[0] if len(given) == 1 else given or default


def _names(names: Any) -> Names:
    found = tuple(names)
    return Names(True, ", ".join(found) or "none", found)


@dataclass(frozen=True, slots=True)
class Service:
    """A service of the nodes.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type"; its answers have `success` and `message`, and `names` where the answer is `Names`.
        work: what to do; a text is a success.
        at_once: it never waits behind another one.
    """

    name: str
    type: str
    work: Callable[[Services, Any], Answer | str]
    at_once: bool = False


_TRIGGER, _NUMBER, _NAMES = "std_srvs/Trigger", "heptarm_msgs/SetNumber", "heptarm_msgs/GetNames"
#: All of them.
SERVICES = (
    Service("~/stop", _TRIGGER, Services.stop, at_once=True),
    Service("~/stop_as", "heptarm_msgs/SetText", Services.stop_as, at_once=True),
    Service("~/pause", _TRIGGER, Services.pause, at_once=True),
    Service("~/resume", _TRIGGER, Services.resume, at_once=True),
    Service("~/recover", _TRIGGER, Services.recover),
    Service("~/take_control", _TRIGGER, Services.take_control),
    Service("~/release_control", _TRIGGER, Services.release_control),
    Service("~/set_override", _NUMBER, Services.set_override, at_once=True),
    Service("~/set_speed", _NUMBER, Services.set_speed, at_once=True),
    Service("~/mode/position", _TRIGGER, Services.position),
    Service("~/mode/joint_impedance", "heptarm_msgs/SetJointImpedance", Services.joint_impedance),
    Service("~/mode/cartesian_impedance", "heptarm_msgs/SetCartesianImpedance", Services.cartesian_impedance),
    Service("~/mode/sine_impedance", "heptarm_msgs/SetSineImpedance", Services.sine),
    Service("~/attach_tool", "heptarm_msgs/AttachTool", Services.attach_tool),
    Service("~/detach_tool", _TRIGGER, Services.detach_tool),
    Service("~/attach_workpiece", "heptarm_msgs/AttachWorkpiece", Services.attach_workpiece),
    Service("~/detach_workpiece", _TRIGGER, Services.detach_workpiece),
    Service("~/tools", _NAMES, Services.tools, at_once=True),
    Service("~/frames", _NAMES, Services.frames, at_once=True),
    Service("~/capabilities", _NAMES, Services.capabilities, at_once=True),
)
