"""Tools, workpieces and frames: which exist, what is attached, and what the names of frames mean."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy.typing as npt

from heptarm.arm.link.connection import Connection
from heptarm.arm.translate.tools import known_tool, read_pose, tool_message
from heptarm.errors import ShapeError, Timeout
from heptarm.model.kinematics import forward
from heptarm.values.checks import instance
from heptarm.values.clearance import CollisionWorld
from heptarm.values.condition.condition import Condition
from heptarm.values.frames import BASE, FLANGE, SEPARATOR, TOOL, check_name
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.mode import Mode
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose
from heptarm.values.robot import Body
from heptarm.values.shape import Shape
from heptarm.values.state import State, Wrench
from heptarm.values.tool import KnownTool, Tool, Workpiece, unknown
from heptarm.wire import messages as wire

_log = logging.getLogger("heptarm.arm")

_ORIGIN = Pose.of((0.0, 0.0, 0.0))
#: Longest wait for a state of the robot with what has just been attached [s].
_SHOWN = 1.0
_Model = TypeVar("_Model")


@dataclass(frozen=True, slots=True)
class Attachment:
    """What is attached to the flange.

    Attributes:
        tool: name of the tool; empty: none.
        workpiece: name of the workpiece; empty: none.
        frame: the motion frame unless a motion names another: a frame of the tool, or "flange".
    """

    tool: str = ""
    workpiece: str = ""
    frame: str = FLANGE


class Tooling:
    """Tools, workpieces and frames of one arm, as far as this client knows them.

    While this client controls the robot, the attached tool is the one that it attached last; otherwise it is the one
    in the newest state. Where neither is known, the cabinet checks the names.

    Args:
        connection: to the cabinet.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._saved: dict[str, Tool] = {}
        self._defined: dict[str, KnownTool] = {}
        self._workpiece: Workpiece | None = None
        self._commanded: Attachment | None = None

    def forget(self) -> None:
        """Forget what this client attached: another client may have changed it."""
        self._commanded = self._workpiece = None

    def remember(self, tools: Sequence[Tool]) -> None:
        """Know the tools that are saved with the target; one is defined on the cabinet when it is attached."""
        self._saved = {tool.name: tool for tool in tools}

    @property
    def known(self) -> dict[str, KnownTool]:
        """Tools by name: the saved ones, those that the cabinet reported, and those that this client defined."""
        saved = {name: _known(tool) for name, tool in self._saved.items()}
        reported = {tool.name: known_tool(tool) for tool in self._connection.welcome.tools}
        event = self._connection.events.attached
        latest = {} if event is None or event.tool is None else {event.tool.name: known_tool(event.tool)}
        return reported | saved | self._defined | latest

    @property
    def taught(self) -> dict[str, Pose]:
        """Taught frames of the project by name, in the base frame."""
        return {frame.name: read_pose(frame.pose) for frame in self._connection.welcome.frames}

    @property
    def attached(self) -> Attachment | None:
        """What is attached to the flange; None: not known."""
        if self._commanded is not None and self._connection.in_control:
            return self._commanded
        newest = self._connection.newest()
        if newest is None or newest.groups.mode is None:
            return None
        return Attachment(newest.groups.mode.tool, newest.groups.mode.workpiece, newest.groups.mode.frame)

    @property
    def load(self) -> Body | None:
        """Mass, centre of mass and inertia of what is attached, in the flange frame; None: nothing that is known."""
        tool, workpiece, at = self._carried()
        if workpiece is None:
            return None if tool is None else tool.body
        held = workpiece.body.placed(at)
        return held if tool is None else tool.body.joined(held)

    def _carried(self) -> tuple[KnownTool | None, Workpiece | KnownTool | None, Pose]:
        """The attached tool and workpiece as far as they are known, and the frame that holds the workpiece."""
        attached = self.attached
        if attached is None:
            return None, None, _ORIGIN
        return self.known.get(attached.tool), self._held(attached), self.on_flange(attached.frame)

    def _held(self, attached: Attachment) -> Workpiece | KnownTool | None:
        """The attached workpiece as far as it is known: this client's, or the one that the cabinet reported."""
        event = self._connection.events.attached
        held: Workpiece | KnownTool | None = self._workpiece
        if held is None and event is not None and event.workpiece is not None:
            held = known_tool(event.workpiece)
        return held if held is not None and held.name == attached.workpiece else None

    def loaded(self, model: _Model) -> _Model:
        """A model of collisions with the shapes of what is attached, if it has a place for them."""
        if not isinstance(model, CollisionWorld):
            return model
        tool, held, at = self._carried()
        loaded: _Model = model.carrying(tool, held, at=at)
        return loaded

    @property
    def shapes(self) -> tuple[tuple[Shape, Pose], ...]:
        """Shapes of what is attached, each with its pose in the flange frame."""
        tool, held, at = self._carried()
        own = () if tool is None else tuple((shape, shape.pose) for shape in tool.shapes)
        return own if held is None else own + tuple((shape, at @ shape.pose) for shape in held.shapes)

    # ------------------------------------------------------------------------------- attaching

    def attach(self, tool: Tool | str, frame: str | None) -> None:
        """Attach a tool, after defining it if it is a `Tool`; see `Arm.attach_tool`."""
        if frame is not None:
            check_name(frame, "frame")
        if isinstance(tool, str) and tool not in self._defined:
            tool = self._saved.get(tool, tool)
        if isinstance(tool, Tool):
            main = frame if frame is not None else (tool.frame_names or (FLANGE,))[0]
            if frame is not None:
                tool.frame(frame)
            self._connection.request(wire.DefineTool(tool=tool_message(tool)))
            self._defined[tool.name] = _known(tool)
            name = tool.name
        elif isinstance(tool, str):
            name, main = check_name(tool, "tool", hint="name a tool of the project"), frame or ""
        else:
            raise ShapeError(
                f"tool must be a Tool or the name of one, got {tool!r}", parameter="tool", value=tool
            )
        self._connection.request(wire.AttachTool(name=name, frame=frame or ""))
        if not main and name in self.known:
            main = (self.known[name].frame_names or (FLANGE,))[0]
        self._workpiece = None
        self._commanded = Attachment(name, "", main) if main else None
        self._wait_until_shown(name, "")
        self._warn_of_load()

    def _warn_of_load(self) -> None:
        """Log a warning if what is attached is heavier than the robot's rated load."""
        tool, held, _ = self._carried()
        mass = sum(body.mass for body in (tool, held) if body is not None)
        robot = self._connection.robot
        if mass > robot.rated_load:
            _log.warning(
                "the attached load is %.3g kg, and the rated load of the %s is %g kg: check the mass, or move slowly; "
                "drives and brakes may fail, and collisions are detected late",
                mass,
                robot.title,
                robot.rated_load,
            )

    def detach(self) -> None:
        """Detach the tool and its workpiece; has no effect if nothing is attached."""
        self._connection.request(wire.AttachTool(name="", frame=""))
        self._commanded, self._workpiece = Attachment(), None
        self._wait_until_shown("", "")

    def _wait_until_shown(self, tool: str, workpiece: str) -> None:
        """Wait until the newest state is of the robot with what is attached now: its pose is that of the motion frame.

        A state without the tool in it, or a cabinet that reports none for a while, is no error.
        """
        newest = self._connection.newest()
        if newest is None or newest.groups.mode is None or newest.groups.pose is None:
            return
        before, since = newest.groups.mode.stamp, list[int]()

        def is_shown(state: State) -> bool:
            mode, pose = state.groups.mode, state.groups.pose
            if mode is None or pose is None or mode.stamp <= before:
                return False
            if (mode.tool, mode.workpiece) != (tool, workpiece):
                return False
            since.append(mode.stamp)
            return pose.stamp > since[0]

        with contextlib.suppress(Timeout):
            self._connection.wait_for(is_shown, _SHOWN)

    def attach_workpiece(self, workpiece: Workpiece | str, *, safety: bool) -> None:
        """Attach a workpiece, or that of a template; see `Arm.attach_workpiece`."""
        load = _as_workpiece(workpiece)
        instance(safety, bool, "safety")
        before = self.attached
        self._connection.request(
            wire.AttachLoad(
                load=tool_message(load), attached=True, template=isinstance(workpiece, str), safety=safety
            )
        )
        self._workpiece = None if isinstance(workpiece, str) else workpiece
        self._commanded = None if before is None else Attachment(before.tool, load.name, before.frame)
        if before is not None:
            self._wait_until_shown(before.tool, load.name)
        self._warn_of_load()

    def detach_workpiece(self, workpiece: Workpiece | str) -> None:
        """Detach a workpiece; see `Arm.detach_workpiece`."""
        before = self.attached
        self._connection.request(wire.AttachLoad(load=tool_message(_as_workpiece(workpiece)), attached=False))
        self._workpiece = None
        self._commanded = None if before is None else Attachment(before.tool, "", before.frame)
        if before is not None:
            self._wait_until_shown(before.tool, "")

    def restore(self, before: Attachment | None) -> None:
        """Attach an earlier tool again, or none."""
        if before is None or not before.tool:
            self.detach()
        else:
            self.attach(before.tool, None if before.frame == FLANGE else before.frame)

    # ------------------------------------------------------------------------------------- names

    def _flange_frames(self) -> dict[str, Pose] | None:
        """Poses of the frames on the flange in the flange frame, by all their names; None: not known."""
        attached = self.attached
        if attached is None:
            return None
        frames: dict[str, Pose] = {}
        if attached.tool:
            tool = self.known.get(attached.tool)
            if tool is None:
                return None
            for name, pose in tool.frames:
                frames[name] = frames[f"{tool.name}{SEPARATOR}{name}"] = pose
        tip = frames.get(attached.frame, _ORIGIN)
        if attached.workpiece:
            workpiece = self._held(attached)
            if workpiece is None:
                return None
            for name, pose in workpiece.frames:
                frames.setdefault(name, tip @ pose)
                frames[f"{workpiece.name}{SEPARATOR}{name}"] = tip @ pose
        return {FLANGE: _ORIGIN, TOOL: tip} | frames

    def check_motion_frame(self, name: str, parameter: str) -> None:
        """Refuse a motion frame that is not on the flange; raises CommandRejected."""
        frames = self._flange_frames()
        if frames is not None and name not in frames:
            raise unknown(name, parameter, tuple(frames))

    def check_reference(self, name: str, parameter: str) -> None:
        """Refuse an unknown reference frame; raises CommandRejected."""
        frames = self._flange_frames()
        if frames is not None and name not in frames and name != BASE and name not in self.taught:
            raise unknown(name, parameter, (*frames, BASE, *self.taught))

    def check(self, motions: Sequence[Motion], mode: Mode | None) -> None:
        """Refuse motions and a mode that name unknown frames; raises CommandRejected."""
        for index, motion in enumerate(motions):
            at = f"motions[{index}]." if len(motions) > 1 else ""
            moving, axes = getattr(motion, "moving", TOOL), getattr(motion, "frame", TOOL)
            if moving != TOOL:
                self.check_motion_frame(moving, f"{at}moving")
            if axes != TOOL:
                self.check_reference(axes, f"{at}frame")
        self.check_mode(mode)

    def check_until(self, parts: Sequence[Condition]) -> None:
        """Refuse conditions that name unknown frames; raises CommandRejected."""
        for index, part in enumerate(parts):
            axes = getattr(part, "frame", TOOL)
            if isinstance(axes, str) and axes != TOOL:
                self.check_reference(axes, f"until[{index}].frame")

    def check_mode(self, mode: Mode | None) -> None:
        """Refuse a mode that names an unknown frame; raises CommandRejected."""
        base = mode.base if isinstance(mode, SineImpedance) else mode
        if isinstance(base, CartesianImpedance) and base.frame != TOOL:
            self.check_reference(base.frame, "mode.frame")

    # ------------------------------------------------------------------------------------ frames

    def pose(self, state: State, name: str) -> Pose:
        """Pose of a frame in the base frame.

        Raises:
            CommandRejected: no such frame is known.
            StaleState: the state lacks the joints.
        """
        if name == BASE:
            return _ORIGIN
        taught = self.taught
        if name in taught:
            return taught[name]
        if name == TOOL and state.groups.pose is not None:
            return state.pose
        frames = self._flange_frames() or {FLANGE: _ORIGIN}
        if name not in frames:
            raise unknown(name, "frame", (*frames, BASE, *taught))
        return Pose.from_matrix(forward(self._connection.robot, state.q)) @ frames[name]

    def reached(self, q: npt.ArrayLike, moving: str) -> Pose | None:
        """Pose of a motion frame in the base at joint positions, shape (7,) [rad]; None: the frame is not known."""
        tip = (self._flange_frames() or {FLANGE: _ORIGIN}).get(moving)
        return None if tip is None else Pose.from_matrix(forward(self._connection.robot, q)) @ tip

    @property
    def fixed(self) -> dict[str, Pose]:
        """The fixed frames by name, in the base frame: the base itself, and the taught ones."""
        return {BASE: _ORIGIN} | self.taught

    def on_flange(self, name: str) -> Pose:
        """Pose of a frame on the flange in the flange frame; of an unknown one the flange itself."""
        return (self._flange_frames() or {}).get(name, _ORIGIN)

    def in_base(self, name: str) -> Pose | None:
        """Pose of a fixed frame in the base: the base itself, or a taught frame; None: it is no fixed one."""
        return self.fixed.get(name)

    def axes(self, frame: str | Pose) -> Callable[[Pose], Pose]:
        """A function that returns a frame's pose in the base, by the pose of the flange.

        Args:
            frame: its name, or its pose in the base.

        Raises:
            CommandRejected: no such frame is known.
        """
        if isinstance(frame, str):
            self.check_reference(frame, "frame")
            fixed = self.in_base(frame)
            if fixed is None:
                moved = self.on_flange(frame)
                return lambda flange: flange @ moved
        else:
            fixed = frame
        return lambda _: fixed

    def wrench(self, state: State, name: str, axes: str) -> Wrench:
        """External force and torque at the origin of one frame in the axes of another; raises as `pose` does."""
        lever = self.pose(state, TOOL).xyz - self.pose(state, name).xyz
        return state.wrench.seen(lever, self.pose(state, axes).rotation)


def _known(tool: Tool) -> KnownTool:
    return KnownTool(tool.name, tool.mass, tool.frames, tool.com, tool.inertia, tool.shapes)


def _as_workpiece(workpiece: Workpiece | str) -> Workpiece:
    """The workpiece itself; of a name one of that name, of which nothing else is known."""
    instance(workpiece, (Workpiece, str), "workpiece")
    return Workpiece(workpiece) if isinstance(workpiece, str) else workpiece
