"""Bodies that a program adds to its model of the world, and what a panel draws of that world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from heptarm.errors import ShapeError
from heptarm.values.checks import Array, Value, frozen, numbers, shown, within
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape

#: Red, green, blue and opacity, 0 to 1.
Color: TypeAlias = tuple[float, float, float, float]

#: The colour of a body for which nobody has chosen one.
WOOD: Color = (0.7, 0.6, 0.45, 1.0)
_NAMES = ("red", "green", "blue", "opacity")


@dataclass(frozen=True, slots=True, eq=False)
class WorldBody(Value):
    """A body of a world.

    Attributes:
        name: of the body.
        shapes: in its frame; none: a cloud of points, or a body of the scene.
        pose: of its frame, in the base; of one that the arm holds, in the flange frame.
        points: centres of spheres in its frame, shape (n, 3) [m].
        radius: of these spheres [m].
        color: red, green, blue and opacity, 0 to 1.
        is_held: whether the arm holds it.
    """

    name: str
    shapes: tuple[Shape | Mesh, ...]
    pose: Pose
    points: Array = field(default_factory=lambda: frozen(np.zeros((0, 3))))
    radius: float = 0.0
    color: Color = WOOD
    is_held: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class WorldArm(Value):
    """Another arm in a world.

    Attributes:
        name: of the arm.
        robot: its name, such as "iiwa14".
        pose: of its base in the base of the arm whose world it is.
        q: its posture, shape (7,) [rad].
        shapes: on its flange, in the flange frame.
    """

    name: str
    robot: str
    pose: Pose
    q: Array
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class WorldOutline(Value):
    """What a panel shows of a world.

    Attributes:
        robot: name of the robot whose world it is.
        scene: a ready scene by its name, or its file; "": none.
        bodies: that were added.
        placed: free bodies of the scene, without shapes.
        arms: the other arms.
    """

    robot: str
    scene: str = ""
    bodies: tuple[WorldBody, ...] = ()
    placed: tuple[WorldBody, ...] = ()
    arms: tuple[WorldArm, ...] = ()


def checked_color(value: Sequence[float] | None, name: str = "color") -> Color:
    """A colour of three or four numbers from 0 to 1; None: the usual one.

    Raises:
        ShapeError: something else.
        LimitError: a number outside its range.
    """
    if value is None:
        return WOOD
    parts = numbers(value, name, "red, green, blue and perhaps opacity")
    if parts.shape not in ((3,), (4,)):
        raise ShapeError(
            f"{name} must be red, green, blue and perhaps opacity, got {shown(value)}",
            parameter=name,
            value=value,
            hint="for example color=(0.9, 0.3, 0.1)",
        )
    red, green, blue, opacity = (
        within(part, f"{name} ({what})", 0.0, 1.0) for what, part in zip(_NAMES, [*parts.tolist(), 1.0][:4])
    )
    return red, green, blue, opacity
