"""Tools and workpieces: what is attached to the flange, and its frames.

::

    gripper = Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=Pose.at(0, 0, 0.12))

    with arm.tool(gripper):
        arm.move(lin_rel(z=0.05))       # the gripper's tip moves

A tool's frames, centre of mass and inertia are given in the flange frame, a workpiece's in the frame that it is
attached to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, instance, shown, within
from heptarm.values.frames import BASE, FLANGE, SEPARATOR, TOOL, check_name
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import Body
from heptarm.values.shape import Shape, checked_shapes
from heptarm.values.text import lines

#: Heaviest tool [kg], and how far its centre of mass may be from the flange along each axis [m].
HEAVIEST = 50.0
FARTHEST = 2.0
_MOST_FRAMES = 32
_LONGEST_NAME = 64
_LONGEST_FRAME = 128
_ORIGIN = (0.0, 0.0, 0.0)
_NO_INERTIA = (0.0,) * 6
_TCP = "tcp"


@dataclass(frozen=True, slots=True, eq=False, init=False)
class _Carried(Value):
    name: str
    mass: float
    com: Array
    inertia: Array
    frames: tuple[tuple[str, Pose], ...]
    shapes: tuple[Shape, ...]

    def __init__(
        self,
        name: str,
        *,
        mass: float = 0.0,
        com: npt.ArrayLike = _ORIGIN,
        inertia: npt.ArrayLike = _NO_INERTIA,
        tcp: Pose | None = None,
        frames: Mapping[str, Pose] | None = None,
        shapes: Sequence[Shape] = (),
    ) -> None:
        _set(self, "name", _checked(name, "name", _LONGEST_NAME))
        _set(self, "mass", within(mass, "mass", 0.0, HEAVIEST, unit="kg"))
        _set(self, "com", array(com, 3, "com"))
        for index, value in enumerate(self.com.tolist()):
            within(value, f"com[{index}]", -FARTHEST, FARTHEST, unit="m")
        _set(self, "inertia", Body(self.mass, self.com, inertia=array(inertia, 6, "inertia")).inertia)
        _set(self, "frames", _frames(tcp, {} if frames is None else frames))
        _set(self, "shapes", checked_shapes(shapes, "shapes"))

    def __str__(self) -> str:
        """Name, load data, frames and shapes, a line each."""
        return _text(self)

    @property
    def body(self) -> Body:
        """Mass, centre of mass and inertia."""
        return Body(self.mass, self.com, inertia=self.inertia)

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Names of its frames, the default one first."""
        return tuple(name for name, _ in self.frames)

    @property
    def tcp(self) -> Pose:
        """Its default frame: the first; without any its own origin."""
        return self.frames[0][1] if self.frames else Pose.of(_ORIGIN)

    def frame(self, name: str) -> Pose:
        """One of its frames.

        Raises:
            CommandRejected: it has none of that name; the text lists them.
        """
        found = dict(self.frames).get(name)
        if found is None:
            raise unknown(name, "frame", self.frame_names)
        return found


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Tool(_Carried):
    """A tool on the flange.

    Args:
        name: up to 64 bytes, without a "/"; its name on the cabinet.
        mass: [kg], up to 50.
        com: centre of mass, shape (3,) [m], within 2 m of the flange along each axis.
        inertia: xx yy zz xy xz yz about the centre of mass, axes of the flange, shape (6,) [kg m²].
        tcp: flange to tip; the frame "tcp", the motion frame unless a motion names another.
        frames: more frames, flange to frame, by name; without `tcp` the first is the motion frame.
        shapes: what of it collides and is drawn, in the flange frame, at most 16; see `heptarm.shapes`. A robot does
            not know them.

    Raises:
        ShapeError: wrong types, or an empty or too long name.
        LimitError: a number outside its range, an inertia that no body has, or a reserved name.
        CommandRejected: two frames of one name.
    """


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Workpiece(_Carried):
    """A workpiece, attached to the tool frame, without a tool to the flange.

    Args:
        name: up to 64 bytes, without a "/".
        mass: [kg], up to 50.
        com: centre of mass in the frame that it is attached to, shape (3,) [m], within 2 m of it along each axis.
        inertia: xx yy zz xy xz yz about the centre of mass, axes of that frame, shape (6,) [kg m²].
        tcp: that frame to a point of the workpiece; its frame "tcp".
        frames: more frames, by name.
        shapes: what of it collides and is drawn, in that frame, at most 16; see `heptarm.shapes`.

    Raises:
        ShapeError: wrong types, or an empty or too long name.
        LimitError: a number outside its range, an inertia that no body has, or a reserved name.
        CommandRejected: two frames of one name.
    """


