"""The workspace of a program: where the tool and the joints of an arm may be. No safety function."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Array, Value, finite_entries, numbers, shown, word
from heptarm.values.frames import BASE, check_name

if TYPE_CHECKING:
    from typing import Literal

MODES = ("clamp", "refuse")


@dataclass(frozen=True, slots=True, eq=False)
class Workspace(Value):
    """Where the origin of the tool frame and the joints may be, for `Arm.workspace`.

    It is no safety function: this program checks it, for its own commands, with its own kinematics. Other clients, FRI,
    hand guiding, and a program that has an error in the wrong place do not obey it. Safety functions are configured on
    the robot's controller.

    Args:
        box: two opposite corners, ((x, y, z), (x, y, z)) in `frame`, the lower one first [m]; None: anywhere.
        joints: lowest and highest joint positions, each shape (7,) [rad]; None: those of the robot.
        mode: of streams. "clamp": a target outside is moved to the nearest one inside, a velocity brakes before the
            wall. "refuse": `set` raises `OutsideWorkspace`. A motion that leaves the workspace is refused in both.
        frame: the frame of the box: "base", or a taught frame.

    Raises:
        ShapeError: wrong shapes, neither a box nor joints, or an unknown mode.
        LimitError: a lower corner that is not below the upper one, or a number that is not finite.
    """

    box: Array | None = None
    joints: Array | None = None
    mode: Literal["clamp", "refuse"] = "clamp"
    frame: str = BASE

    def __init__(
        self,
        box: npt.ArrayLike | None = None,
        *,
        joints: npt.ArrayLike | None = None,
        mode: Literal["clamp", "refuse"] = "clamp",
        frame: str = BASE,
    ) -> None:
        if box is None and joints is None:
            raise ShapeError(
                "a workspace must have a box, joints, or both",
                parameter="box",
                hint="for example Workspace(box=((0.3, -0.5, 0.05), (0.8, 0.5, 0.9)))",
            )
        word(mode, "mode", MODES)
        check_name(frame, "frame")
        put = object.__setattr__
        put(self, "box", None if box is None else _range(box, "box", ("x", "y", "z"), "m"))
        axes = tuple(f"A{number}" for number in range(1, 8))
        put(self, "joints", None if joints is None else _range(joints, "joints", axes, "rad"))
        put(self, "mode", mode)
        put(self, "frame", frame)

    def __str__(self) -> str:
        """In words."""
        parts = []
        if self.box is not None:
            parts.append(f"box {np.round(self.box, 4).tolist()} m in {self.frame}")
        if self.joints is not None:
            parts.append(f"joints {np.round(np.degrees(self.joints), 2).tolist()} deg")
        return f"Workspace: {', '.join(parts)}; {self.mode}"


def _range(value: npt.ArrayLike, name: str, axes: tuple[str, ...], unit: str) -> Array:
    """Lowest and highest values, shape (2, n).

    Raises:
        ShapeError: another shape.
        LimitError: not finite, or a lowest value that is not below the highest.
    """
    size = len(axes)
    result = numbers(value, name, f"two lists of {size} numbers")
    if result.shape != (2, size):
        raise ShapeError(
            f"{name} must be the lowest and the highest values, two lists of {size} numbers, got {shown(value)}",
            parameter=name,
            value=value,
        )
    finite_entries(result, name)
    for axis, low, high in zip(axes, *cast("list[list[float]]", result.tolist())):
        if not low < high:
            raise LimitError(
                f"{name} must have a lowest value below the highest, got {low:g} and {high:g} {unit} for {axis}",
                code=2,
                parameter=name,
                value=[low, high],
                hint="give the lower corner first" if unit == "m" else "give the lowest positions first",
            )
    return result
