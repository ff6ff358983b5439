"""Shapes of tools and workpieces: what collides, and is drawn.

::

    from heptarm import shapes

    finger = shapes.box(0.02, 0.02, 0.06, at=Pose.at(0, 0.03, 0.15))

A tool's shapes are in the flange frame, a workpiece's in the frame that it is attached to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, instance, shown, within, word
from heptarm.values.pose import Pose, check_pose

ShapeKind: TypeAlias = Literal["box", "cylinder", "sphere", "capsule"]

#: Largest size [m], and how far the middle of a shape may be from its frame's origin along each axis [m].
LARGEST = 4.0
FARTHEST = 2.0
#: Most shapes of a tool or a workpiece.
MOST_SHAPES = 16
#: What the numbers of `size` are, by kind.
_SIZES = {
    "box": ("x", "y", "z"),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
}
#: Pose of the frame itself.
ORIGIN = Pose.of((0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Shape(Value):
    """A solid shape; make one with `box`, `cylinder`, `sphere` or `capsule` of `heptarm.shapes`.

    Attributes:
        kind: "box", "cylinder", "sphere" or "capsule".
        size: shape (3,) [m]: of a box its edges; otherwise the radius and the length along z, 0 where a shape has none.
        pose: of its middle and axes, in the frame of the tool or workpiece.

    Raises:
        ShapeError: wrong types, or an unknown kind.
        LimitError: a size outside (0, 4] m, one that the kind has not, or a middle farther than 2 m along an axis.
    """

    kind: ShapeKind
    size: Array
    pose: Pose = ORIGIN

    def __post_init__(self) -> None:
        word(self.kind, "kind", get_args(ShapeKind))
        object.__setattr__(self, "size", array(self.size, 3, "size"))
        names = _SIZES[self.kind]
        for index, value in enumerate(self.size.tolist()):
            if index < len(names):
                within(value, f"size[{index}]", 0.0, LARGEST, above=True, unit="m")
            elif value != 0.0:
                raise LimitError(
                    f"size[{index}] of a {self.kind} must be 0, got {value:g} m: it has {' and '.join(names)} alone",
                    code=2,
                    parameter=f"size[{index}]",
                    value=value,
                    allowed="0",
                )
        check_near(self.pose, "pose")

    def __str__(self) -> str:
        """In words: "cylinder, radius 30.0 mm, length 100.0 mm, at x ..."."""
        names = _SIZES[self.kind]
        sizes = ", ".join(f"{name} {value * 1e3:.1f} mm" for name, value in zip(names, self.size.tolist()))
        return f"{self.kind}, {sizes}, at {self.pose}"


def box(x: float, y: float, z: float, *, at: Pose = ORIGIN) -> Shape:
    """A box.

    Args:
        x: edge along its x axis [m], up to 4.
        y: edge along its y axis.
        z: edge along its z axis.
        at: pose of its middle, within 2 m of the frame's origin along each axis.

    Raises:
        ShapeError: not numbers, or `at` is no pose.
        LimitError: a number outside its range.
    """
    return _made("box", (x, y, z), at)


def cylinder(radius: float, length: float, *, at: Pose = ORIGIN) -> Shape:
    """A cylinder along the z axis of `at`.

    Args:
        radius: [m], up to 4.
        length: [m], up to 4.
        at: pose of its middle; likewise as in `box`.

    Raises:
        ShapeError: not numbers, or `at` is no pose.
        LimitError: a number outside its range.
    """
    return _made("cylinder", (radius, length), at)


def sphere(radius: float, *, at: Pose = ORIGIN) -> Shape:
    """A sphere.

    Args:
        radius: [m], up to 4.
        at: pose of its middle; likewise as in `box`.

    Raises:
        ShapeError: not numbers, or `at` is no pose.
        LimitError: a number outside its range.
    """
    return _made("sphere", (radius,), at)


def capsule(radius: float, length: float, *, at: Pose = ORIGIN) -> Shape:
    """A cylinder along the z axis of `at` with a half sphere at both ends.

    Args:
        radius: [m], up to 4.
        length: of the cylinder, between the centres of the half spheres [m], up to 4.
        at: pose of its middle; likewise as in `box`.

    Raises:
        ShapeError: not numbers, or `at` is no pose.
        LimitError: a number outside its range.
    """
    return _made("capsule", (radius, length), at)


def checked_shapes(value: Sequence[Shape], name: str) -> tuple[Shape, ...]:
    """A list of shapes as a tuple.

    Raises:
        ShapeError: it is something else, or has more than 16.
    """
    if not isinstance(value, (list, tuple)):
        raise ShapeError(
            f"{name} must be a list of shapes, got {shown(value)}",
            parameter=name,
            value=value,
            hint="for example [heptarm.shapes.box(0.1, 0.1, 0.2)]",
        )
    if len(value) > MOST_SHAPES:
        raise ShapeError(
            f"{name} must be at most {MOST_SHAPES}, got {len(value)}",
            code=3,
            parameter=name,
            value=len(value),
        )
    return tuple(instance(shape, Shape, f"{name}[{index}]") for index, shape in enumerate(value))


def _made(kind: ShapeKind, sizes: tuple[float, ...], at: Pose) -> Shape:
    checked = [
        within(value, name, 0.0, LARGEST, above=True, unit="m") for name, value in zip(_SIZES[kind], sizes)
    ]
    check_near(at, "at")
    return Shape(kind, frozen(np.array(checked + [0.0] * (3 - len(checked)))), at)


def check_near(pose: Pose, name: str) -> None:
    """Refuse a pose farther than 2 m from the origin along an axis."""
    check_pose(pose, name)
    for index, value in enumerate(pose.xyz.tolist()):
        within(value, f"{name}.xyz[{index}]", -FARTHEST, FARTHEST, unit="m")