@dataclass(frozen=True, slots=True, eq=False)
class KnownTool(Value):
    """A tool or workpiece that the cabinet knows by name.

    Attributes:
        name: for `arm.tool`.
        mass: [kg].
        frames: its frames, flange to frame; the default one first.
        com: centre of mass in the flange frame, shape (3,) [m].
        inertia: xx yy zz xy xz yz about the centre of mass, axes of the flange, shape (6,) [kg m²].
        shapes: what of it collides and is drawn, in the flange frame; a template of the project has none.
    """

    name: str
    mass: float
    frames: tuple[tuple[str, Pose], ...] = ()
    com: Array = field(default_factory=lambda: frozen(np.zeros(3)))
    inertia: Array = field(default_factory=lambda: frozen(np.zeros(6)))
    shapes: tuple[Shape, ...] = ()

    def __str__(self) -> str:
        """Name, load data, frames and shapes, a line each."""
        return _text(self)

    @property
    def body(self) -> Body:
        """Mass, centre of mass and inertia."""
        return Body(self.mass, self.com, inertia=self.inertia)

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Names of its frames."""
        return tuple(name for name, _ in self.frames)


def as_tool(tool: Tool | KnownTool | str) -> Tool:
    """The tool itself; one of a known tool; of a name a new one, which weighs nothing.

    Raises:
        ShapeError: it is none of these.
    """
    if isinstance(tool, Tool):
        return tool
    if isinstance(tool, str):
        return Tool(tool)
    known = instance(tool, KnownTool, "tool", hint="a Tool, one of arm.tools, or the name of a new one")
    return Tool(
        known.name,
        mass=known.mass,
        com=known.com,
        inertia=known.inertia,
        frames=dict(known.frames),
        shapes=known.shapes,
    )


def _text(tool: _Carried | KnownTool) -> str:
    """Name, load data, frames and shapes, a line each."""
    rows = {
        "mass": f"{tool.mass:g} kg",
        "com": " ".join(f"{v * 1e3:.1f}" for v in tool.com) + " mm from the flange",
        "inertia": " ".join(f"{v:.4g}" for v in tool.inertia) + " kg m² (xx yy zz xy xz yz)",
    }
    frames = {name: str(pose) for name, pose in tool.frames}
    shapes = {"shapes": "\n".join(map(str, tool.shapes))}
    return lines(f"{type(tool).__name__} {tool.name}", rows | frames | shapes)


def unknown(name: str, parameter: str, known: tuple[str, ...]) -> CommandRejected:
    """The error of an unknown name."""
    listed = ", ".join(known) or "none"
    return CommandRejected(
        f"{parameter} must be one of {listed}, got {shown(name)}",
        code=42,
        parameter=parameter,
        value=name,
        allowed=listed,
    )


def _frames(tcp: Pose | None, more: Mapping[str, Pose]) -> tuple[tuple[str, Pose], ...]:
    if not isinstance(more, Mapping):
        raise ShapeError(
            f"frames must be poses by name, got {shown(more)}",
            parameter="frames",
            value=more,
            hint='for example {"tip": Pose.at(0, 0, 0.1)}',
        )
    if tcp is not None and _TCP in more:
        raise CommandRejected(
            'the frame "tcp" is given twice', parameter="frames", hint="leave out tcp= or the frame"
        )
    pairs = ((_TCP, tcp), *more.items()) if tcp is not None else tuple(more.items())
    if len(pairs) > _MOST_FRAMES:
        raise ShapeError(
            f"frames must be at most {_MOST_FRAMES}, got {len(pairs)}",
            code=3,
            parameter="frames",
            value=len(pairs),
        )
    for index, (name, pose) in enumerate(pairs):
        at = f"frames[{index}]"
        if _checked(name, f"{at}.name", _LONGEST_FRAME) in (TOOL, FLANGE, BASE):
            raise LimitError(
                f"{at}.name must not be the reserved name {name!r}",
                code=2,
                parameter=f"{at}.name",
                value=name,
                allowed=f'any but "{TOOL}", "{FLANGE}", "{BASE}"',
            )
        check_pose(pose, f"{at}.pose")
    return pairs


def _checked(name: str, parameter: str, longest: int) -> str:
    if SEPARATOR in check_name(name, parameter, longest=longest, hint=""):
        raise LimitError(
            f'{parameter} must not contain "{SEPARATOR}", got {shown(name)}',
            code=2,
            parameter=parameter,
            value=name,
            allowed=f'no "{SEPARATOR}"',
        )
    return name


def _set(value: Value, name: str, content: object) -> None:
    object.__setattr__(value, name, content)
