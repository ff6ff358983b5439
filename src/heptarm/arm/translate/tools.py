"""Tools, workpieces and frames as messages, and back."""

from __future__ import annotations

from typing import cast

from heptarm.arm.translate.fields import message_of, value_of
from heptarm.values.checks import frozen
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape, ShapeKind
from heptarm.values.tool import KnownTool, Tool, Workpiece
from heptarm.wire import messages as wire


def tool_message(tool: Tool | Workpiece) -> wire.ToolInfo:
    """The message of a tool or a workpiece."""
    frames = tuple(wire.FrameInfo(name=name, pose=message_of(wire.Pose, pose)) for name, pose in tool.frames)
    shapes = tuple(message_of(wire.Shape, shape) for shape in tool.shapes)
    return message_of(wire.ToolInfo, tool, frames=frames, shapes=shapes)


def known_tool(message: wire.ToolInfo) -> KnownTool:
    """A tool or workpiece that the cabinet knows."""
    frames = tuple((frame.name, read_pose(frame.pose)) for frame in message.frames)
    return value_of(
        KnownTool,
        message,
        frames=frames,
        com=frozen(message.com),
        inertia=frozen(message.inertia),
        shapes=tuple(_shape(shape) for shape in message.shapes),
    )


def _shape(message: wire.Shape) -> Shape:
    return Shape(cast("ShapeKind", message.kind.name.lower()), frozen(message.size), read_pose(message.pose))


def read_pose(message: wire.Pose) -> Pose:
    """The pose of a message."""
    return Pose.of(message.xyz, message.quat)
