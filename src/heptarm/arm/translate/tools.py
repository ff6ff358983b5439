"""Tools, workpieces and frames as messages, and back."""

from __future__ import annotations

from heptarm.arm.translate.fields import message_of, value_of
from heptarm.values.arrays import frozen
from heptarm.values.pose import Pose
from heptarm.values.tool import KnownTool, Tool, Workpiece
from heptarm.wire import messages as wire


def tool_message(tool: Tool | Workpiece) -> wire.ToolInfo:
    """The message of a tool or a workpiece."""
    frames = tuple(wire.FrameInfo(name=name, pose=message_of(wire.Pose, pose)) for name, pose in tool.frames)
    return message_of(wire.ToolInfo, tool, frames=frames)


def known_tool(message: wire.ToolInfo) -> KnownTool:
    """A tool or workpiece that the cabinet knows."""
    frames = tuple((one.name, read_pose(one.pose)) for one in message.frames)
    return value_of(
        KnownTool, message, frames=frames, com=frozen(message.com), inertia=frozen(message.inertia), shapes=()
    )


def read_pose(message: wire.Pose) -> Pose:
    """The pose of a message."""
    return Pose.of(message.xyz, message.quat)
