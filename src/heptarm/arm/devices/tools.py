"""Which tools the cabinet knows, what hangs on the flange, and what the names of frames mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from heptarm.errors import ShapeError
from heptarm.model.kinematics import forward
from heptarm.values.condition import Condition
from heptarm.values.mode import CartesianImpedance, Mode, SineImpedance
from heptarm.values.motion import TOOL, Motion
from heptarm.values.pose import Pose
from heptarm.values.state import State, Wrench
from heptarm.values.tool import BASE, FLANGE, SEPARATOR, KnownTool, Tool, Workpiece, unknown
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

_ORIGIN = Pose.of((0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Fitted:
    """What hangs on the flange.

    Attributes:
        tool: its name; empty: none.
        workpiece: its name; empty: none.
        frame: what motions move unless they say another: a frame of the tool's, or "flange".
    """

    tool: str = ""
    workpiece: str = ""
    frame: str = FLANGE


class Tooling:
    """Tools of one arm, as far as this client knows.

    What hangs on the flange is what this client has said last while it controls the robot, otherwise what the newest
    state says. Where neither is known, names are left to the cabinet to refuse.

    Args:
        connection: to the cabinet.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._defined: dict[str, KnownTool] = {}
        self._piece: Workpiece | None = None
        self._said: Fitted | None = None

    def forget(self) -> None:
        """Another client may have changed what hangs on the flange."""
        self._said = self._piece = None

    @property
    def known(self) -> dict[str, KnownTool]:
        """Tools by name: of the project as far as the cabinet names them, and defined ones."""
        told = {tool.name: known_tool(tool) for tool in self._connection.welcome.tools}
        return told | self._defined

    @property
    def taught(self) -> dict[str, Pose]:
        """Taught frames of the project by name, in the base frame."""
        return {frame.name: _pose(frame.pose) for frame in self._connection.welcome.frames}

    @property
    def fitted(self) -> Fitted | None:
        """What hangs on the flange; None: not known here."""
        if self._said is not None and self._connection.controls:
            return self._said
        newest = self._connection.newest()
        if newest is None or newest.control is None:
            return None
        return Fitted(newest.control.tool, newest.control.workpiece, newest.control.frame)

    # ------------------------------------------------------------------------------- on the flange

    def attach(self, tool: Tool | str, frame: str | None) -> None:
        """Attach a tool, defining it before if it is given as a value; see `Arm.attach_tool`."""
        if isinstance(tool, Tool):
            main = frame if frame is not None else (tool.frame_names or (FLANGE,))[0]
            if frame is not None:
                tool.frame(frame)
            self._connection.request(wire.DefineTool(tool=tool_message(tool)))
            self._defined[tool.name] = KnownTool(tool.name, tool.mass, tool.frames)
            name = tool.name
        elif isinstance(tool, str):
            name, main = tool, frame or ""
        else:
            raise ShapeError(
                f"tool is {tool!r}; a Tool or the name of one is wanted", parameter="tool", value=tool
            )
        self._connection.request(wire.AttachTool(name=name, frame=frame or ""))
        if not main and name in self.known:
            main = (self.known[name].frame_names or (FLANGE,))[0]
        self._piece = None
        self._said = Fitted(name, "", main) if main else None

    def detach(self) -> None:
        """Take off what hangs on the flange; nothing happens if nothing does."""
        self._connection.request(wire.AttachTool(name="", frame=""))
        self._said, self._piece = Fitted(), None

    def load(self, workpiece: Workpiece) -> None:
        """Attach a workpiece; see `Arm.attach_workpiece`."""
        if not isinstance(workpiece, Workpiece):
            raise ShapeError(
                f"workpiece is {workpiece!r}; a Workpiece is wanted", parameter="workpiece", value=workpiece
            )
        before = self.fitted
        self._connection.request(wire.AttachLoad(load=tool_message(workpiece), attached=True))
        self._piece = workpiece
        self._said = None if before is None else Fitted(before.tool, workpiece.name, before.frame)

    def unload(self, workpiece: Workpiece) -> None:
        """Take a workpiece off; see `Arm.detach_workpiece`."""
        before = self.fitted
        self._connection.request(wire.AttachLoad(load=tool_message(workpiece), attached=False))
        self._piece = None
        self._said = None if before is None else Fitted(before.tool, "", before.frame)

    def restore(self, before: Fitted | None) -> None:
        """Attach the tool that hung on the flange before, if one did."""
        if before is None or not before.tool:
            self.detach()
        else:
            self.attach(before.tool, None if before.frame == FLANGE else before.frame)

    # ------------------------------------------------------------------------------------- names

    def _owned(self) -> dict[str, Pose] | None:
        """Frames on the flange by all their names, seen from the flange; None: not known here."""
        fitted = self.fitted
        if fitted is None:
            return None
        frames: dict[str, Pose] = {}
        if fitted.tool:
            tool = self.known.get(fitted.tool)
            if tool is None:
                return None
            for name, pose in tool.frames:
                frames[name] = frames[f"{tool.name}{SEPARATOR}{name}"] = pose
        moved = frames.get(fitted.frame, _ORIGIN)
        if fitted.workpiece:
            piece = self._piece
            if piece is None or piece.name != fitted.workpiece:
                return None
            for name, pose in piece.frames:
                frames.setdefault(name, moved @ pose)
                frames[f"{piece.name}{SEPARATOR}{name}"] = moved @ pose
        return {FLANGE: _ORIGIN, TOOL: moved} | frames

    def check_moved(self, name: str, parameter: str) -> None:
        """Refuse the name of a frame that cannot be moved; raises CommandRejected."""
        owned = self._owned()
        if owned is not None and name not in owned:
            raise unknown(name, parameter, tuple(owned))

    def check_reference(self, name: str, parameter: str) -> None:
        """Refuse the name of a frame that gives no axes; raises CommandRejected."""
        owned = self._owned()
        if owned is not None and name not in owned and name != BASE and name not in self.taught:
            raise unknown(name, parameter, (*owned, BASE, *self.taught))

    def check(self, motions: Sequence[Motion], mode: Mode | None) -> None:
        """Refuse frames in motions and mode that are not known; raises CommandRejected."""
        for index, motion in enumerate(motions):
            at = f"motions[{index}]." if len(motions) > 1 else ""
            moving, axes = getattr(motion, "moving", TOOL), getattr(motion, "frame", TOOL)
            if moving != TOOL:
                self.check_moved(moving, f"{at}moving")
            if axes != TOOL:
                self.check_reference(axes, f"{at}frame")
        self.check_mode(mode)

    def check_until(self, parts: Sequence[Condition]) -> None:
        """Refuse conditions whose frames are not known; raises CommandRejected."""
        for index, part in enumerate(parts):
            axes = getattr(part, "frame", TOOL)
            if axes != TOOL:
                self.check_reference(axes, f"until[{index}].frame")

    def check_mode(self, mode: Mode | None) -> None:
        """Refuse a mode whose frame is not known; raises CommandRejected."""
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
        if name == TOOL and state.cartesian is not None:
            return state.pose
        owned = self._owned() or {FLANGE: _ORIGIN}
        if name not in owned:
            raise unknown(name, "frame", (*owned, BASE, *taught))
        return Pose.from_matrix(forward(self._connection.robot, state.q)) @ owned[name]

    def wrench(self, state: State, name: str, axes: str) -> Wrench:
        """External force and torque at the origin of one frame in the axes of another; raises as `pose` does."""
        told = state.wrench
        lever = self.pose(state, TOOL).xyz - self.pose(state, name).xyz
        return told.seen(lever, self.pose(state, axes).rotation)


def tool_message(tool: Tool | Workpiece) -> wire.ToolInfo:
    """The message of a tool or a workpiece."""
    return wire.ToolInfo(
        name=tool.name,
        mass=tool.mass,
        com=tuple(tool.com.tolist()),
        inertia=tuple(tool.inertia.tolist()),
        frames=tuple(
            wire.FrameInfo(
                name=name,
                pose=wire.Pose(xyz=tuple(pose.xyz.tolist()), quat=tuple(pose.quat.tolist())),
            )
            for name, pose in tool.frames
        ),
    )


def known_tool(told: wire.ToolInfo) -> KnownTool:
    """What the cabinet says of a tool."""
    return KnownTool(told.name, told.mass, tuple((frame.name, _pose(frame.pose)) for frame in told.frames))


def _pose(told: wire.Pose) -> Pose:
    return Pose.of(told.xyz, told.quat)
